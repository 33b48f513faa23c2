"""Meshes made by formula, and a PLY writer that loses no bit.

Every function returns (V f64 [n, 3], F i64 [m, 3]) with outward orientation. Meshes are irregular
on purpose: on regular ones, errors of a curvature estimator cancel by symmetry. `rng` is a
numpy Generator, so that a seed makes a mesh.
"""

import numpy as np
from scipy.spatial import ConvexHull, Delaunay


def write_ply(path, V, F):
    """Binary little-endian PLY with double positions."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(V)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(F)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(F), dtype=[("count", "u1"), ("corner", "<i4", 3)])
    faces["count"] = 3
    faces["corner"] = F
    with open(path, "wb") as out:
        out.write(header.encode("ascii"))
        out.write(np.ascontiguousarray(V, dtype="<f8").tobytes())
        out.write(faces.tobytes())


def rotated(V, rng):
    """Positions turned by a random rotation, so that no axis is special."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    if np.linalg.det(q) < 0:
        q[:, 0] *= -1
    return V @ q.T


def renumbered(V, F, rng):
    """The same surface with vertices and triangles in random order."""
    order = rng.permutation(len(V))
    rank = np.empty(len(V), dtype=np.int64)
    rank[order] = np.arange(len(V))
    return V[order], rank[F][rng.permutation(len(F))]


def without_unused(V, F):
    """The mesh less the vertices that no triangle uses."""
    used, F = np.unique(F, return_inverse=True)
    return V[used], F.reshape(-1, 3)


