"""Measures other curvature libraries on the meshes of a study: error, time, memory.

    peers.py MESHES -o PEERS.csv [--build DIR] [--eigen INCLUDE] [--cgal INCLUDE] [--ponca INCLUDE]
             [--trimesh2 CHECKOUT] [--runs 3] [--timeout 300] [--only NAME ...]

MESHES is what `osculate study curvature --export` writes: `meshes.csv` (mesh, shape, vertices, noise, radius,
use), and for every mesh NAME.obj and NAME.exact (kappa_max, kappa_min and the direction of kappa_max as five
doubles a vertex, at the clean positions; NaN where there is no truth). With `use` = scaling only a few settings are
measured.

A row is a peer with a setting on a mesh: error |kappa - exact| * radius of the worse curvature (median, 95 %; a vertex
without an answer counts as infinite), angle to the exact direction where the two curvatures differ by more than
0.05 / radius, microseconds a vertex (median of the runs, one thread, the call only), bytes a vertex beyond the
loaded mesh. Every measurement runs in a process of its own with a time limit, since some of these libraries
crash or hang; such a row has a note and no numbers.

libigl and pymeshlab are measured if they can be imported; CGAL 6, Ponca and trimesh2 if their sources are given:

    --eigen /usr/include/eigen3      Debian's libeigen3-dev
    --cgal /usr/include              Debian's libcgal-dev, version 6 (trixie); needs GMP and MPFR
    --ponca PONCA                    a checkout of github.com/poncateam/ponca
    --trimesh2 TRIMESH2              a checkout of github.com/Forceflow/trimesh2
"""

import os

os.environ.update(IGL_NUM_THREADS="1", OMP_NUM_THREADS="1")  # before any library is loaded

import argparse
import csv
import importlib.util
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
COLUMNS = ["mesh", "shape", "vertices", "noise", "peer", "setting", "median", "p95", "direction_median_deg",
           "direction_p95_deg", "us_per_vertex", "bytes_per_vertex", "undetermined", "note"]  # fmt: skip
SETTINGS = {
    "libigl": [f"r{rings}" for rings in (2, 3, 4, 5, 6, 8)],
    "pymeshlab": ["taubin", "quadric", "scaled2", "scaled3", "scaled5", "scaled8"],
    "cgal": [f"jet{degree}r{rings}" for degree in (2, 3, 4) for rings in (2, 3, 4, 5, 6)]
    + ["icc", "icc1", "icc2", "icc3", "icc5"],
    "ponca": [f"{fit}{scale}" for fit in ("aso", "apss") for scale in (3, 5, 8, 12)],
    "trimesh2": ["tensor"],
}
# What to measure how time grows with the mesh on: each program's usual setting.
SCALING = {
    "libigl": ["r2", "r5"],
    "pymeshlab": ["quadric", "scaled3"],
    "cgal": ["jet2r2", "jet4r3", "icc", "icc3"],
    "ponca": ["aso5"],
    "trimesh2": ["tensor"],
}
# Two curvatures closer than this, over the radius, have no direction worth the name.
DISTINCT = 0.05


