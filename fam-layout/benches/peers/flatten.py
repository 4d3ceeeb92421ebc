"""SLIM and LSCM by libigl, of a surface or of each of its charts."""

import time

import igl
import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from charts import loops, to_flatten
from obj import Refused

# SLIM ends when a step changes the energy by less than this part of it, or after so many steps.
LEAST_CHANGE, MOST_STEPS = 1e-6, 100
# Empty room between charts, as a part of the side of a square as large as all of them.
GAP = 0.005


def areas(points, faces):
    """Signed areas [T] of triangles in the plane."""
    a, b = (points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def energy(vertices, faces, uvs):
    """The symmetric Dirichlet energy, the mean over the area of the surface: 4 without distortion."""
    a, b = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    p, q = (uvs[faces[:, k]] - uvs[faces[:, 0]] for k in (1, 2))
    double = np.linalg.norm(np.cross(a, b), axis=1)
    aa, ab, bb = (a * a).sum(1), (a * b).sum(1), (b * b).sum(1)
    pp, pq, qq = (p * p).sum(1), (p * q).sum(1), (q * q).sum(1)
    # |J|² of the map between the triangles, times the square of its determinant in `double`.
    squares = pp * bb - 2 * pq * ab + qq * aa
    with np.errstate(all="ignore"):
        values = squares / double**2 + squares / (2 * areas(uvs, faces)) ** 2
    return float((values * double).sum() / double.sum())


def tutte(faces, borders, circle):
    """Every vertex at the mean of its neighbours, the longest loop on the circle. Each hole is
    filled with a fan around one more vertex, so that no triangle flips."""
    count = faces.max() + 1
    for loop in borders[1:]:
        fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), count)], axis=1)
        faces, count = np.concatenate([faces, fan]), count + 1
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends = np.concatenate([ends, ends[:, ::-1]])
    links = coo_matrix((np.ones(len(ends)), ends.T), (count, count)).tocsr()
    links.data[:] = 1
    laplacian = (diags(np.asarray(links.sum(1)).ravel()) - links).tocsc()
    free = np.setdiff1d(np.arange(count), borders[0])
    points = np.zeros((count, 2))
    points[borders[0]] = circle
    if len(free):
        known = -laplacian[free][:, borders[0]] @ circle
        points[free] = spsolve(laplacian[free][:, free], known).reshape(-1, 2)
    return points


def on_circle(vertices, faces, borders):
    """A start without flips: harmonic, or Tutte's where that flips."""
    circle = np.asarray(igl.map_vertices_to_circle(np.asfortranarray(vertices),
                                                   borders[0].astype(np.int32)))
    start = igl.harmonic(vertices, faces, borders[0], np.ascontiguousarray(circle), 1)
    if not (areas(start, faces) > 0).all():
        start = tutte(faces, borders, circle)[: len(vertices)]
    if not (areas(start, faces) > 0).all():
        raise Refused("triangles flip in the start on a circle")
    return start


def by_slim(vertices, faces, borders):
    """SLIM from a start on a circle, with the symmetric Dirichlet energy and nothing fixed."""
    start = on_circle(vertices, faces, borders)
    # The energy depends on the scale: start with the area of the surface, which is 1.
    start = np.column_stack([start / np.sqrt(areas(start, faces).sum()), np.zeros(len(start))])
    data = igl.slim_precompute(
        np.asfortranarray(vertices), np.asfortranarray(faces.astype(np.int32)),
        np.asfortranarray(start[:, :2]), igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.zeros(0, np.int32), np.zeros((0, 2), order="F"), 0.0)
    before = energy(vertices, faces, start[:, :2])
    for _ in range(MOST_STEPS):
        uvs = np.asarray(igl.slim_solve(data, 1))[:, :2]
        after = energy(vertices, faces, uvs)
        if abs(before - after) < LEAST_CHANGE * after:
            break
        before = after
    return uvs


def by_lscm(vertices, faces, borders):
    """LSCM with two vertices of the boundary fixed, each the farthest from the other or nearly so."""
    loop = borders[0]
    ends = [loop[0]]
    for _ in range(2):
        distances = np.linalg.norm(vertices[loop] - vertices[ends[-1]], axis=1)
        ends.append(loop[distances.argmax()])
    return igl.lscm(vertices, faces, np.array(ends[1:]), np.array([[0.0, 0.0], [1.0, 0.0]]))[0]


PEERS = {"slim": by_slim, "lscm": by_lscm}


def in_rows(charts):
    """Charts side by side in the unit square, in the order given, in as many rows as make it about
    full: one for a few. UVs have few digits, so that one row of thousands would blur them."""
    side = np.sqrt(sum(np.prod(np.ptp(points, axis=0)) for points in charts))
    side = max(side, *(np.ptp(points[:, 0]) for points in charts), 0)
    gap = GAP * side
    corner, height, placed = np.zeros(2), 0.0, []
    for points in charts:
        size = np.ptp(points, axis=0)
        if corner[0] > 0 and corner[0] + size[0] > side * (1 + 2 * GAP):
            corner, height = np.array([0.0, corner[1] + height + gap]), 0.0
        placed.append(points - points.min(axis=0) + corner)
        corner[0] += size[0] + gap
        height = max(height, size[1])
    largest = max(points.max() for points in placed)
    return [points / largest for points in placed]


def by_igl(peer, surface):
    """UVs [N, 2], triangles [T, 3] into them, seconds, and whether the surface was cut."""
    faces, copies, pieces, is_cut = to_flatten(surface)
    prepared = []
    for piece in range(pieces.max() + 1):
        vertices, inside = np.unique(faces[pieces == piece], return_inverse=True)
        inside = inside.reshape(-1, 3)
        try:
            borders = loops(inside)
        except Refused as reason:
            raise Refused(f"a chart cannot be flattened: {reason}") from None
        prepared.append((vertices, inside, borders))
    started = time.perf_counter()
    flat = []
    for vertices, inside, borders in prepared:
        positions = surface.vertices[copies[vertices]]
        a, b = (positions[inside[:, k]] - positions[inside[:, 0]] for k in (1, 2))
        area = np.linalg.norm(np.cross(a, b), axis=1).sum() / 2
        if not area > 0:
            raise Refused("a chart has no area")
        points = PEERS[peer](positions / np.sqrt(area), inside, borders)
        size = np.abs(areas(points, inside)).sum()
        if not (np.isfinite(points).all() and size > 0):
            raise Refused("the UVs are not finite or have no area")
        flat.append(points * np.sqrt(area / size))
    uvs = np.zeros((len(copies), 2))
    for (vertices, _, _), points in zip(prepared, in_rows(flat)):
        uvs[vertices] = points
    return uvs, faces, time.perf_counter() - started, is_cut
