"""The neighbourhoods and design matrices of igl::principal_curvature, in numpy.

libigl returns curvatures but not how well-posed each fit was. This module repeats
its steps (neighbourhood, projection-plane check, frame, design matrix) to give the
2-norm condition number of every vertex's least-squares problem, so that a comparison
can state which vertices are decided by rounding. `curvatures` finishes the
computation, which checks that the steps are the ones libigl takes: it agrees with libigl 2.6.3 to
5e-13 of |kappa| + 1/diagonal on every recorded mesh and on turned CAD parts.

Some sums are taken in libigl's order, since a comparison hangs on their last bit: face normals, areas
and vertex normals (left to right, face by face), the product of two vertex normals that the
projection-plane check compares with zero (left to right), and distances in sphere mode (x + (y + z), as
Eigen unrolls a fixed-size sum). With any other order, hundreds of vertices of a part with right
angles come out with other members, and curvatures that differ by 100 %.
"""

import heapq
import math

import numpy as np

MIN_MEMBERS = 6  # libigl skips a vertex with fewer, the vertex itself included
SVD_CUT = 5 * np.finfo(float).eps  # singular values below this share of the largest are dropped


def adjacency(n, faces):
    """Sorted, distinct neighbours of every vertex; a face (a, a, b) makes a its own neighbour."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
    starts = np.searchsorted(ends[:, 0], np.arange(n + 1))
    return [ends[a:b, 1].tolist() for a, b in zip(starts[:-1], starts[1:])]


def vertex_normals(V, F):
    """Area-weighted unit normals, the same bits as libigl's; zero where no area adds up.

    The bits matter: on parts with right angles the sign of the product of two normals, which the
    projection-plane check asks for, hangs on the last one.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
        length = norm(normal)
        normal = np.where(length > 0, normal / length, 0)
        r, s = V[F[:, 0]] - V[F[:, 2]], V[F[:, 1]] - V[F[:, 2]]
        area = norm(np.column_stack([r[:, d] * s[:, d - 2] - r[:, d - 2] * s[:, d] for d in range(3)]))
        total = np.zeros_like(V)
        np.add.at(total, F.ravel(), np.repeat(normal * area, 3, axis=0))  # face by face, in order
        length = norm(total)
        return np.where(length > 0, total / length, 0)


def cross(a, b):
    """Row-wise cross product, evaluated as written."""
    return np.column_stack([a[:, d - 2] * b[:, d - 1] - a[:, d - 1] * b[:, d - 2] for d in range(3)])


def norm(a):
    """Row-wise length as a column, summed from left to right."""
    return np.sqrt((a[:, :1] * a[:, :1] + a[:, 1:2] * a[:, 1:2]) + a[:, 2:] * a[:, 2:])


def ring(adj, i, radius):
    """Vertices within `radius` edges of i."""
    seen, front = {i}, [i]
    for _ in range(radius):
        front = [w for w in {w for v in front for w in adj[v]} if w not in seen]
        seen.update(front)
    return sorted(seen)


def ball(adj, V, i, rho):
    """Vertices reached from i through vertices nearer than rho, topped up to MIN_MEMBERS."""
    members, seen, queue, spare = [], {i}, [i], []
    for v in queue:
        members.append(v)
        for w in adj[v]:
            if w in seen:
                continue
            seen.add(w)
            distance = gap(V[i], V[w])
            if distance < rho:
                queue.append(w)
            elif len(members) < MIN_MEMBERS:
                heapq.heappush(spare, (distance, w))
    while spare and len(members) < MIN_MEMBERS:
        _, v = heapq.heappop(spare)
        members.append(v)
        for w in adj[v]:
            if w not in seen:
                seen.add(w)
                heapq.heappush(spare, (gap(V[i], V[w]), w))
    return members


def gap(a, b):
    """Distance of two points, summed in the order that Eigen unrolls."""
    x, y, z = a - b
    return math.sqrt(x * x + (y * y + z * z))


def neighbourhoods(V, F, radius, use_ring):
    """Yields (i, members) before the projection-plane check, for every vertex."""
    adj = adjacency(len(V), F)
    x, y, z = (V[F] - V[F[:, [1, 2, 0]]]).reshape(-1, 3).T
    rho = np.add.accumulate(np.sqrt(x * x + (y * y + z * z)))[-1] / (3 * len(F)) * radius
    for i in range(len(V)):
        yield i, (ring(adj, i, radius) if use_ring else ball(adj, V, i, rho)), adj[i]


def fits(V, F, radius, use_ring):
    """Yields (i, fit) with fit = (design matrix, heights, t, s), or None for a skipped vertex."""
    N = vertex_normals(V, F)
    for i, members, near in neighbourhoods(V, F, max(radius, 2), use_ring):
        if len(members) < MIN_MEMBERS:
            yield i, None
            continue
        members = np.asarray(members)
        x, y, z = (N[members] * N[i]).T
        facing = members[(x + y) + z > 0]
        if MIN_MEMBERS <= len(facing) < len(members):
            members = facing
        edge = V[near[0]] - V[i]
        t = unit(edge - N[i] * (N[i] @ edge))
        s = unit(np.cross(N[i], t))
        u, v, w = ((V[members] - V[i]) @ np.column_stack([t, s, N[i]])).T
        yield i, (np.column_stack([u * u, u * v, v * v, u, v]), w, t, s)


def conditions(V, F, radius, use_ring):
    """2-norm condition number of every vertex's design matrix; inf if singular, NaN if skipped."""
    result = np.full(len(V), np.nan)
    for i, fit in fits(V, F, radius, use_ring):
        if fit is not None:
            sigma = np.linalg.svd(fit[0], compute_uv=False)
            result[i] = sigma[0] / sigma[-1] if sigma[-1] > 0 else np.inf
    return result


def curvatures(V, F, radius, use_ring):
    """(kmax, kmin) of every vertex by libigl's formulas, its wrong off-diagonal entry included."""
    result = np.zeros((len(V), 2))
    for i, fit in fits(V, F, radius, use_ring):
        if fit is None:
            continue
        a, b, c, d, e = np.linalg.lstsq(fit[0], fit[1], rcond=SVD_CUT)[0]
        E, F_, G = 1 + d * d, d * e, 1 + e * e
        L, M, N = np.array([2 * a, b, 2 * c]) / np.sqrt(1 + d * d + e * e)
        lower = M * E - L * F_
        operator = np.array([[L * G - M * F_, lower], [lower, N * E - M * F_]]) / (E * G - F_ * F_)
        result[i] = -np.linalg.eigvalsh(operator)
    return result


def unit(x):
    length = np.linalg.norm(x)
    return x / length if length > 0 else x
