"""What unwrapping comes to."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Indices, Singles
from ._maps import Map


@dataclass(frozen=True, eq=False, repr=False)
class Layout:
    """The UV layout of a mesh.

    Vertices on a seam have several UVs, so they are there several times: vertex `i` of the layout
    is vertex `vertex_map[i]` of the input. The first are those of the input in their order, copies
    come after them; whatever the input has per vertex becomes `of_vertices[vertex_map]`. Faces
    are those of the input in their order. A polygon that a seam crosses becomes triangles;
    `face_map` tells which.
    """

    vertex_uvs: Singles
    """UVs `[N', 2]` of the vertices of the layout, from 0 to 1; (0, 0) for one of no face."""
    vertex_map: Indices
    """For every vertex of the layout `[N']` the vertex of the input."""
    faces: npt.NDArray[np.uint32] | list[npt.NDArray[np.uint32]]
    """Faces by the vertices of the layout: `[M, K]`, or a list where not all have K corners."""
    face_map: Indices
    """For every face of the layout `[M]` the face of the input."""
    charts: Indices
    """The chart of every face `[M]`, counting from 0; a face without area has one of its own."""
    squares: Indices | None
    """The UV square of every face `[M]`, if materials or objects have squares of their own."""
    seams: npt.NDArray[np.uint32]
    """Edges `[K, 2]` along which the mesh is cut, by the vertices of the input."""
    metrics: dict[str, Any]
    """Quality of the UVs: `charts`, `seam_length`, `symmetric_dirichlet`, `conformality`,
    `area_distortion`, `flipped_triangles`, `overlapping_pairs`, `uv_coverage` and more."""
    report: dict[str, Any]
    """All that the program `fam` writes to metrics.json."""
    warnings: list[str]
    """Where the layout falls short of what was asked for, in sentences."""
    map: Map | None
    """The trained map, of the neural method."""
    _corners: Indices = field(repr=False)
    _native: _native.IndexedUvs | None = field(repr=False)

    @property
    def uvs(self) -> Singles | list[Singles]:
        """UVs of the corners of every face `[M, K, 2]`; a list where not all have K corners."""
        if isinstance(self.faces, list):
            return [self.vertex_uvs[face] for face in self.faces]
        return self.vertex_uvs[self.faces]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_native": None}

    def __repr__(self) -> str:
        return f"<flatten_anything.Layout: {len(self.faces)} faces, {len(self.vertex_uvs)} UVs>"

    @property
    def corner_uvs(self) -> Singles:
        """UVs `[C, 2]` of all corners, face by face."""
        return self.vertex_uvs[self._corners]


@dataclass(frozen=True, eq=False, repr=False)
class PointLayout:
    """The UV layout of a point cloud."""

    uvs: Singles
    """UVs `[N, 2]` of the points, from 0 to 1."""
    seams: npt.NDArray[np.uint32]
    """Indices of the points at which it is cut."""
    report: dict[str, Any]
    """All that the program `fam` writes to metrics.json."""
    warnings: list[str]
    """Where the layout falls short of what was asked for, in sentences."""
    map: Map | None
    """The trained map."""

    def __repr__(self) -> str:
        return f"<flatten_anything.PointLayout: {len(self.uvs)} points>"


def layout_of(
    found: dict[str, Any], width: int | None, report: dict[str, Any] | None = None
) -> Layout:
    """Return a layout of what the native part found; `width` is that of all faces, if any.

    `report` is what it found as JSON, if that was read before.
    """
    corners, sizes = found["corners"], found["sizes"]
    is_even = width is not None and bool((sizes == width).all())
    if is_even:
        faces = corners.reshape(-1, width)
    else:
        faces = np.split(corners, np.cumsum(sizes)[:-1])
    if report is None:
        report = json.loads(found["report"])
    trained = found["map"]
    return Layout(
        vertex_uvs=found["vertex_uvs"],
        vertex_map=found["vertex_map"],
        faces=faces,
        face_map=found["source"],
        charts=found["charts"],
        squares=found["squares"],
        seams=found["seams"],
        metrics=report.get("mesh") or {},
        report=report,
        warnings=found["warnings"],
        map=None if trained is None else Map(trained),
        _corners=corners,
        _native=found["indexed"],
    )


def point_layout_of(found: dict[str, Any]) -> PointLayout:
    """Return a layout of what the native part found."""
    trained = found["map"]
    return PointLayout(
        uvs=found["uvs"],
        seams=found["seams"],
        report=json.loads(found["report"]),
        warnings=found["warnings"],
        map=None if trained is None else Map(trained),
    )
