"""Opens baked meshes with readers that are not ours, and asserts what the format promises.

    check_bake.py FILE.{glb,ply} ...

A .glb is read with pygltflib (every accessor, type and range) and with trimesh (that a program which
knows nothing of the attributes still gets the mesh), a .ply with trimesh. Prints one line per
file; exit code 1 with the reason at the first promise that does not hold.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pygltflib
import trimesh

FLOAT, U8 = pygltflib.FLOAT, pygltflib.UNSIGNED_BYTE
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
DTYPES = {FLOAT: "<f4", U8: "u1", pygltflib.UNSIGNED_SHORT: "<u2", pygltflib.UNSIGNED_INT: "<u4"}
PROMISED = {
    "POSITION": ("VEC3", FLOAT),
    "NORMAL": ("VEC3", FLOAT),
    "_CURVATURE": ("VEC2", FLOAT),
    "_CURVATURE_DIR": ("VEC3", FLOAT),
    "_CURVATURE_ERROR": ("SCALAR", FLOAT),
    "_CURVATURE_STATUS": ("SCALAR", U8),
}
STATUSES = 8  # ok, boundary, few neighbours, rank deficient, non-manifold, isolated, over tolerance, crease
DIRECTIONS = [("d1x", "d1y", "d1z"), ("k1x", "k1y", "k1z")]  # ours; MeshLab's


class Broken(Exception):
    """A promise that does not hold."""


def require(condition, message):
    if not condition:
        raise Broken(message)


def accessor(gltf, index):
    """The accessor's values, [count, components]; strided views are honoured."""
    a = gltf.accessors[index]
    require(a.bufferView is not None and a.sparse is None, f"accessor {index}: no plain data")
    view = gltf.bufferViews[a.bufferView]
    dtype, width = np.dtype(DTYPES[a.componentType]), COMPONENTS[a.type]
    stride = view.byteStride or dtype.itemsize * width
    start = (view.byteOffset or 0) + (a.byteOffset or 0)
    blob = gltf.binary_blob()
    require(start + stride * (a.count - 1) + dtype.itemsize * width <= len(blob), f"accessor {index}: beyond the buffer")
    values = np.ndarray((a.count, width), dtype, blob, start, (stride, dtype.itemsize))
    if dtype.kind == "f":
        require(np.isfinite(values).all(), f"accessor {index}: holds NaN or infinity")
    return values


def check_primitive(gltf, primitive):
    """Asserts one primitive's attributes; returns what is worth printing."""
    attributes = vars(primitive.attributes)
    present = {key: index for key, index in attributes.items() if index is not None}
    values = {}
    for name, (shape, component) in PROMISED.items():
        require(name in present, f"attribute {name} is missing; there are {sorted(present)}")
        a = gltf.accessors[present[name]]
        require((a.type, a.componentType) == (shape, component), f"{name} is {a.type} of {a.componentType}")
        values[name] = accessor(gltf, present[name])
    count = len(values["POSITION"])
    require(all(len(v) == count for v in values.values()), "attributes differ in length")
    kmax, kmin = values["_CURVATURE"].T
    require((kmax >= kmin).all(), f"kappa_max < kappa_min at vertex {np.argmax(kmax < kmin)}")
    flagged = values["_CURVATURE_STATUS"].ravel() != 0
    units(values["_CURVATURE_DIR"], flagged, "direction")
    units(values["NORMAL"], np.zeros(count, dtype=bool), "normal")
    require((values["_CURVATURE_ERROR"] >= 0).all(), "negative error estimate")
    require((values["_CURVATURE_STATUS"] < STATUSES).all(), "unknown status")
    indices = accessor(gltf, primitive.indices).ravel()
    require(indices.max() < count and len(indices) % 3 == 0, "indices out of range")
    seams(values)
    statuses = np.bincount(values["_CURVATURE_STATUS"].ravel(), minlength=STATUSES).tolist()
    uv = "with uv" if "TEXCOORD_0" in present else "no uv"
    return f"{count} vertices, {len(indices) // 3} triangles, {uv}, kappa {kmin.min():.4g} to {kmax.max():.4g}, statuses {statuses}"


def units(vectors, may_be_zero, what):
    """Every vector has length 1, or 0 where it may."""
    length = np.linalg.norm(vectors, axis=1)
    wrong = (np.abs(length - 1) > 1e-5) & ~(may_be_zero & (length == 0))
    require(not wrong.any(), f"{what} of length {length[wrong.argmax()]} at vertex {wrong.argmax()}")


def asset_extras(path):
    """`asset.extras` of a .glb; pygltflib drops it."""
    head = path.read_bytes()
    size = int.from_bytes(head[12:16], "little")
    return json.loads(head[20 : 20 + size])["asset"].get("extras")


def seams(values):
    """Curvature is a function of position: copies of a vertex on a seam agree bit by bit."""
    _, index = np.unique(values["POSITION"], axis=0, return_inverse=True)
    index = index.reshape(-1)
    _, first = np.unique(index, return_index=True)
    for name in ("_CURVATURE", "_CURVATURE_ERROR", "_CURVATURE_STATUS"):
        same = (values[name] == values[name][first[index]]).all(axis=1)
        require(same.all(), f"{name} differs between copies of vertex {np.argmin(same)}")


def check_glb(path):
    gltf = pygltflib.GLTF2().load(str(path))
    require(gltf is not None and gltf.asset.version == "2.0", "not glTF 2.0")
    extras = asset_extras(path)
    require(extras, "asset.extras with the provenance is missing")
    primitives = [p for mesh in gltf.meshes for p in mesh.primitives]
    require(primitives, "no mesh")
    lines = [check_primitive(gltf, p) for p in primitives]
    loaded = trimesh.load(path, process=False)
    require(isinstance(loaded, trimesh.Scene) and loaded.geometry, "trimesh finds no geometry")
    triangles = sum(gltf.accessors[p.indices].count // 3 for p in primitives)
    found = sum(len(g.faces) for g in loaded.geometry.values())
    require(found == triangles, f"trimesh finds {found} triangles of {triangles}")
    return "; ".join(lines) + f"; extras {json.dumps(extras)[:120]}"


def check_ply(path):
    mesh = trimesh.load(path, process=False)
    data = mesh.metadata["_ply_raw"]["vertex"]["data"]
    names = data.dtype.names if isinstance(data, np.ndarray) else tuple(data)
    require({"k1", "k2"} <= set(names), f"properties k1 and k2 are missing; there are {names}")
    k1, k2 = np.ravel(data["k1"]), np.ravel(data["k2"])
    require(len(k1) == len(mesh.vertices), "k1 and the vertices differ in number")
    require(np.isfinite(k1).all() and np.isfinite(k2).all(), "k1 or k2 is not finite")
    require((k1 >= k2).all(), "k1 < k2 somewhere")
    axes = next((d for d in DIRECTIONS if set(d) <= set(names)), None)
    require(axes is not None, f"no direction of k1 among {names}")
    units(np.column_stack([np.ravel(data[a]) for a in axes]), k1 == k2, "direction")
    return f"{len(mesh.vertices)} vertices, {len(mesh.faces)} triangles, kappa {k2.min():.4g} to {k1.max():.4g}"


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for path in map(Path, sys.argv[1:]):
        try:
            report = check_ply(path) if path.suffix == ".ply" else check_glb(path)
        except Broken as broken:
            sys.exit(f"{path}: {broken}")
        print(f"{path}: {report}")


if __name__ == "__main__":
    main()
