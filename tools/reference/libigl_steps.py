"""The neighbourhoods and design matrices of igl::principal_curvature, in numpy.

libigl returns curvatures but not how well-posed each fit was. This module repeats
its steps (neighbourhood, projection-plane check, frame, design matrix) to give the
2-norm condition number of every vertex's least-squares problem, so that a comparison
can state which vertices are decided by rounding. `curvatures` finishes the
computation, which checks that the steps are the ones libigl takes.
"""

import heapq

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
    """Area-weighted unit normals, with libigl's Kahan-Heron area; zero where undefined."""
    e1, e2 = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    normal = np.cross(e1, e2)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    sides = np.linalg.norm(V[F[:, [1, 2, 0]]] - V[F[:, [2, 0, 1]]], axis=2)
    c, b, a = np.sort(sides, axis=1).T
    with np.errstate(invalid="ignore"):
        area = 2 * 0.25 * np.sqrt((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)))
    weighted = normal * np.nan_to_num(area)[:, None]
    total = np.zeros_like(V)
    for corner in range(3):
        np.add.at(total, F[:, corner], weighted)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


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
            distance = np.sqrt(((V[w] - V[i]) ** 2).sum())
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
                heapq.heappush(spare, (np.sqrt(((V[w] - V[i]) ** 2).sum()), w))
    return members


def neighbourhoods(V, F, radius, use_ring):
    """Yields (i, members) before the projection-plane check, for every vertex."""
    adj = adjacency(len(V), F)
    rho = radius * np.linalg.norm(V[F] - V[F[:, [1, 2, 0]]], axis=2).mean()
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
        facing = members[N[members] @ N[i] > 0]
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
