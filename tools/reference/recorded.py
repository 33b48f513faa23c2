"""Makes tests/data: the meshes, libigl's curvature of each, and the README with the hashes.

    recorded.py [--only NAME ...]

Run it from anywhere; it writes into the repository that it is in. Numbers come out the same to
rounding on another machine (libigl's SVD differs in the last bits between processors), so the
hashes in README.md tell which files were recorded, not what every machine writes.
"""

import argparse
import hashlib
import json
from pathlib import Path

import numpy as np

import libigl_curvature
import shapes

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
RINGS, SPHERES = [2, 5, 8], [5]


def noisy_torus(rng):
    """Torus with 25 % of an edge length of noise along every axis, turned and renumbered."""
    V, F = shapes.torus(1.0, 0.4, 56, 26, rng, 0.3)
    V = V + rng.uniform(-0.025, 0.025, V.shape)
    return shapes.renumbered(shapes.rotated(V, rng), F, rng)


GENERATED = {
    "sphere": (1, "unit sphere, icosahedron cut three times", lambda rng: shapes.icosphere(3)),
    "torus": (2, "torus around z, radii 1.0 and 0.4, jittered grid, random diagonals", lambda rng: shapes.torus(1.0, 0.4, 56, 26, rng)),
    "cylinder": (3, "open cylinder around z, radius 0.5, z from 0 to 2, irregular", lambda rng: shapes.cylinder(0.5, 2.0, 24, 32, rng)),
    "ellipsoid": (4, "ellipsoid, semi-axes 1.5, 1.0, 0.6 along x, y, z, random points", lambda rng: shapes.ellipsoid((1.5, 1.0, 0.6), 1200, rng)),
    "saddle": (5, "z = (x^2 - y^2) / 2 over the square of half-width 1, random points", lambda rng: shapes.patch(lambda x, y: (x * x - y * y) / 2, 1.0, 800, rng)),
    "bracket": (6, "CAD-like L bracket with sharp edges, fillet and bore", lambda rng: shapes.bracket(0.16)),
    "noisy_torus": (7, "torus with noise of a quarter edge length, turned, renumbered", noisy_torus),
    "broken": (8, "all that can be wrong with a readable mesh, see shapes.broken", shapes.broken),
}
SHIPPED = {
    "spot": "assets/meshes/spot.obj",
    "teapot": "assets/meshes/teapot.obj",
}


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def make(name):
    """Writes mesh (if generated) and reference of one name."""
    if name in SHIPPED:
        mesh = ROOT / SHIPPED[name]
    else:
        mesh = DATA / "meshes" / f"{name}.ply"
        seed, _, build = GENERATED[name]
        shapes.write_ply(mesh, *build(np.random.default_rng(seed)))
    V, F = libigl_curvature.read_mesh(mesh)
    arrays, settings = libigl_curvature.record(V, F, RINGS, SPHERES)
    reference = DATA / "reference" / f"{name}.npz"
    command = f"libigl_curvature.py {mesh.relative_to(ROOT)} -o {reference.relative_to(ROOT)} --rings 2 5 8 --sphere 5"
    libigl_curvature.write_reference(reference, arrays, settings, mesh, command)
    assert reference.stat().st_size < 1_000_000, f"{reference} is over 1 MB"


def readme():
    """The README's text, from the files as they are."""
    rows, hashes, meta = [], [], {}
    for name in sorted(SHIPPED | GENERATED):
        reference = DATA / "reference" / f"{name}.npz"
        with np.load(reference) as data:
            meta = json.loads(bytes(data["meta"]))
            n, m = len(data["V"]), len(data["F"])
            bad = ", ".join(str(len(data[f"{s['prefix']}_bad"])) for s in meta["settings"])
            worst = max(np.nanmax(np.where(np.isfinite(c), c, 0)) for k, c in data.items() if k.endswith("_cond"))
            singular = sum(int((c > 1e12).sum()) for k, c in data.items() if k.endswith("_cond"))
        mesh = ROOT / SHIPPED[name] if name in SHIPPED else DATA / "meshes" / f"{name}.ply"
        what = f"`{SHIPPED[name]}`" if name in SHIPPED else f"seed {GENERATED[name][0]}: {GENERATED[name][1]}"
        size = reference.stat().st_size // 1000
        rows.append(f"| `{name}` | {what} | {n} | {m} | {bad} | {worst:.1e} | {singular} | {size} kB |")
        hashes += [f"    {sha256(p)}  {p.relative_to(ROOT)}" for p in (mesh, reference)]
    table, listing = "\n".join(rows), "\n".join(hashes)
    return f"""# Reference data

What `igl::principal_curvature` says about ten meshes, so that tests need no Python. Made by

    pip install -r tools/reference/requirements.txt
    python tools/reference/recorded.py

with libigl {meta["libigl"]}, numpy {meta["numpy"]}, Python {meta["python"]}; `recorded.py` is `libigl_curvature.py` run on every mesh. The
arrays of a `.npz` file, their shapes and signs are documented at the head of `libigl_curvature.py`.
Settings: `r2`, `r5`, `r8` (k-rings) and `s5` (sphere of five mean edge lengths).

| Name | Mesh | Vertices | Triangles | Bad (r2, r5, r8, s5) | Largest condition | Over 1e12 | Size |
|---|---|---|---|---|---|---|---|
{table}

"Bad" counts the vertices that libigl lists as bad, "Largest condition" is the largest finite condition number of a
design matrix over all settings, "Over 1e12" counts the fits (vertex and setting) above that, singular ones included: libigl's result there is
decided by rounding and by its rank cut of 5 epsilon.

Meshes in `meshes/` are binary PLY with double positions. Those of `spot` and `teapot` ship under `assets/`. The shapes
are made by `tools/reference/shapes.py`; all of them are oriented outward, so a convex one has positive curvature.

SHA-256:

{listing}
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=sorted(SHIPPED | GENERATED))
    for name in parser.parse_args().only:
        make(name)
        print(name)
    (DATA / "README.md").write_text(readme())


if __name__ == "__main__":
    main()
