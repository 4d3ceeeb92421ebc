# SPDX-License-Identifier: GPL-3.0-or-later
"""New charts, and those of other faces packed with them."""

import numpy as np

#: A chart whose triangles are narrower than this against their length is a line, without an area.
LINE = 1e-4


def unwrapped(parts, vertices, triangles, *, margin, resolution, **options):
    """Unwrap triangles, and pack their charts with those of the other triangles of the parts.

    Charts that are upright are not turned when they are packed, and straight ones by right angles.
    Returns the layout, the UVs `[M, 3, 2]` of the triangles and `[O, 3, 2]` of the others, and
    warnings.
    """
    import flatten_anything

    layout = flatten_anything.unwrap(
        vertices, triangles, margin=margin, resolution=resolution, **options
    )
    warnings = list(layout.warnings)
    other_uvs = np.concatenate([part.other_uvs for part in parts])
    if not len(other_uvs):
        return layout, layout.uvs, other_uvs, warnings
    uvs, free = packed(
        np.concatenate([vertices[triangles], *(part.other_positions for part in parts)]),
        np.concatenate([layout.uvs, other_uvs]),
        # The new charts count as one: they keep their sizes against each other.
        np.concatenate([np.zeros(len(triangles), dtype=int), 1 + charts_of_others(parts)]),
        margin,
        resolution,
        _turns(options),
    )
    if free < margin:
        warnings.append(f"with other charts the margin is {free:.2f} pixels instead of {margin:g}")
    return layout, uvs[: len(triangles)], uvs[len(triangles) :], warnings


def _turns(options):
    if options.get("upright"):
        return "none"
    return "quarters" if options.get("straighten") else "free"


def packed(positions, uvs, charts, margin, resolution, turns):
    """Pack charts into one square, all with as many texels for an area.

    Takes positions `[M, 3, 3]` and UVs `[M, 3, 2]` of the corners of triangles, and the chart of
    each `[M]`. Returns the UVs, and the texels that are free between charts. Charts without an area
    stay as they are.
    """
    import flatten_anything

    areas, uv_areas = (np.bincount(charts, _areas(of)) for of in (positions, uvs))
    squares = np.bincount(charts, np.square(_sides(uvs)).sum(axis=(1, 2)))
    has_area = ((areas > 0) & (uv_areas > LINE * squares))[charts]
    own = charts[has_area]
    apart = uvs[has_area] * np.sqrt(areas[own] / uv_areas[own])[:, None, None]
    # Charts may lie upon each other, edge upon edge: each gets a cell of its own.
    _, cells, counts = np.unique(own, return_inverse=True, return_counts=True)
    sums = np.column_stack([np.bincount(cells, axis) for axis in apart.mean(axis=1).T])
    apart -= (sums / counts[:, None])[cells, None]
    places = np.column_stack(np.divmod(cells, np.ceil(np.sqrt(len(counts)))))
    apart += 3 * np.abs(apart).max() * places[:, None]
    found = flatten_anything.pack(apart, margin=margin, resolution=resolution, turns=turns)
    placed = uvs.copy()
    placed[has_area] = found.uvs
    return placed, found.margin


def _sides(corners):
    return np.roll(corners, -1, axis=1) - corners


def _areas(corners):
    a, b = np.moveaxis(_sides(corners.astype(float))[:, :2], 1, 0)
    squared = (a * a).sum(axis=1) * (b * b).sum(axis=1) - (a * b).sum(axis=1) ** 2
    return np.sqrt(np.maximum(squared, 0)) / 2


def charts_of_others(parts):
    """Return a number for each of the other triangles: the same for those of one chart.

    Triangles are in one chart if an edge of the mesh is at the same place in both.
    """
    objects = np.repeat(np.arange(len(parts)), [3 * len(part.others) for part in parts])
    vertices = np.concatenate([part.corners[part.others, 1].reshape(-1) for part in parts])
    uvs = np.concatenate([part.other_uvs.reshape(-1, 2) for part in parts])
    corners = _numbers(objects, vertices, *uvs.T).reshape(-1, 3)
    edges = _numbers(*np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).T)
    order = np.argsort(edges)
    is_same = edges[order][1:] == edges[order][:-1]
    triangles = order // 3
    return _connected(len(corners), triangles[:-1][is_same], triangles[1:][is_same])


def _numbers(*columns):
    """Return a number for each row; equal rows have the same."""
    found = 0
    for column in columns:
        _, own = np.unique(column, return_inverse=True)
        _, found = np.unique(found * (own.max() + 1) + own, return_inverse=True)
    return found


def _connected(count, starts, ends):
    """Return for each thing the least one that it is connected to."""
    least = np.arange(count)
    while True:
        low, high = np.sort([least[starts], least[ends]], axis=0)
        if (low == high).all():
            return least
        np.minimum.at(least, high, low)
        while (least[least] != least).any():
            least = least[least]
