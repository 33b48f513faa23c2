"""Makes assets/meshes/{rabbit,monkey,armadillo}.obj: closed organic meshes of uneven curvature with texture coordinates.

    creature_obj.py NAME -o NAME.obj [--edge 0.06] [--picture atlas.png]

A creature is a smooth union of ellipsoids and round cones, given below as a table of parts; nothing is scanned or copied.
Its level set is found by marching cubes, meshed anew with even triangles by pymeshlab (isotropic explicit remeshing), and every
vertex is put back on the level set by Newton's steps along the gradient, so that positions are exact to rounding and
curvature changes smoothly from part to part. xatlas makes the texture atlas as for Spot (spot_uv.py); charts that it mirrors are turned over.

Parts are thick against a material's depth: a tenth of a tile on a tile of 0.24 diagonals is 0.024 diagonals, and the
thinnest parts have three times that radius.
"""

import argparse
from pathlib import Path

import igl
import numpy as np
import pymeshlab

from spot_uv import atlas, draw, stretch, write_obj

BLEND = 0.12  # length over which neighbouring parts flow together
GRID = 0.03  # cells of the marching cubes


def ellipsoid(centre, radii):
    """Distance to an ellipsoid, to first order near its surface."""

    def distance(p):
        q = p - centre
        a = np.linalg.norm(q / radii, axis=1)
        b = np.linalg.norm(q / np.square(radii), axis=1)
        return a * (a - 1.0) / np.maximum(b, 1e-9)

    return distance


def cone(a, b, ra, rb):
    """Distance to spheres of radii from ra to rb on the way from a to b."""
    a, b = np.asarray(a, float), np.asarray(b, float)

    def distance(p):
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        # A smooth step, so that radii do not change with a crease.
        radius = ra + (rb - ra) * t * t * (3.0 - 2.0 * t)
        return np.linalg.norm(p - (a + t[:, None] * (b - a)), axis=1) - radius

    return distance


def both(make, *places):
    """A part and its mirror image in x."""

    def mirrored(place):
        place = np.array(place, float)
        place[0] = -place[0]
        return place

    return lambda *radii: [make(*places, *radii), make(*map(mirrored, places), *radii)]


def rabbit():
    return (
        [
            ellipsoid((0, 0.0, -0.2), (0.58, 0.55, 0.72)),
            ellipsoid((0, 0.2, 0.3), (0.45, 0.48, 0.42)),
            ellipsoid((0, 0.75, 0.55), (0.36, 0.36, 0.42)),
            ellipsoid((0, 0.66, 0.88), (0.22, 0.2, 0.2)),
            ellipsoid((0, 0.1, -0.95), (0.24, 0.24, 0.22)),
        ]
        + both(cone, (0.16, 1.0, 0.42), (0.34, 1.75, 0.2))(0.17, 0.19)
        + both(ellipsoid, (0.42, -0.12, -0.3))((0.3, 0.42, 0.46))
        + both(cone, (0.42, -0.5, -0.4), (0.46, -0.52, 0.12))(0.19, 0.18)
        + both(cone, (0.22, 0.0, 0.5), (0.24, -0.48, 0.8))(0.19, 0.18),
        [],
    )


def monkey():
    return (
        [
            ellipsoid((0, 0.15, -0.05), (0.75, 0.78, 0.74)),
            cone((-0.3, 0.3, 0.52), (0.3, 0.3, 0.52), 0.24, 0.24),
            ellipsoid((0, -0.38, 0.5), (0.48, 0.36, 0.42)),
            ellipsoid((0, -0.1, 0.82), (0.17, 0.15, 0.15)),
        ]
        + both(ellipsoid, (0.9, 0.1, -0.1))((0.2, 0.38, 0.3)),
        both(ellipsoid, (0.27, 0.1, 0.86))((0.2, 0.17, 0.2)) + both(ellipsoid, (1.02, 0.1, 0.08))((0.16, 0.24, 0.2)),
    )


def armadillo():
    shell = [ellipsoid((0, 0.35 - 0.28 * k, -0.3 + 0.06 * abs(k - 1.5)), (0.56, 0.2, 0.42)) for k in range(4)]
    return (
        [
            ellipsoid((0, 0.0, 0.0), (0.52, 0.72, 0.45)),
            ellipsoid((0, 0.85, 0.15), (0.34, 0.34, 0.36)),
            cone((0, 0.8, 0.35), (0, 0.68, 0.8), 0.24, 0.17),
            cone((0, -0.5, -0.3), (0.15, -0.85, -1.15), 0.3, 0.16),
        ]
        + shell
        + both(cone, (0.2, 1.05, 0.05), (0.42, 1.4, -0.05))(0.17, 0.18)
        + both(cone, (0.45, 0.35, 0.1), (0.95, 0.45, 0.3))(0.24, 0.2)
        + both(cone, (0.95, 0.45, 0.3), (1.1, 0.85, 0.55))(0.2, 0.19)
        + both(cone, (0.3, -0.5, 0.05), (0.42, -1.15, 0.1))(0.32, 0.24)
        + both(cone, (0.42, -1.2, 0.1), (0.46, -1.22, 0.45))(0.22, 0.19),
        [],
    )