def grid(rows, columns, wrap_rows, wrap_columns, rng):
    """Triangles of a grid whose quads are cut along a random diagonal each."""
    i, j = np.meshgrid(np.arange(rows - (not wrap_rows)), np.arange(columns - (not wrap_columns)), indexing="ij")
    i, j = i.ravel(), j.ravel()
    a, b = i * columns + j, (i + 1) % rows * columns + j
    c, d = (i + 1) % rows * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    flip = rng.random(len(a)) < 0.5
    first = np.where(flip[:, None], np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    second = np.where(flip[:, None], np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    return np.concatenate([first, second]).astype(np.int64)


def jitter(rows, columns, amount, rng):
    """Grid coordinates (row, column), each moved by up to `amount` cells."""
    i, j = np.meshgrid(np.arange(rows, dtype=float), np.arange(columns, dtype=float), indexing="ij")
    return i + rng.uniform(-amount, amount, i.shape), j + rng.uniform(-amount, amount, j.shape)


def icosphere(level, radius=1.0):
    """Icosahedron, each triangle cut in four `level` times, vertices on the sphere."""
    g = (1 + 5**0.5) / 2
    V = np.array([[s * a, t * b, 0] for a, b in [(1, g)] for s in (1, -1) for t in (1, -1)], dtype=float)
    V = np.concatenate([V, np.roll(V, 1, axis=1), np.roll(V, 2, axis=1)])
    F = ConvexHull(V).simplices.astype(np.int64)
    V, F = V / np.linalg.norm(V, axis=1, keepdims=True), outward(V, F)
    for _ in range(level):
        edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        edges, index = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = index.reshape(3, -1) + len(V)
        middle = V[edges].sum(axis=1)
        V = np.concatenate([V, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        a, b, c = F.T
        F = np.concatenate([np.column_stack(t) for t in [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]])
    return V * radius, F


def outward(V, F):
    """Triangles of a star-shaped body around the origin, turned to face away from it."""
    normal = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    inward = (normal * V[F].mean(axis=1)).sum(axis=1) < 0
    F = F.copy()
    F[inward] = F[inward][:, ::-1]
    return F


def torus(major, minor, rows, columns, rng, amount=0.3):
    """Irregular torus around z; `amount` is the jitter in cells."""
    i, j = jitter(rows, columns, amount, rng)
    u, v = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    ring = major + minor * np.cos(v)
    V = np.stack([ring * np.cos(u), ring * np.sin(u), minor * np.sin(v)], axis=2).reshape(-1, 3)
    return V, grid(rows, columns, True, True, rng)


def cylinder(radius, height, rows, columns, rng, amount=0.25):
    """Irregular open cylinder around z; its two rims stay circles."""
    i, j = jitter(rows, columns, amount, rng)
    i[0], i[-1] = 0, rows - 1
    u = 2 * np.pi * j / columns
    V = np.stack([radius * np.cos(u), radius * np.sin(u), height * i / (rows - 1)], axis=2).reshape(-1, 3)
    return V, grid(rows, columns, False, True, rng)[:, ::-1]


def ellipsoid(axes, n, rng):
    """n random points, evened out a little, on an ellipsoid with semi-axes `axes`."""
    V = rng.normal(size=(n, 3))
    V /= np.linalg.norm(V, axis=1, keepdims=True)
    for _ in range(4):  # away from slivers, towards even density
        F = ConvexHull(V).simplices
        total, count = np.zeros_like(V), np.zeros((n, 1))
        for corner in range(3):
            np.add.at(total, F[:, corner], V[F].mean(axis=1))
            np.add.at(count, F[:, corner], 1)
        V = total / count
        V /= np.linalg.norm(V, axis=1, keepdims=True)
    return V * axes, outward(V, ConvexHull(V).simplices.astype(np.int64))


def patch(height, half_width, n, rng):
    """Height field z = height(x, y) over random points of a square, Delaunay triangulated."""
    side = max(4, round(n**0.5 / 2))
    rim = np.linspace(-half_width, half_width, side + 1)[:-1]
    edge = np.full_like(rim, half_width)
    border = np.concatenate([np.column_stack(p) for p in [(rim, -edge), (edge, rim), (-rim, edge), (-edge, -rim)]])
    inner = best_candidate(n - len(border), half_width * 0.97, rng)
    P = np.concatenate([border, inner])
    F = Delaunay(P).simplices.astype(np.int64)
    a, b, c = P[F[:, 0]], P[F[:, 1]], P[F[:, 2]]
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    F[area < 0] = F[area < 0][:, ::-1]
    F = F[np.abs(area) > 1e-9 * half_width**2]
    return np.column_stack([P, height(P[:, 0], P[:, 1])]), F


def best_candidate(n, half_width, rng, tries=4):
    """n points of a square, each the farthest from the others of a few candidates."""
    points = np.empty((n, 2))
    for k in range(n):
        candidates = rng.uniform(-half_width, half_width, (tries, 2))
        gaps = ((candidates[:, None] - points[None, :k]) ** 2).sum(axis=2)
        points[k] = candidates[gaps.min(axis=1, initial=np.inf).argmax()]
    return points


def bracket(step):
    """CAD-like part with sharp edges: an L profile with a fillet and a bore, extruded along z.

    `step` is the edge length; the outline is 4 x 3 with legs 1 wide, the fillet has radius 0.6, the
    bore 0.3, the depth is 1.5. Side walls meet the caps at right angles.
    """

    def line(p, q):
        k = max(1, round(np.hypot(q[0] - p[0], q[1] - p[1]) / step))
        return np.linspace(p, q, k + 1)[:-1]

    def arc(centre, radius, start, stop):
        k = max(3, round(abs(stop - start) * radius / step))
        t = np.linspace(start, stop, k + 1)[:-1]
        return np.column_stack([centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t)])

    corner = (1.0 + 0.6, 1.0 + 0.6)
    outline = np.concatenate(
        [
            line((0, 0), (4, 0)),
            line((4, 0), (4, 1)),
            line((4, 1), (corner[0], 1)),
            arc(corner, 0.6, 1.5 * np.pi, np.pi),
            line((1, corner[1]), (1, 3)),
            line((1, 3), (0, 3)),
            line((0, 3), (0, 0)),
        ]
    )
    hole = arc((3.0, 0.5), 0.3, 0.0, -2 * np.pi)
    loops = [np.arange(len(outline)), len(outline) + np.arange(len(hole))]
    rim = np.concatenate([outline, hole])

    def inside(p):
        x, y = p.T
        cut = (x > 1) & (y > 1) & ~((x < corner[0]) & (y < corner[1]) & (np.hypot(x - corner[0], y - corner[1]) > 0.6))
        box = (x > 0) & (x < 4) & (y > 0) & (y < 3)
        return box & ~cut & (np.hypot(x - 3.0, y - 0.5) > 0.3)

    x, y = np.meshgrid(np.arange(0, 4, step), np.arange(0, 3, step * 3**0.5 / 2))
    x = x + step / 2 * (np.arange(len(x)) % 2)[:, None]
    inner = np.column_stack([x.ravel(), y.ravel()])
    gap = np.sqrt(((inner[:, None] - rim[None]) ** 2).sum(axis=2)).min(axis=1)
    flat = np.concatenate([rim, inner[inside(inner) & (gap > 0.55 * step)]])
    cap = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = flat[cap[:, 0]], flat[cap[:, 1]], flat[cap[:, 2]]
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    cap[area < 0] = cap[area < 0][:, ::-1]
    cap = cap[inside(flat[cap].mean(axis=1)) & (np.abs(area) > 1e-9)]
    return extrude(flat, cap, loops, 1.5, step)


def extrude(flat, cap, loops, depth, step):
    """Two copies of the cap joined by walls along the loops (counter-clockwise outside)."""
    layers = max(1, round(depth / step))
    V = [np.column_stack([flat, np.full(len(flat), z)]) for z in (0.0, depth)]
    F = [cap[:, ::-1], cap + len(flat)]
    count = 2 * len(flat)
    for loop in loops:
        below = loop
        for layer in range(1, layers + 1):
            if layer == layers:
                above = loop + len(flat)
            else:
                above = count + np.arange(len(loop))
                V.append(np.column_stack([flat[loop], np.full(len(loop), depth * layer / layers)]))
                count += len(loop)
            next_below, next_above = np.roll(below, -1), np.roll(above, -1)
            F += [np.column_stack([below, next_below, next_above]), np.column_stack([below, next_above, above])]
            below = above
    return np.concatenate(V), np.concatenate(F)


def broken(rng):
    """A readable mesh with everything that can be wrong with one, and a good part to compare.

    In order: an irregular torus; two triangles glued to one of its edges (non-manifold edge); a
    lone triangle; a strip of five vertices; two tetrahedra that share one vertex; a triangle with
    three collinear corners; a repeated triangle; vertices that no triangle uses, two of
    them last.
    """
    V, F = torus(1.0, 0.4, 24, 12, rng, 0.3)
    V, F = list(V), [tuple(t) for t in F]
    n = len(V)
    V += [V[0] * 1.3, V[1] * 1.3]
    F += [(0, 12, n), (12, 0, n + 1)]
    add(V, F, [(3, 0, 0), (3.2, 0, 0), (3, 0.2, 0.05)], [(0, 1, 2)])
    add(V, F, [(4, 0, 0), (4.2, 0, 0.02), (4, 0.2, 0), (4.2, 0.2, 0.05), (4.1, 0.35, 0)], [(0, 1, 2), (1, 3, 2), (2, 3, 4)])
    tip = [(5, 0, 0), (5.3, 0, 0.3), (5, 0.3, 0.3), (4.8, -0.2, 0.3), (5.4, 0, -0.3), (5.2, 0.3, -0.35), (4.9, -0.2, -0.25)]
    add(V, F, tip, [(0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3), (0, 4, 5), (0, 5, 6), (0, 6, 4), (4, 6, 5)])
    add(V, F, [(6, 0, 0), (6.1, 0, 0), (6.2, 0, 0)], [(0, 1, 2)])
    F.append(F[5])
    add(V, F, [(7, 0, 0), (7, 1, 0)], [])
    return np.array(V, dtype=float), np.array(F, dtype=np.int64)


def add(V, F, points, triangles):
    """Appends a part whose triangles count from its own first point."""
    start = len(V)
    V.extend(np.array(p, dtype=float) for p in points)
    F.extend(tuple(start + k for k in t) for t in triangles)
