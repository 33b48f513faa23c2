"""Times igl::principal_curvature on one thread, and its peak memory.

    time_libigl.py DIR [-o REPORT.json] [--sizes 30000 500000] [--rings 2 5] [--runs 5]

Writes DIR/torus_30000.ply and DIR/torus_500000.ply (irregular torus, binary PLY with double positions) to
time other programs on, and a JSON report: for every mesh and radius the median, all runs, and
microseconds a vertex; the peak resident memory of a process that did nothing but load the mesh and
call libigl, and that of one that only loaded it. Meshes over 100,000 vertices get one run at radius 5 and up.
Only the call is timed, not reading or Python's start.
"""

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

os.environ["IGL_NUM_THREADS"] = "1"  # before libigl is loaded

import igl
import numpy as np

import shapes

LARGE = 100_000


def mesh(folder, n, scattered=False):
    """Path of the torus with about n vertices, written if it is not there; its vertices and triangles in random order if `scattered`."""
    path = folder / (f"scattered_torus_{n}.ply" if scattered else f"torus_{n}.ply")
    if not path.exists():
        random = np.random.default_rng(n)
        rows = round((2 * n) ** 0.5)
        columns = round(n / rows)
        V, F = shapes.torus(1.0, 0.45, rows, columns, random)
        if scattered:
            order = random.permutation(len(V))
            V, F = V[order], random.permutation(np.argsort(order)[F])
        shapes.write_ply(path, V, F)
    return path


def child(path, radius, runs):
    """In a process of its own: seconds of every run, and peak resident bytes."""
    V, F = igl.read_triangle_mesh(path)
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        igl.principal_curvature(V, F, radius, True)
        seconds.append(time.perf_counter() - start)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(json.dumps({"vertices": len(V), "triangles": len(F), "seconds": seconds, "peak_bytes": peak}))


def measure(path, radius, runs):
    command = [sys.executable, __file__, "--child", str(path), str(radius), str(runs)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main():
    if sys.argv[1:2] == ["--child"]:
        return child(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--sizes", type=int, nargs="+", default=[30_000, 500_000])
    parser.add_argument("--rings", type=int, nargs="+", default=[2, 5])
    parser.add_argument("--runs", type=int, default=5)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for n in args.sizes:
        path = mesh(args.folder, n)
        loaded = measure(path, 2, 0)["peak_bytes"]
        for radius in args.rings:
            got = measure(path, radius, 1 if n > LARGE and radius >= 5 else args.runs)
            median = statistics.median(got["seconds"])
            row = {
                "mesh": path.name,
                "vertices": got["vertices"],
                "triangles": got["triangles"],
                "rings": radius,
                "median_seconds": median,
                "seconds": got["seconds"],
                "microseconds_per_vertex": 1e6 * median / got["vertices"],
                "peak_bytes": got["peak_bytes"],
                "loaded_bytes": loaded,
                "bytes_per_vertex": (got["peak_bytes"] - loaded) / got["vertices"],
            }
            rows.append(row)
            print(
                f"{row['mesh']} r{radius}: {median:.3f} s, {row['microseconds_per_vertex']:.1f} us a vertex, "
                f"{len(got['seconds'])} runs, {row['bytes_per_vertex']:.0f} bytes a vertex beyond the loaded mesh",
                file=sys.stderr,
                flush=True,
            )
    report = {"libigl": version("libigl"), "python": platform.python_version(), "cpu": cpu(), "threads": 1, "rows": rows}
    text = json.dumps(report, indent=1)
    if args.output:
        args.output.write_text(text + "\n")
    else:
        print(text)


def cpu():
    """The processor's name, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())


if __name__ == "__main__":
    main()
