"""Counts single bright pixels in pictures of a torus under neural materials, and measures their noise.

    speckles.py [--osculate target/release/osculate] [--spp 16 64] [--as displaced] MODEL.sbtf...

The scene is scenes/torus_stone.toml with the model in it, 240 by 165 pixels. A pixel counts if the mean of its codes is over the median of the
5 by 5 around by more than 40. The noise is the root mean square difference of two pictures with different seeds over
sqrt(2), in codes, and the seconds are of processor time for one of them. Python 3.9 or later, numpy and Pillow.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

SCENE = Path(__file__).resolve().parents[2] / "scenes/torus_stone.toml"
MODEL = "../assets/materials/stone-1.sbtf"
BRIGHTER = 40


def picture(command, scene, out, seed, spp, form):
    """The codes of a picture as f64, and the seconds it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    options = ["--size", "240x165", "--spp", str(spp), "--seed", str(seed), "--quiet"] + (["--as", form] if form else [])
    subprocess.run([command, "render", str(scene), "-o", str(out), *options], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    codes = np.asarray(Image.open(out).convert("RGB")).astype(float)
    return codes, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def speckles(codes):
    """Number of single bright pixels."""
    grey = codes.mean(axis=2)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(grey, 2, mode="symmetric"), (5, 5))
    return int((grey - np.median(around, axis=(2, 3)) > BRIGHTER).sum())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", type=Path, metavar="MODEL.sbtf")
    parser.add_argument("--osculate", default="target/release/osculate")
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64])
    parser.add_argument("--as", dest="form", metavar="WORD")
    arguments = parser.parse_args()
    text = SCENE.read_text()
    if MODEL not in text:
        raise SystemExit(f"{SCENE}: has no model {MODEL}")
    print("| model | samples | bright pixels | noise, codes | s |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as directory:
        scene, out = Path(directory, "scene.toml"), Path(directory, "picture.png")
        for model in arguments.models:
            scene.write_text(text.replace(MODEL, str(model.resolve())))
            for spp in arguments.spp:
                (a, seconds), (b, _) = (picture(arguments.osculate, scene, out, seed, spp, arguments.form) for seed in (0, 1))
                noise = np.sqrt(((a - b) ** 2).mean() / 2)
                print(f"| {model.stem} | {spp} | {speckles(a)}, {speckles(b)} | {noise:.2f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
