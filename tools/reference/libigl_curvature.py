"""Records what igl::principal_curvature says about a mesh.

    libigl_curvature.py MESH.{obj,ply,stl,npz} -o REF.npz [--rings 2 5 8] [--sphere 5]

The mesh is read with libigl's own reader (.npz: arrays V and F). The reference holds

    V            f64 [n, 3]  positions as libigl has them
    F            i32 [m, 3]  triangles
    <p>_kmax     f64 [n]     larger principal curvature, 1/length; unit sphere outward = +1
    <p>_kmin     f64 [n]     smaller principal curvature, kmax >= kmin as signed values
    <p>_d1       f64 [n, 3]  direction of kmax, zero where kmax is zero or the vertex is bad
    <p>_d2       f64 [n, 3]  direction of kmin
    <p>_bad      i32 [k]     vertices that libigl lists as bad
    <p>_cond     f64 [n]     optional: 2-norm condition number of the vertex's design matrix,
                             to three digits, inf if singular, NaN if the vertex was skipped
    meta         u8          JSON in UTF-8: versions, source, hash, command, settings, seconds

with one prefix <p> for every setting: r5 is the 5-ring, s5 the sphere of 5 mean edge lengths.
"""

import argparse
import hashlib
import importlib.metadata
import json
import platform
import shlex
import sys
import time
from pathlib import Path

import igl
import numpy as np

import libigl_steps

COND_LIMIT = 20_000  # vertices up to which condition numbers are cheap (seconds)


def read_mesh(path):
    """(V, F) as libigl reads them, or the arrays V and F of an .npz."""
    if path.suffix.lower() == ".npz":
        with np.load(path) as data:
            V, F = data["V"], data["F"]
    else:
        V, F = igl.read_triangle_mesh(str(path))
    V = np.ascontiguousarray(V, dtype=np.float64)
    F = np.ascontiguousarray(F, dtype=np.int64)
    if len(F) == 0 or V.shape[1:] != (3,) or F.shape[1:] != (3,):
        sys.exit(f"{path}: not a triangle mesh: V {V.shape}, F {F.shape}")
    if F.min() < 0 or F.max() >= len(V):
        sys.exit(f"{path}: a face uses a vertex outside 0..{len(V) - 1}")
    return V, F


def weld(V, F):
    """(welded V, F, welded index of every vertex): equal positions merged, first occurrence kept."""
    _, first, back = np.unique(V + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    index = rank[back.reshape(-1)]
    return V[first[order]], index[F], index


def principal_curvature(V, F, radius, use_ring):
    """libigl's result as a dict of arrays, and the seconds its call took.

    libigl reads past its adjacency in sphere mode when the last vertices are unreferenced, so
    they are left out of the call and reported as bad, which is what its k-ring mode does.
    """
    used = len(V) if use_ring else int(F.max()) + 1
    start = time.perf_counter()
    d1, d2, kmax, kmin, bad = igl.principal_curvature(V[:used], F, radius, use_ring)
    seconds = time.perf_counter() - start
    pad = len(V) - used
    result = {
        "kmax": np.pad(kmax, (0, pad)),
        "kmin": np.pad(kmin, (0, pad)),
        "d1": np.pad(d1, ((0, pad), (0, 0))),
        "d2": np.pad(d2, ((0, pad), (0, 0))),
        "bad": np.concatenate([bad, np.arange(used, len(V))]).astype(np.int32),
    }
    return result, seconds


def undefined_vertices(V, F):
    """Vertices whose area-weighted normals cancel, and which libigl does not skip.

    libigl divides by the zero length, fits a quadric to NaN, and Eigen's SVD then reads an index that
    was never set: sometimes the result is zero, sometimes the process dies.
    """
    zero = np.intersect1d(np.flatnonzero(~libigl_steps.vertex_normals(V, F).any(axis=1)), F)
    if len(zero) == 0:
        return zero
    adj = libigl_steps.adjacency(len(V), F)
    return np.array([i for i in zero if len(libigl_steps.ring(adj, i, 2)) >= libigl_steps.MIN_MEMBERS], dtype=int)


def record(V, F, rings, spheres, welded=False, cond=None):
    """(arrays of the reference file without meta, settings with their seconds)."""
    arrays = {"V": V, "F": F.astype(np.int32)}
    surface_v, surface_f, index = weld(V, F) if welded else (V, F, np.arange(len(V)))
    undefined = undefined_vertices(surface_v, surface_f)
    if len(undefined):
        sys.exit(f"libigl's result is undefined: the normals cancel at {len(undefined)} vertices, such as {undefined[0]}")
    with_cond = len(surface_v) <= COND_LIMIT if cond is None else cond
    settings = []
    for prefix, radius, use_ring in [("r", r, True) for r in rings] + [("s", r, False) for r in spheres]:
        result, seconds = principal_curvature(surface_v, surface_f, radius, use_ring)
        bad = result.pop("bad")
        if with_cond:
            condition = libigl_steps.conditions(surface_v, surface_f, radius, use_ring)
            result["cond"] = np.array([float(f"{c:.3g}") for c in condition])
        name = f"{prefix}{radius}"
        arrays.update({f"{name}_{key}": value[index] for key, value in result.items()})
        arrays[f"{name}_bad"] = np.flatnonzero(np.isin(index, bad)).astype(np.int32)
        mode = "k-ring" if use_ring else "sphere"
        settings.append({"prefix": name, "mode": mode, "radius": radius, "seconds": round(seconds, 6)})
    return arrays, settings


def write_reference(path, arrays, settings, source, command, welded=False):
    """Writes the reference with its provenance; `source` is a path, or a name for made-up data."""
    source_path = Path(source)
    digest = hashlib.sha256(source_path.read_bytes()).hexdigest() if source_path.is_file() else None
    meta = {
        "format": 1,
        "libigl": importlib.metadata.version("libigl"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "source": source_path.name,
        "source_sha256": digest,
        "command": command,
        "welded": welded,
        "settings": settings,
    }
    blob = np.frombuffer(json.dumps(meta, indent=1).encode(), dtype=np.uint8)
    np.savez_compressed(path, **arrays, meta=blob)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--rings", type=int, nargs="*", default=[2, 5, 8], metavar="K")
    parser.add_argument("--sphere", type=int, nargs="*", default=[5], metavar="R")
    parser.add_argument("--weld", action="store_true", help="merge equal positions first (always for .stl)")
    parser.add_argument("--cond", action=argparse.BooleanOptionalAction, help="record condition numbers")
    args = parser.parse_args()
    if min(args.rings + args.sphere, default=2) < 2:
        sys.exit("radii below 2 are raised to 2 by libigl; ask for 2")
    V, F = read_mesh(args.mesh)
    welded = args.weld or args.mesh.suffix.lower() == ".stl"
    arrays, settings = record(V, F, args.rings, args.sphere, welded, args.cond)
    command = shlex.join(["libigl_curvature.py"] + [Path(a).name if "/" in a else a for a in sys.argv[1:]])
    write_reference(args.output, arrays, settings, args.mesh, command, welded)
    for setting in settings:
        bad = len(arrays[f"{setting['prefix']}_bad"])
        print(f"{args.output.name}: {setting['prefix']}: {len(V)} vertices, {bad} bad, {setting['seconds']:.3f} s")


if __name__ == "__main__":
    main()
