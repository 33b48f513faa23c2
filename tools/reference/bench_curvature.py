"""Times osculate and libigl side by side, on the same meshes, in one run.

    bench_curvature.py DIR [--osculate target/release/osculate] [--sizes 30000 500000] [--rings 2 5]
                       [--runs 5] [-o REPORT.json]

The programs take turns: libigl, then every estimator of osculate on one thread and on all. What is
timed is the estimate alone on both sides, neither reading nor writing: libigl's call, and the
`seconds.estimate` of `osculate bake --json`. Printed are the median in microseconds a vertex with
minimum and maximum, and the median of the ratios of the pairs.
"""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
from pathlib import Path

import time_libigl

METHODS = ["libigl", "quadric"]


def ours(program, path, method, rings, threads, folder):
    """Seconds of one estimate."""
    command = [program, "bake", path, "-o", folder / "out.ply", "--method", method, "--rings", rings, "--threads", threads]
    command += ["--quiet", "--json", "-"]
    out = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout
    return json.loads(out)["seconds"]["estimate"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--osculate", type=Path, default=Path("target/release/osculate"))
    parser.add_argument("--sizes", type=int, nargs="+", default=[30_000, 500_000])
    parser.add_argument("--rings", type=int, nargs="+", default=[2, 5])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| mesh | rings | | us a vertex (min-max) | times libigl |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for size in args.sizes:
            path = time_libigl.mesh(args.folder, size)
            for rings in args.rings:
                seconds = {}
                for _ in range(args.runs):
                    peer = time_libigl.measure(path, rings, 1)
                    seconds.setdefault("libigl itself, 1 thread", []).append(peer["seconds"][0])
                    for method in METHODS:
                        for threads in sorted({1, os.cpu_count()}):
                            name = f"`{method}`, {threads} thread" + ("s" if threads > 1 else "")
                            run = ours(args.osculate, path, method, rings, threads, Path(folder))
                            seconds.setdefault(name, []).append(run)
                rows += report(path.stem, peer["vertices"], rings, seconds)
    if args.output:
        document = {"cpu": time_libigl.cpu(), "libigl": time_libigl.version("libigl"), "rows": rows}
        args.output.write_text(json.dumps(document, indent=1) + "\n")


def report(mesh, vertices, rings, seconds):
    """Prints one table row per program; all rows as objects."""
    peer = next(iter(seconds.values()))
    rows = []
    for name, times in seconds.items():
        micro = [1e6 * t / vertices for t in times]
        ratio = statistics.median(p / t for p, t in zip(peer, times, strict=True))
        rows.append({"mesh": mesh, "vertices": vertices, "rings": rings, "program": name, "microseconds": micro, "ratio": ratio})
        spread = f"{statistics.median(micro):.2f} ({min(micro):.2f}-{max(micro):.2f})"
        print(f"| {mesh} | {rings} | {name} | {spread} | {ratio:.1f} |", flush=True)
    return rows


if __name__ == "__main__":
    main()
