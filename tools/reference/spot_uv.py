"""Makes assets/meshes/spot.obj: Spot with texture coordinates.

    spot_uv.py SPOT.ply -o spot.obj [--picture atlas.png]

SPOT.ply is deps/geometry-central/test/assets/spot.ply of potpourri3d's source archive:

    pip download --no-binary potpourri3d --no-deps potpourri3d==1.4.0

It has no texture coordinates, so xatlas makes an atlas. Vertices and triangles keep their order;
`v` lines hold the single-precision positions in full, so that a reader in f32 and a reader in f64
see the same numbers.
"""

import argparse
from pathlib import Path

import igl
import numpy as np
import xatlas

RESOLUTION = 1024  # texels for which the charts are packed
PADDING = 4  # texels between charts, so that a bilinear lookup two mip levels down does not bleed


def atlas(V, F):
    """(uv [k, 2] in 0..1, triangle corners into uv [m, 3], number of charts)."""
    charts = xatlas.ChartOptions()
    charts.max_cost = 8.0  # the default of 2 and one iteration cut Spot into 39 charts
    charts.max_iterations = 4
    pack = xatlas.PackOptions()
    pack.resolution = RESOLUTION
    pack.padding = PADDING
    pack.bilinear = True
    pack.bruteForce = True
    pack.rotate_charts = False  # xatlas rotates by swapping u and v, which mirrors the chart
    atlas = xatlas.Atlas()
    atlas.add_mesh(V.astype(np.float32), F.astype(np.uint32))
    atlas.generate(chart_options=charts, pack_options=pack)
    vertex, corners, uv = atlas[0]
    if not np.array_equal(vertex[corners], F):
        raise SystemExit("xatlas changed the triangles")
    size = np.array([atlas.width, atlas.height], dtype=float)  # xatlas stretches a 1024x1100 atlas to 1x1
    return uv * (size / size.max()), corners, atlas.chart_count


def write_obj(path, V, F, uv, corners, comment):
    """Writes v, vt and f lines; positions in full, texture coordinates to 1e-6."""
    with open(path, "w", encoding="ascii", newline="\n") as out:
        out.write(f"# {comment}\n")
        out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in V.tolist())
        out.writelines(f"vt {u:.6f} {v:.6f}\n" for u, v in uv.tolist())
        for face, texture in zip(F + 1, corners + 1):
            out.write("f " + " ".join(f"{a}/{b}" for a, b in zip(face, texture)) + "\n")


def draw(path, uv, corners):
    """The atlas as a picture, to look at."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 8))
    axes.triplot(uv[:, 0], uv[:, 1], corners, linewidth=0.4)
    axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
    figure.savefig(path, dpi=120)


def stretch(V, F, uv, corners):
    """Per triangle: signed uv area, and the ratio of the larger to the smaller stretch."""
    edges = np.stack([V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]], axis=2)
    flat = np.stack([uv[corners[:, 1]] - uv[corners[:, 0]], uv[corners[:, 2]] - uv[corners[:, 0]]], axis=2)
    area = np.linalg.det(flat) / 2
    sigma = np.linalg.svd(edges @ np.linalg.inv(flat), compute_uv=False)
    return area, sigma


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--picture", type=Path)
    args = parser.parse_args()
    V, F = igl.read_triangle_mesh(str(args.mesh))
    uv, corners, charts = atlas(V, F)
    comment = "Spot by Keenan Crane, public domain; texture coordinates by xatlas"
    write_obj(args.output, V, F, uv, corners, comment)
    area, sigma = stretch(V, F, uv, corners)
    print(
        f"{charts} charts, {len(uv)} texture vertices for {len(V)} vertices, "
        f"{np.abs(area).sum():.3f} of the unit square used, {(area <= 0).sum()} flipped triangles, "
        f"stretch ratio median {np.median(sigma[:, 0] / sigma[:, 1]):.3f} max {(sigma[:, 0] / sigma[:, 1]).max():.2f}, "
        f"world length per uv {sigma.mean():.4f} +- {sigma.std():.4f}"
    )
    if args.picture:
        draw(args.picture, uv, corners)


if __name__ == "__main__":
    main()
