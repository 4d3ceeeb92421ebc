"""Trained maps: UVs for any point."""

from __future__ import annotations

import os
from typing import Unpack

import numpy as np
import numpy.typing as npt

from . import _arrays, _native
from ._arrays import FacesLike, Indices, Singles
from ._errors import InputError
from ._job import Observer, wait
from ._options import TrainingOptions, complete


class Map:
    """A trained map from space to the plane. It can be pickled."""

    def __init__(self, native: _native.Map) -> None:
        self._native = native

    def uvs(self, points: npt.ArrayLike) -> Singles:
        """Return the UVs `[N, 2]` of points `[N, 3]` in the units of the surface."""
        found: Singles = wait(self._native.uvs(_arrays.points(points, "points")), None)
        return found

    def jacobian(self, points: npt.ArrayLike) -> Singles:
        """Return the derivatives `[N, 2, 3]` of the UVs by the coordinates of points `[N, 3]`.

        They are in UV units per unit of the surface.
        """
        found: Singles = wait(self._native.jacobian(_arrays.points(points, "points")), None)
        return found

    def seams(self, points: npt.ArrayLike) -> Indices:
        """Return the indices of those among evenly spread points `[N, 3]` where the map is torn."""
        found: Indices = wait(self._native.seams(_arrays.points(points, "points")), None)
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the map, as the program `fam` writes `model.safetensors`."""
        self._native.save(os.fspath(path))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Map:
        """Return the map in a file that `save` or the program `fam` wrote."""
        return Map(_native.load(os.fspath(path)))

    def __reduce__(self) -> tuple[object, tuple[bytes]]:
        return _of_bytes, (self._native.to_bytes(),)

    def __repr__(self) -> str:
        return "<flatten_anything.Map>"


def _of_bytes(content: bytes) -> Map:
    return Map(_native.Map.from_bytes(content))


def train(
    vertices: npt.ArrayLike,
    faces: FacesLike | None = None,
    *,
    normals: npt.ArrayLike | None = None,
    progress: Observer | None = None,
    **options: Unpack[TrainingOptions],
) -> Map:
    """Train the networks of Flatten Anything on a mesh, or on a cloud if there are no faces.

    The map is raw: it may fold and overlap itself. `unwrap(..., method="neural")` makes a layout of
    it. `normals` `[N, 3]` are those of a cloud.
    """
    positions = _arrays.points(vertices, "vertices")
    settings = complete(options)
    if faces is None:
        directions = None if normals is None else _normals(normals, len(positions))
        job = _native.train(positions, None, None, directions, settings)
    else:
        if normals is not None:
            raise InputError("normals are those of a cloud: a mesh has its own")
        given = _arrays.faces(faces, len(positions))
        job = _native.train(positions, given.corners, given.sizes, None, settings)
    return Map(wait(job, progress))


def _normals(of: npt.ArrayLike, points: int) -> npt.NDArray[np.float64]:
    array = _arrays.numbers(of, "normals")
    if array.shape != (points, 3):
        found = list(array.shape)
        raise InputError(f"normals must have the shape [{points}, 3], not {found}")
    return np.where(np.isfinite(array).all(axis=1, keepdims=True), array, 0.0)