def main():
    if sys.argv[1:2] == ["--child"]:
        return child(*sys.argv[2:7])
    args = arguments()
    runners = find_runners(args)
    with open(args.meshes / "meshes.csv", newline="") as file:
        meshes = list(csv.DictReader(file))
    args.output.parent.mkdir(parents=True, exist_ok=True)
    tables = {"accuracy": SETTINGS, "scaling": SCALING}
    total = sum(len(tables[mesh["use"]][peer]) for mesh in meshes for peer in runners)
    done, start = 0, time.monotonic()
    with open(args.output, "w", newline="") as file, tempfile.TemporaryDirectory() as scratch:
        out = csv.DictWriter(file, COLUMNS)
        out.writeheader()
        for mesh in meshes:
            exact = np.fromfile(args.meshes / f"{mesh['mesh']}.exact").reshape(-1, 5)
            for peer, command in runners.items():
                for setting in tables[mesh["use"]][peer]:
                    row = {key: mesh[key] for key in ("mesh", "shape", "vertices", "noise")}
                    row |= {"peer": peer, "setting": setting}
                    path = args.meshes / f"{mesh['mesh']}.obj"
                    row |= measure(command, path, Path(scratch), setting, args, exact, float(mesh["radius"]))
                    out.writerow(row)
                    file.flush()
                    done += 1
                    left = (time.monotonic() - start) / done * (total - done)
                    print(f"peers {done} {total} {mesh['mesh']} {peer} {setting}, {left:.0f} s left", file=sys.stderr, flush=True)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--build", type=Path, default=Path(tempfile.gettempdir()) / "osculate-peers")
    parser.add_argument("--eigen", type=Path, default=Path("/usr/include/eigen3"))
    parser.add_argument("--cgal", type=Path)
    parser.add_argument("--ponca", type=Path)
    parser.add_argument("--trimesh2", type=Path)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--timeout", type=float, default=300)
    parser.add_argument("--only", nargs="+", choices=SETTINGS, default=list(SETTINGS))
    args = parser.parse_args()
    if not (args.meshes / "meshes.csv").is_file():
        sys.exit(f"{args.meshes}/meshes.csv is missing; write it with osculate study curvature --export")
    return args


def find_runners(args):
    """{peer: command} of those that are here."""
    runners = {}
    for module, peer in (("igl", "libigl"), ("pymeshlab", "pymeshlab")):
        if peer in args.only and importlib.util.find_spec(module):
            runners[peer] = [sys.executable, __file__, "--child", peer]
    sources = {
        "cgal": (args.cgal, [f"-I{args.cgal}", f"-I{args.eigen}"], ["-lgmp", "-lmpfr"]),
        "ponca": (args.ponca, [f"-I{args.ponca}", f"-I{args.eigen}"], []),
        "trimesh2": (args.trimesh2, [f"-I{args.trimesh2}/include"], []),
    }
    for peer, (given, includes, libraries) in sources.items():
        if given and peer in args.only:
            if peer == "trimesh2":
                names = sorted(given.glob("libsrc/*.cc"))
                libraries = [str(name) for name in names if not name.name.startswith("GL")]
            runners[peer] = [build(peer, args.build, includes, libraries)]
    if not runners:
        sys.exit("no peer is here: install libigl or pymeshlab, or give --cgal, --ponca or --trimesh2")
    return runners


def build(peer, folder, includes, libraries):
    folder.mkdir(parents=True, exist_ok=True)
    source, program = HERE / f"peers_{peer}.cpp", folder / f"peers_{peer}"
    newest = max(source.stat().st_mtime, (HERE / "peers_common.hpp").stat().st_mtime)
    if not program.exists() or program.stat().st_mtime < newest:
        command = ["g++", "-O3", "-march=native", "-std=c++17", *includes, str(source), "-o", str(program), *libraries]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            errors = [line for line in done.stderr.splitlines() if "error" in line] or ["no message"]
            sys.exit(f"{' '.join(command)}\n{errors[0]}")
    return str(program)


def measure(command, path, scratch, setting, args, exact, radius):
    """The measured columns of one row."""
    result = scratch / "result.f64"
    result.unlink(missing_ok=True)
    try:
        run = subprocess.run([*command, str(path), str(result), str(args.runs), setting],
                             capture_output=True, text=True, timeout=args.timeout)  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"note": f"no answer in {args.timeout:.0f} s"}
    if run.returncode != 0 or not result.is_file():
        return {"note": f"ended with code {run.returncode}"}
    report = json.loads(run.stdout.splitlines()[-1])
    found = np.fromfile(result).reshape(-1, 5)
    if len(found) != len(exact):
        return {"note": f"{len(found)} answers for {len(exact)} vertices"}
    return errors(found, exact, radius) | {
        "us_per_vertex": f"{1e6 * statistics.median(report['seconds']) / len(exact):.4g}",
        "bytes_per_vertex": f"{report['peak_bytes'] / len(exact):.0f}",
    }


