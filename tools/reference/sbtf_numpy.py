"""Reads a .sbtf model and evaluates it, in plain numpy: the format's second reader, and the check of the first.

    sbtf_numpy.py MODEL.sbtf                    what is inside
    sbtf_numpy.py MODEL.sbtf --check ROWS.json  compares with recorded queries and answers

ROWS.json holds `queries` (u, v, wo.x, wo.y, wo.z, wi.x, wi.y, wi.z, kappa_hat) and `answers` (r, g, b, alpha), a row
each, and `bound`: the largest |difference| / (1 + |answer|) allowed, --bound to overrule it. Exit code 1 if one is larger.
docs/sbtf-format.md describes the layout. Python 3.9 or later and numpy; nothing else.
"""

import argparse
import json
import struct
import sys
from pathlib import Path

import numpy as np

LONGEST_REACH = 2.0
STEEPEST_RAY = 0.05
LARGEST_LOG = 88.0
TYPES = {"F32": "<f4", "F16": "<f2", "U8": "u1"}


def read(path):
    """The metadata and a dictionary of arrays, textures as features in f64."""
    data = Path(path).read_bytes()
    (length,) = struct.unpack_from("<Q", data)
    header = json.loads(data[8:8 + length])
    metadata = json.loads(header.pop("__metadata__")["osculate"])
    if metadata["format"] != "osculate-sbtf" or metadata["version"] not in (1, 2, 3):
        raise SystemExit(f"{path}: format {metadata['format']!r} version {metadata['version']}, not osculate-sbtf 1 to 3")
    body = data[8 + length:]
    tensors = {}
    for name, info in header.items():
        start, end = info["data_offsets"]
        tensors[name] = np.frombuffer(body[start:end], TYPES[info["dtype"]]).reshape(info["shape"])
    arrays = {name: tensor.astype(np.float64) for name, tensor in tensors.items()}
    for name in [name for name, tensor in tensors.items() if tensor.dtype == np.uint8]:
        arrays[name] = arrays.pop(name + ".offset") + arrays.pop(name + ".scale") * arrays[name]
    return metadata, arrays


def lookup(texture, uv):
    """Bilinear and repeated; texel (column, row) has its centre at ((column + 0.5) / width, (row + 0.5) / height)."""
    height, width, _ = texture.shape
    position = (uv - np.floor(uv)) * [width, height] - 0.5
    low = np.floor(position).astype(int)
    f = position - low
    (x0, y0), (x1, y1) = (low % [width, height]).T, ((low + 1) % [width, height]).T
    fx, fy = f[:, :1], f[:, 1:]
    bottom = texture[y0, x0] * (1 - fx) + texture[y0, x1] * fx
    top = texture[y1, x0] * (1 - fx) + texture[y1, x1] * fx
    return bottom * (1 - fy) + top * fy


