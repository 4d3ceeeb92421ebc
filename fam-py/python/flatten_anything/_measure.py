"""Judging and packing UVs that are there."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy.typing as npt

from . import _arrays, _native
from ._arrays import Singles
from ._errors import InputError
from ._job import wait
from ._options import number, whole


def measure(vertices: npt.ArrayLike, faces: npt.ArrayLike, uvs: npt.ArrayLike) -> dict[str, Any]:
    """Return the quality of the UVs of a mesh.

    Arguments: positions `[N, 3]`, triangles `[M, 3]`, and UVs of their corners `[M, 3, 2]`. The
    result has `charts`, `seam_length` (over the square root of the area), `symmetric_dirichlet`
    (4 is an isometry), `conformality` (mean error of an angle, in radians), `area_distortion`,
    `flipped_triangles`, `overlapping_pairs`, `uv_coverage` and more.
    """
    positions = _arrays.points(vertices, "vertices")
    given = _arrays.faces(faces, len(positions))
    if given.width != 3:
        raise InputError("faces must be triangles")
    of_corners = _arrays.corner_uvs(uvs, len(given))
    job = _native.measure(positions, given.corners.reshape(-1, 3), of_corners)
    text = wait(job, None)
    found: dict[str, Any] = json.loads(text)
    return found


@dataclass(frozen=True, eq=False)
class Packed:
    """Charts side by side."""

    uvs: Singles
    """UVs of the corners `[M, 3, 2]`."""
    coverage: float
    """Share of the square that charts cover."""
    margin: float
    """Texels that are free between charts: less than asked for where there is no room."""


def pack(
    uvs: npt.ArrayLike,
    *,
    margin: float = 4.0,
    resolution: int = 2048,
    turns: Literal["free", "quarters", "none"] = "free",
) -> Packed:
    """Lay charts side by side in the unit square, each as large against others as it was.

    Arguments:
    - `uvs`: of the corners of triangles `[M, 3, 2]`. Those with an edge in common are one chart.
    - `margin`: texels between charts, of a square of `resolution` texels.
    - `turns`: how charts may be turned: by any angle, by right angles (`quarters`), or not at all.

    """
    of_corners = _arrays.corner_uvs(uvs, None)
    job = _native.pack(of_corners, number("margin", margin), whole("resolution", resolution), turns)
    placed, coverage, kept = wait(job, None)
    return Packed(placed.reshape(-1, 3, 2), coverage, kept)
