"""The charts of a surface: where its UVs cut it, and what shape each piece has."""

import numpy as np

from obj import Refused


def joins(faces, uvs=None):
    """Pairs of half-edges [J, 2] across which two triangles continue each other. Half-edge 3t + k
    runs from corner k of triangle t to the next. The two run in opposite directions and, where
    UVs [T, 3, 2] are given, have the same UVs at both ends."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = [np.minimum(start, end), np.maximum(start, end)]
    forward = start < end
    if uvs is not None:
        _, of_corner = np.unique(uvs.reshape(-1, 2), axis=0, return_inverse=True)
        of_corner = of_corner.reshape(-1, 3)
        first, second = of_corner.ravel(), np.roll(of_corner, -1, axis=1).ravel()
        sides = uvs[:, 1:] - uvs[:, :1]
        # Sheets that lie on each other with the same UVs face opposite sides of the square.
        mirrored = sides[:, 0, 0] * sides[:, 1, 1] < sides[:, 0, 1] * sides[:, 1, 0]
        keys += [np.where(forward, first, second), np.where(forward, second, first),
                 np.repeat(mirrored, 3)]
    _, edge = np.unique(np.stack(keys, axis=1), axis=0, return_inverse=True)
    edge = edge.ravel()
    count = edge.max() + 1
    ways = np.bincount(edge[forward], minlength=count), np.bincount(edge[~forward], minlength=count)
    # Without UVs to tell sheets apart, nothing says which of three or more triangles continue.
    paired = ways[0] == ways[1] if uvs is not None else (ways[0] == 1) & (ways[1] == 1)
    order = np.argsort(edge, kind="stable")
    order = order[paired[edge[order]]]
    return np.stack([order[forward[order]], order[~forward[order]]], axis=1)


def is_seam(faces, pairs):
    """For each half-edge, whether it is a seam: other triangles are along it, but none is joined."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    ends = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1)
    _, edge, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    joined = np.zeros(len(start), bool)
    joined[pairs] = True
    return ~joined & (count[edge.ravel()] > 1)


def components(count, pairs):
    """The component of each of so many things, of which pairs [P, 2] belong together."""
    root = np.arange(count)
    while True:
        a, b = root[pairs[:, 0]], root[pairs[:, 1]]
        if (a == b).all():
            return np.unique(root, return_inverse=True)[1]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while (root != root[root]).any():
            root = root[root]


def following(corner):
    """The corner after another one in its triangle."""
    return corner - corner % 3 + (corner + 1) % 3


def cut(faces, pairs):
    """The triangles [T, 3] of the surface that only these pairs of half-edges join, into vertices
    of its own; the vertex [N] of the given surface that each is a copy of; and the piece [T] that
    each triangle is in."""
    a, b = pairs.T
    same = np.concatenate([np.stack([a, following(b)], 1), np.stack([following(a), b], 1)])
    corners = components(faces.size, same)
    copies = np.zeros(corners.max() + 1, np.int64)
    copies[corners] = faces.ravel()
    return corners.reshape(-1, 3), copies, components(len(faces), pairs // 3)


def loops(faces):
    """The loops of boundary of one piece, longest first, each a list of vertices in the direction of
    the triangles along it. `Refused` where it cannot be flattened whole: it has several parts,
    handles, no boundary, or is not manifold."""
    vertices, compact = np.unique(faces, return_inverse=True)
    compact = compact.reshape(-1, 3)
    if (compact == np.roll(compact, 1, axis=1)).any():
        raise Refused("a triangle has a vertex twice")
    pairs = joins(compact)
    _, copies, pieces = cut(compact, pairs)
    start, end = compact.ravel(), np.roll(compact, -1, axis=1).ravel()
    border = np.ones(len(start), bool)
    border[pairs] = False
    edges = np.unique(np.stack([np.minimum(start, end), np.maximum(start, end)], 1), axis=0)
    if len(copies) > len(vertices) or len(edges) != len(pairs) + border.sum():
        raise Refused("it is not manifold")
    if pieces.max() > 0:
        raise Refused("it has several parts")
    if not border.any():
        raise Refused("it has no boundary")
    after = dict(zip(start[border].tolist(), end[border].tolist()))
    found = []
    while after:
        at = next(iter(after))
        loop = []
        while at in after:
            loop.append(at)
            at = after.pop(at)
        found.append(vertices[loop])
    if len(vertices) - len(edges) + len(faces) != 2 - len(found):
        raise Refused("it has handles")
    return sorted(found, key=len, reverse=True)


def to_flatten(surface):
    """The triangles [T, 3], the vertices [N] that theirs are copies of, the piece [T] that each is
    in, and whether the surface is cut along the seams of its UVs: only where it cannot be flattened
    whole."""
    try:
        loops(surface.faces)
    except Refused as reason:
        if surface.uvs is None:
            raise Refused(f"{reason}, and no seams are given") from None
        return *cut(surface.faces, joins(surface.faces, surface.uvs)), True
    whole = np.zeros(len(surface.faces), np.int64)
    return surface.faces, np.arange(len(surface.vertices)), whole, False
