"""Times osculate and libigl side by side, on the same meshes, in one session.

    cargo build --release -p osculate-geom --example estimate_rate
    bench_curvature.py DIR [--estimate-rate target/release/examples/estimate_rate] [--sizes 30000 500000] [--rings 2 5]
                       [--rounds 7] [--scattered] [-o REPORT.json]

The programs take turns: in every round libigl, then each estimator of osculate on one thread and on all, and as many
processes of one thread at once, which is the most that threads can gain on this machine. Each makes
several estimates in one process, of which the median counts; the first, which finds caches, memory and threads
cold, does not (libigl is given one run at five rings and more on a large mesh, which takes it long enough not to
matter). What is timed is the estimate alone on both sides, neither reading nor writing. Printed are the median of the
rounds in microseconds a vertex with minimum and maximum, and the median of the rounds' ratios. With --scattered vertices and
triangles of all meshes are in random order.
"""

import argparse
import json
import os
import statistics
import subprocess
from pathlib import Path

import time_libigl

METHODS = ["libigl", "quadric"]
# Counted estimates of a process.
OUR_RUNS = 9
LIBIGL_RUNS = 2


def ours(program, path, method, rings, threads, processes=1):
    """Seconds of one estimate, or of each of several processes at the same time over their number."""
    command = [str(part) for part in (program, path, method, rings, threads, OUR_RUNS)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(processes)]
    outs = [process.communicate()[0] for process in running]
    if any(process.returncode for process in running):
        raise SystemExit(f"{' '.join(command)}: failed")
    return statistics.fmean(statistics.median(float(word) for word in out.split()[1:]) for out in outs) / processes


def libigl(path, size, rings):
    """Seconds of one call, and the number of vertices."""
    slow = size > time_libigl.LARGE and rings >= 5
    report = time_libigl.measure(path, rings, 1 if slow else 1 + LIBIGL_RUNS)
    seconds = report["seconds"] if slow else report["seconds"][1:]
    return statistics.median(seconds), report["vertices"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--estimate-rate", type=Path, default=Path("target/release/examples/estimate_rate"))
    parser.add_argument("--sizes", type=int, nargs="+", default=[30_000, 500_000])
    parser.add_argument("--rings", type=int, nargs="+", default=[2, 5])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--scattered", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| mesh | rings | | us a vertex (min-max) | times libigl |\n|---|---|---|---|---|")
    for size in args.sizes:
        path = time_libigl.mesh(args.folder, size, args.scattered)
        for rings in args.rings:
            seconds = {}
            for _ in range(args.rounds):
                peer, vertices = libigl(path, size, rings)
                seconds.setdefault("libigl itself, 1 thread", []).append(peer)
                for method in METHODS:
                    for threads in sorted({1, os.cpu_count()}):
                        name = f"`{method}`, {threads} thread" + ("s" if threads > 1 else "")
                        run = ours(args.estimate_rate, path, method, rings, threads)
                        seconds.setdefault(name, []).append(run)
                # What the machine's processors can do for each other at best: they share caches, memory, and other guests.
                both = ours(args.estimate_rate, path, "quadric", rings, 1, os.cpu_count())
                seconds.setdefault(f"`quadric`, {os.cpu_count()} processes of 1 thread", []).append(both)
            rows += report(path.stem, vertices, rings, seconds)
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
