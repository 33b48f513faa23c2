"""Renders a described scene with Mitsuba 3, for comparison in picture and in time.

    mitsuba_render.py SCENE.json -o OUT.exr [--json REPORT.json]

    pip install mitsuba==3.9.1; its llvm variants also need Debian's libllvm19

The description (lengths in world units, +Y up, colours linear RGB; * = required):

    mesh*         path of a .ply or .obj, relative to the description
    face_normals  true shades flat (default false: vertex normals, angle-weighted if the file has none)
    bsdf          {"type": "diffuse", "reflectance": [r, g, b]}, or
                  {"type": "principled", "base_color": [r, g, b], "roughness": x, "metallic": x, "specular": x}, or
                  {"type": "ggx", "alpha": x, "reflectance": [r, g, b]}: a rough conductor of 100 % times reflectance;
                  default diffuse 0.5; two-sided unless "two_sided" is false
    constant      [r, g, b]: radiance of a constant environment
    environment   {"exr": path, "scale": x, "turn_degrees": x}: negative texels are set to zero; turned about +Y
    area_light    {"centre": [x, y, z], "half_u": [..], "half_v": [..], "radiance": [r, g, b]}: shines along u x v
    directional   {"direction": [x, y, z], "irradiance": [r, g, b]}: the way light travels; on a plane facing it
    camera*       {"origin": [..], "target": [..], "up": [0, 1, 0], "fov_degrees": x}: vertical field of view
    width*, height*, spp*
    integrator    "path" (default) or "depth": camera rays and nothing else
    max_depth     Mitsuba's count of edges from the camera: 1 emission, 2 direct light; default 8, -1 unlimited
    variant       scalar_rgb (default), llvm_ad_rgb, ...
    threads       default all; the process is bound to so many processors
    runs          renders to time, the first of a JIT variant is not counted; default 3
    seed          default 0

Box filter, independent sampler, Russian roulette from depth 5. The report holds the median and all seconds of
the render call alone, not loading or building the tree.
"""

import argparse
import json
import os
import statistics
import time
from pathlib import Path

import numpy as np


def bsdf(mi, d):
    d = {"type": "diffuse", "reflectance": [0.5] * 3} | (d or {})
    color = lambda value: {"type": "rgb", "value": value}
    if d["type"] == "diffuse":
        inner = {"type": "diffuse", "reflectance": color(d["reflectance"])}
    elif d["type"] == "principled":
        inner = {"type": "principled", "base_color": color(d.get("base_color", [0.5] * 3))}
        inner |= {k: d[k] for k in ("roughness", "metallic", "specular") if k in d}
    elif d["type"] == "ggx":
        inner = {"type": "roughconductor", "distribution": "ggx", "alpha": d["alpha"], "material": "none"}
        inner["specular_reflectance"] = color(d["reflectance"])
    else:
        raise SystemExit(f"unknown bsdf {d['type']}")
    return {"type": "twosided", "inner": inner} if d.get("two_sided", True) else inner


def emitters(mi, d, folder):
    T = mi.ScalarTransform4f
    result = {}
    if "constant" in d:
        result["constant"] = {"type": "constant", "radiance": {"type": "rgb", "value": d["constant"]}}
    if "environment" in d:
        e = d["environment"]
        source = mi.Bitmap(str(folder / e["exr"])).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        texels = np.maximum(np.array(source), 0)
        result["environment"] = {
            "type": "envmap",
            "bitmap": mi.Bitmap(texels),
            "scale": e.get("scale", 1.0),
            "to_world": T().rotate([0, 1, 0], e.get("turn_degrees", 0.0)),
        }
    if "area_light" in d:
        a = d["area_light"]
        u, v, c = (np.array(a[k], dtype=float) for k in ("half_u", "half_v", "centre"))
        n = np.cross(u, v)
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([u, v, n / np.linalg.norm(n), c])
        light = {"type": "area", "radiance": {"type": "rgb", "value": a["radiance"]}}
        result["area_light"] = {"type": "rectangle", "to_world": T(matrix), "emitter": light}
    if "directional" in d:
        s = d["directional"]
        irradiance = {"type": "rgb", "value": s["irradiance"]}
        result["directional"] = {"type": "directional", "direction": s["direction"], "irradiance": irradiance}
    return result


def scene(mi, d, folder):
    camera = d["camera"]
    look = mi.ScalarTransform4f().look_at(origin=camera["origin"], target=camera["target"], up=camera.get("up", [0, 1, 0]))
    path = folder / d["mesh"]
    film = {
        "type": "hdrfilm",
        "width": d["width"],
        "height": d["height"],
        "pixel_format": "rgb",
        "component_format": "float32",
        "filter": {"type": "box"},
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "depth"}
            if d.get("integrator") == "depth"
            else {"type": "path", "max_depth": d.get("max_depth", 8), "rr_depth": 5},
            "sensor": {
                "type": "perspective",
                "to_world": look,
                "fov": camera["fov_degrees"],
                "fov_axis": "y",
                "film": film,
                "sampler": {"type": "independent", "sample_count": d["spp"]},
            },
            "mesh": {
                "type": path.suffix[1:],
                "filename": str(path),
                "face_normals": d.get("face_normals", False),
                "bsdf": bsdf(mi, d.get("bsdf")),
            },
            **emitters(mi, d, folder),
        },
        parallel=False,
    )


def render(mi, loaded, d):
    """(image [h, w, 3], seconds of every counted run)."""
    import drjit as dr

    jit = not d.get("variant", "scalar_rgb").startswith("scalar")
    seconds, image = [], None
    for run in range(d.get("runs", 3) + jit):
        start = time.perf_counter()
        image = mi.render(loaded, spp=d["spp"], seed=d.get("seed", 0))
        if jit:
            dr.eval(image)
            dr.sync_thread()
        seconds.append(time.perf_counter() - start)
    return image, seconds[jit:]


def bind(count):
    """Leaves `count` processors to all threads of this process.

    drjit.set_thread_count(1), or starting on one processor, makes scalar variants wait for ever.
    """
    processors = sorted(os.sched_getaffinity(0))[:count]
    for task in os.listdir("/proc/self/task"):
        os.sched_setaffinity(int(task), processors)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    d = json.loads(args.scene.read_text())

    import mitsuba as mi

    variant = d.get("variant", "scalar_rgb")
    mi.set_variant(variant)
    start = time.perf_counter()
    loaded = scene(mi, d, args.scene.parent)
    load_seconds = time.perf_counter() - start
    if "threads" in d:
        bind(d["threads"])
    image, seconds = render(mi, loaded, d)
    pixels = np.array(image)
    mi.Bitmap(pixels).write(str(args.output))
    median = statistics.median(seconds)
    report = {
        "mitsuba": mi.__version__,
        "variant": variant,
        "threads": d.get("threads", "all"),
        "width": d["width"],
        "height": d["height"],
        "spp": d["spp"],
        "seconds": seconds,
        "median_seconds": median,
        "load_seconds": load_seconds,
        "samples_per_second": d["width"] * d["height"] * d["spp"] / median,
        "mean_rgb": pixels.reshape(-1, pixels.shape[2]).mean(axis=0).tolist(),
    }
    text = json.dumps(report, indent=1)
    print(text)
    if args.json:
        args.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