class Model:
    """A model, asked with arrays: uv [n, 2], wo [n, 3], wi [n, 3], kappa [n]."""

    def __init__(self, path):
        self.metadata, self.arrays = read(path)
        self.form = self.metadata["architecture"]

    def network(self, module, x):
        layer = 0
        while f"{module}.layers.{layer}.weight" in self.arrays:
            x = np.maximum(x, 0) if layer else x
            x = x @ self.arrays[f"{module}.layers.{layer}.weight"].T + self.arrays[f"{module}.layers.{layer}.bias"]
            layer += 1
        return x

    def curvature(self, kappa):
        if self.form["curvature"] == "absent":
            return np.zeros((len(kappa), 0))
        largest = np.abs(self.form["kappa_range"]).max()
        return (np.sign(kappa) * np.sqrt(np.abs(kappa) / largest))[:, None]

    def taps(self, module, uv, step, fractions):
        texture = self.arrays[f"{module}.texture"]
        return [lookup(texture, uv + step * fraction) for fraction in fractions]

    def evaluate(self, uv, wo, wi, kappa):
        """Colours [n, 3] and opacities [n]."""
        uv = np.where(np.isfinite(uv), uv - np.floor(uv), 0.0)
        kappa = np.clip(kappa, *self.form["kappa_range"])
        sine = np.hypot(wo[:, 0], wo[:, 1])
        safe = np.where(sine > 0, sine, 1)
        along = np.where(sine[:, None] > 0, -wo[:, :2] / safe[:, None], [1.0, 0.0])
        alpha = self.opacity(uv, wo, kappa, along)
        offset = self.offset(uv, wo, kappa, along)
        features = lookup(self.arrays["colour.texture"], uv + offset)
        logs = self.network("colour", np.hstack([features, wi, wo[:, :2], self.curvature(kappa)]))
        rgb = np.expm1(np.clip(logs, 0, LARGEST_LOG)) * (alpha > 0)[:, None]
        return rgb, alpha

    def opacity(self, uv, wo, kappa, along):
        head, depth = self.form["opacity"], self.form["depth"]
        front = (wo[:, 2] > 0).astype(float)
        if head == "opaque":
            return front
        reach = self.way_length(self.form.get("opacity_way", "graze"), wo, kappa)
        features = self.taps("opacity", uv, along * reach[:, None], self.form["opacity_taps"])
        direction = along if head == "silhouette" else wo[:, :2]
        output = np.clip(self.network("opacity", np.hstack([*features, direction, self.curvature(kappa)]))[:, 0], 0, 1)
        if head == "direct":
            return output * front
        x = np.clip(kappa * depth * output, 0, 1)
        return front * (wo[:, 2] >= np.sqrt(x * (2 - x)))

    def way_length(self, way, wo, kappa):
        """Distance in UV between fraction 0 and fraction 1 of the taps."""
        depth, sine = self.form["depth"], np.hypot(wo[:, 0], wo[:, 1])
        cosine = np.maximum(wo[:, 2], np.finfo(np.float32).tiny)
        if way == "graze":
            deep = np.clip(kappa * depth, 0, 1)
            angle = np.arctan2(np.sqrt(deep * (2 - deep)), 1 - deep)
            near = angle < kappa * LONGEST_REACH
            return np.where(near, angle / np.where(near, kappa, 1), LONGEST_REACH)
        if way == "descend":
            flat = np.minimum(depth * sine / cosine, LONGEST_REACH)
            chord = 2 * cosine * sine / np.where(kappa > 0, kappa, 1)
            return np.where(kappa > 0, np.minimum(flat, chord), flat)
        deep = np.minimum(kappa * depth, 1)
        square = cosine**2 - deep * (2 - deep)
        length = depth * (2 - deep) / (cosine + np.sqrt(np.maximum(square, 0)))
        tangent = length * sine / np.maximum(1 - kappa * length * cosine, np.finfo(np.float32).tiny)
        bent = np.where(kappa == 0, 1, kappa)
        down = np.where(kappa == 0, tangent, np.arctan(kappa * tangent) / bent)
        over = 2 * np.arctan2(cosine, sine) / bent
        return np.minimum(np.where(square >= 0, down, over), LONGEST_REACH)

    def offset(self, uv, wo, kappa, along):
        reach = self.way_length(self.form.get("offset_way", "descend"), wo, kappa)
        features = self.taps("offset", uv, along * reach[:, None], self.form["offset_taps"])
        output = self.network("offset", np.hstack([*features, wo[:, :2], self.curvature(kappa)]))
        if self.form["offset"] == "free":
            return output
        if self.form["offset"] == "along-reach":
            return along * reach[:, None] * output
        return -wo[:, :2] * output / np.maximum(wo[:, 2:], STEEPEST_RAY)


def check(model, path, bound):
    recorded = json.loads(Path(path).read_text())
    q, wanted = np.array(recorded["queries"]), np.array(recorded["answers"])
    bound = recorded["bound"] if bound is None else bound
    rgb, alpha = model.evaluate(q[:, :2], q[:, 2:5], q[:, 5:8], q[:, 8])
    off = (np.abs(np.column_stack([rgb, alpha]) - wanted) / (1 + np.abs(wanted))).max(axis=1)
    worst = int(off.argmax())
    print(f"{len(q)} queries, {(wanted[:, 3] > 0).sum()} hit; worst {worst} off by {off[worst]:.2e}, bound {bound:.0e}")
    return 0 if off[worst] <= bound else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--check", metavar="ROWS.json")
    parser.add_argument("--bound", type=float)
    arguments = parser.parse_args()
    model = Model(arguments.model)
    if arguments.check:
        return check(model, arguments.check, arguments.bound)
    print(json.dumps(model.metadata["architecture"], indent=1))
    for name, array in sorted(model.arrays.items()):
        print(f"{name:28} {str(array.shape):16} {array.min():.4g} to {array.max():.4g}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
