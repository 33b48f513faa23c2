"""Rays a second and time to equal noise beside Embree and Mitsuba 3, on one thread.

    bench_render.py [--osculate target/release/osculate] [--embree ./embree_rays]
                    [--ray-rate target/release/examples/ray_rate] [--spp 64] [--runs 3]

Rays: ours and Embree's on Spot, as embree_rays.cpp describes them (build that first, as its head says,
and ours with `cargo build --release -p osculate-geom --example ray_rate`), in turn.
Mitsuba traces no loose rays in its scalar variants, so its figure is camera rays of its `depth` integrator,
from the same camera, film and sampler included.

Picture: scenes/spot_lamp.toml and the same scene in Mitsuba. The noise is measured alike on both sides: two
renders with different seeds, the root mean square of their difference over the square root of two, relative to
the mean. The time to one percent is the time times (noise / 0.01)^2, which favours neither.

A variant of Mitsuba that does not run here gets a row that says so, and the last lines of what it printed go to
standard error; the other rows are measured all the same. The usual reason is that Debian's libllvm19 is missing.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import mitsuba_render

ROOT = Path(__file__).resolve().parents[2]
SPOT = ROOT / "assets/meshes/spot.obj"
LAMP = {
    "mesh": str(SPOT),
    "bsdf": {"type": "diffuse", "reflectance": [0.5] * 3},
    "constant": [0.3] * 3,
    "area_light": {
        "centre": [-2.0, 3.0, -2.0],
        "half_u": [0.70710678, 0, -0.70710678],
        "half_v": [0.51449576, 0.68599434, 0.51449576],
        "radiance": [8.0] * 3,
    },
    "camera": {"origin": [-1.5, 1.0, -2.4], "target": [0, 0.1, 0.1], "up": [0, 1, 0], "fov_degrees": 35},
    "width": 512,
    "height": 512,
    "max_depth": 9,
    "threads": 1,
}


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


def unless_it_fails(variant, measure, *arguments):
    """What `measure` returns, or None after saying why the variant of Mitsuba did not run."""
    try:
        return measure(variant, *arguments)
    except subprocess.CalledProcessError as failure:
        last = "\n".join((failure.stderr or "").splitlines()[-5:])
        print(f"Mitsuba {variant} ended with {failure.returncode}:\n{last}", file=sys.stderr, flush=True)
        return None


def noise(a, b):
    """Relative noise of one of two equal renders."""
    difference = np.sqrt(np.mean((a - b) ** 2) / 2)
    return float(difference / np.mean((a + b) / 2))


def read(path):
    import mitsuba as mi

    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def ours(program, spp, runs, folder):
    images, seconds = [], []
    for seed in range(max(2, runs)):
        path = folder / f"ours_{seed}.exr"
        out = run(program, "render", ROOT / "scenes/spot_lamp.toml", "-o", path, "--spp", spp, "--seed", seed + 1,
                  "--threads", 1, "--quiet", "--json", "-")
        seconds.append(json.loads(out)["render"]["tracing_seconds"])
        images.append(read(path))
    return images, seconds


def mitsuba(variant, spp, runs, folder):
    images, seconds = [], []
    for seed in range(2):
        scene, report = folder / "scene.json", folder / "report.json"
        scene.write_text(json.dumps(LAMP | {"variant": variant, "spp": spp, "seed": seed + 1, "runs": runs}))
        path = folder / f"{variant}_{seed}.exr"
        run(sys.executable, mitsuba_render.__file__, scene, "-o", path, "--json", report)
        seconds += json.loads(report.read_text())["seconds"]
        images.append(read(path))
    return images, seconds


def row(name, images, seconds, spp):
    time, level = statistics.median(seconds), noise(*images[:2])
    to_one_percent = time * (level / 0.01) ** 2
    print(f"| {name} | {spp} | {time:.2f} ({min(seconds):.2f}-{max(seconds):.2f}) | {512 * 512 * spp / time / 1e6:.2f} "
          f"| {100 * level:.2f} % | {to_one_percent:.1f} | {np.mean(images):.5f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--osculate", type=Path, default=ROOT / "target/release/osculate")
    parser.add_argument("--ray-rate", type=Path, default=ROOT / "target/release/examples/ray_rate")
    parser.add_argument("--embree", type=Path)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("| rays on Spot | primary, Mray/s | random, Mray/s | primary in one call |\n|---|---|---|---|")
        rays(args, folder)
        print("\n| picture | spp | seconds (min-max) | Msample/s | noise | seconds to 1 % | mean |\n|---|---|---|---|---|---|---|")
        row("osculate", *ours(args.osculate, args.spp, args.runs, folder), args.spp)
        for variant in ["scalar_rgb", "llvm_ad_rgb"]:
            if rendered := unless_it_fails(variant, mitsuba, args.spp, args.runs, folder):
                row(f"Mitsuba {variant}", *rendered, args.spp)
            else:
                print(f"| Mitsuba {variant} | does not run here | | | | | |", flush=True)


def rays(args, folder):
    rates = {"osculate": [], "Embree": []}
    ply = folder / "spot.ply"
    import shapes
    import igl

    shapes.write_ply(ply, *igl.read_triangle_mesh(SPOT))
    for _ in range(args.runs):
        lines = [json.loads(line) for line in run(args.ray_rate, ply, 5).splitlines()]
        rates["osculate"].append([line["mrays_per_second"] for line in lines])
        if args.embree:
            found = json.loads(run(args.embree, ply, 5))
            rates["Embree"].append([found[kind]["mrays_per_second"] for kind in ["primary", "random"]])
    for name, pairs in rates.items():
        if pairs:
            spread = [f"{statistics.median(column):.2f} ({min(column):.2f}-{max(column):.2f})" for column in zip(*pairs)]
            print(f"| {name} | {' | '.join(spread + [''] * (3 - len(spread)))} |", flush=True)
    for variant in ["scalar_rgb", "llvm_ad_rgb"]:
        rates = unless_it_fails(variant, camera_rays, args.runs, folder)
        spread = f"{statistics.median(rates):.2f} ({min(rates):.2f}-{max(rates):.2f})" if rates else "does not run here"
        print(f"| Mitsuba {variant}, depth | {spread} | | |", flush=True)


def camera_rays(variant, runs, folder):
    """Million camera rays a second of Mitsuba's depth integrator, with the camera of embree_rays.cpp."""
    import igl

    V, _ = igl.read_triangle_mesh(SPOT)
    low, high = V.min(axis=0), V.max(axis=0)
    centre, towards = (low + high) / 2, np.array([0, 0.35, 1])
    eye = centre + 1.6 * np.linalg.norm(high - low) * towards / np.linalg.norm(towards)
    camera = {"origin": eye.tolist(), "target": centre.tolist(), "fov_degrees": 40}
    scene = {"mesh": str(SPOT), "constant": [1.0] * 3, "camera": camera, "width": 1024, "height": 1024, "spp": 4}
    scene |= {"integrator": "depth", "variant": variant, "threads": 1, "runs": runs}
    description, report = folder / "depth.json", folder / "depth_report.json"
    description.write_text(json.dumps(scene))
    run(sys.executable, mitsuba_render.__file__, description, "-o", folder / "depth.exr", "--json", report)
    return [1024 * 1024 * 4 / t / 1e6 for t in json.loads(report.read_text())["seconds"]]


if __name__ == "__main__":
    main()