CREATURES = {"rabbit": rabbit, "monkey": monkey, "armadillo": armadillo}


def level(parts, hollows):
    """The blended distance: minimum over parts, then without hollows, both smoothed over BLEND."""

    def smooth(distances):
        # The usual soft minimum, shifted so that far from all other parts it is the distance itself.
        scaled = -np.stack(distances) / (0.35 * BLEND)
        top = scaled.max(axis=0)
        return -0.35 * BLEND * (top + np.log(np.exp(scaled - top).sum(axis=0)))

    def value(p):
        body = smooth([part(p) for part in parts])
        if not hollows:
            return body
        return -smooth([-body] + [hollow(p) for hollow in hollows])

    return value


def gradient(value, p, step=1e-4):
    shifts = step * np.eye(3)
    return np.stack([(value(p + s) - value(p - s)) / (2 * step) for s in shifts], axis=1)


def mesh(value, edge):
    """Vertices on the level set and even triangles."""
    low, high = np.array([-1.6, -1.8, -1.7]), np.array([1.6, 2.2, 1.5])
    counts = np.ceil((high - low) / GRID).astype(int) + 1
    axes = [low[i] + GRID * np.arange(counts[i]) for i in range(3)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    V, F = igl.marching_cubes(value(points), points, *map(int, counts), 0.0)[:2]
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(V, F))
    for _ in range(3):
        meshes.meshing_isotropic_explicit_remeshing(
            iterations=5, targetlen=pymeshlab.PureValue(edge), featuredeg=180.0, checksurfdist=False
        )
        current = meshes.current_mesh()
        V, F = current.vertex_matrix(), current.face_matrix()
        V = onto(value, V)
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(V, F))
    return V, F


def onto(value, V):
    for _ in range(8):
        g = gradient(value, V)
        V = V - (value(V) / np.maximum((g * g).sum(axis=1), 1e-6))[:, None] * g
    return V


def unmirrored(uv, corners):
    """Turns over the charts that xatlas has mirrored, each in its own rectangle; no chart may be both."""
    parent = np.arange(len(uv))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in corners:
        parent[root(b)] = parent[root(c)] = root(a)
    chart = np.array([root(i) for i in range(len(uv))])
    edges = np.stack([uv[corners[:, 1]] - uv[corners[:, 0]], uv[corners[:, 2]] - uv[corners[:, 0]]], axis=2)
    upright = np.linalg.det(edges) > 0
    uv = uv.copy()
    for mirrored in np.unique(chart[corners[~upright, 0]]):
        if upright[chart[corners[:, 0]] == mirrored].any():
            raise SystemExit("a chart folds over")
        u = uv[chart == mirrored, 0]
        uv[chart == mirrored, 0] = u.min() + u.max() - u
    return uv


def outward(V, F):
    corners = V[F]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
    return F if volume > 0 else F[:, ::-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", choices=CREATURES)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--edge", type=float, default=0.06, help="length of edges")
    parser.add_argument("--picture", type=Path)
    args = parser.parse_args()
    value = level(*CREATURES[args.name]())
    V, F = mesh(value, args.edge)
    V = V.astype(np.float32).astype(float)
    F = np.ascontiguousarray(outward(V, F))
    uv, corners, charts = atlas(V, F)
    uv = unmirrored(uv, corners)
    write_obj(args.output, V, F, uv, corners, f"A {args.name} of the Osculate project: creature_obj.py; texture coordinates by xatlas")
    area, sigma = stretch(V, F, uv, corners)
    edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    print(
        f"{args.name}: {len(V)} vertices, {len(F)} triangles, off the level set by {np.abs(value(V)).max():.1e}, "
        f"edges with other than two triangles {(uses != 2).sum()}, Euler number {len(V) - len(uses) + len(F)}, {charts} charts, "
        f"{(area <= 0).sum()} flipped triangles, stretch ratio median {np.median(sigma[:, 0] / sigma[:, 1]):.3f} "
        f"max {(sigma[:, 0] / sigma[:, 1]).max():.2f}, diagonal {np.linalg.norm(np.ptp(V, axis=0)):.3f}"
    )
    if args.picture:
        draw(args.picture, uv, corners)


if __name__ == "__main__":
    main()