def errors(found, exact, radius):
    true = np.isfinite(exact[:, 0])
    found, exact = found[true], exact[true]
    worse = np.abs(found[:, :2] - exact[:, :2]).max(axis=1) * radius
    known = np.isfinite(worse)
    worse[~known] = np.inf
    distinct = exact[:, 0] - exact[:, 1] > DISTINCT / radius
    with np.errstate(invalid="ignore", divide="ignore"):
        cos = np.abs((found[:, 2:] * exact[:, 2:]).sum(axis=1)) / np.linalg.norm(found[:, 2:], axis=1)
    angle = np.degrees(np.arccos(np.clip(np.nan_to_num(cos, nan=0), 0, 1)))[distinct]
    row = {"median": quantile(worse, 50), "p95": quantile(worse, 95), "undetermined": int((~known).sum())}
    if len(angle):
        row |= {"direction_median_deg": quantile(angle, 50), "direction_p95_deg": quantile(angle, 95)}
    return row


def quantile(values, percent):
    """Nearest rank, as in osculate."""
    rank = -(-len(values) * percent // 100)
    return f"{np.sort(values)[max(rank, 1) - 1]:.6g}"


def child(peer, mesh, result, runs, setting):
    """One measurement of a Python package: the protocol of peers_common.hpp."""
    V, F = read_obj(mesh)
    estimate = {"libigl": libigl, "pymeshlab": meshlab}[peer](V, F, setting)
    before = reset_peak()
    seconds = []
    for turn in range(int(runs)):
        start = time.perf_counter()
        answer = estimate()
        seconds.append(time.perf_counter() - start)
        if turn == 0:
            peak = status("VmHWM")
    answer().astype("<f8").tofile(result)  # what is not timed: the second curvature of MeshLab, sorting
    print(json.dumps({"seconds": seconds, "peak_bytes": max(0, peak - before)}))


def read_obj(path):
    V, F = [], []
    with open(path) as file:
        for line in file:
            kind, *rest = line.split()
            if kind == "v":
                V.append([float(x) for x in rest])
            elif kind == "f":
                F.append([int(i) - 1 for i in rest])
    return np.array(V), np.array(F, dtype=np.int64)


def status(field):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(field + ":"))


def reset_peak():
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    return status("VmRSS")


def libigl(V, F, setting):
    import igl

    def run():
        d1, d2, k1, k2, bad = igl.principal_curvature(V, F, int(setting[1:]), True)

        def answer():
            found = np.column_stack([np.maximum(k1, k2), np.minimum(k1, k2), np.where((k1 >= k2)[:, None], d1, d2)])
            found[np.asarray(bad, dtype=int)] = np.nan
            return found

        return answer

    return run


def meshlab(V, F, setting):
    """MeshLab hands out a curvature as a scalar, one kind a call, so two calls are made and the first is timed.

    What it calls "Max Curvature" is the smaller one; the values are sorted here, and the direction taken that
    belongs to the larger: the first one, but for Taubin's method.
    """
    import pymeshlab

    method = {"taubin": "Taubin approximation", "quadric": "Quadric Fitting"}.get(setting, "Scale Dependent Quadric Fitting")
    options = {"method": method, "autoclean": False}
    if setting.startswith("scaled"):
        edge = np.linalg.norm(V[F] - V[np.roll(F, 1, axis=1)], axis=2).mean()
        options["scale"] = pymeshlab.PureValue(float(setting[6:]) * edge)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(V, F))

    def scalar(kind):
        meshes.compute_curvature_principal_directions_per_vertex(curvcolormethod=kind, **options)
        return meshes.current_mesh().vertex_scalar_array()

    def run():
        first = scalar("Max Curvature")

        def answer():
            k = np.column_stack([first, scalar("Min Curvature")])
            mesh = meshes.current_mesh()
            directions = mesh.vertex_curvature_principal_dir1_matrix()
            if setting == "taubin":
                directions = mesh.vertex_curvature_principal_dir2_matrix()
            return np.column_stack([k.max(axis=1), k.min(axis=1), directions])

        return answer

    return run


if __name__ == "__main__":
    main()
