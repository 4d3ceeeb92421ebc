"""Arrays of users, checked and made contiguous."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._errors import InputError

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]

#: Faces: an array `[M, K]` of vertices, or a sequence of faces of any number of corners.
FacesLike = npt.ArrayLike | Sequence[Sequence[int]]


class Faces(NamedTuple):
    """Faces as the native part takes them."""

    corners: Indices
    """The vertices of all corners, face by face."""
    sizes: Indices | None
    """How many corners every face has; none if all have three."""
    width: int | None
    """How many corners all faces have; none if not all have as many."""

    def __len__(self) -> int:
        """Return the number of faces."""
        return len(self.corners) // 3 if self.sizes is None else len(self.sizes)


def points(of: npt.ArrayLike, name: str) -> Floats:
    """Return coordinates `[N, 3]`, all finite."""
    array = numbers(of, name)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} must have the shape [N, 3], not {list(array.shape)}")
    if not np.isfinite(array).all():
        bad = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InputError(f"{name}[{bad}] has a coordinate that is not a finite number")
    return array


def numbers(of: npt.ArrayLike, name: str) -> Floats:
    """Return any array of numbers in double precision."""
    array = _array(of, name)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name} is no array of numbers, but of {array.dtype}")
    return np.require(array, np.float64, ["C", "A"])


def indices(of: npt.ArrayLike, name: str, below: int | None = None) -> Indices:
    """Return any array of integers from 0 on, and smaller than `below`."""
    array = _array(of, name)
    if array.size == 0:
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        raise InputError(f"{name} must be integers, not {array.dtype}")
    if array.size:
        low, high = int(array.min()), int(array.max())
        limit = 1 << 32 if below is None else below
        if low < 0:
            raise InputError(f"{name} has the index {low}, but they count from 0")
        if high >= limit:
            raise InputError(f"{name} has the index {high}, but there are only {limit}")
    return np.require(array, np.uint32, ["C", "A"])


def _array(of: Any, name: str) -> npt.NDArray[Any]:
    try:
        return np.asarray(of)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is no array: {error}") from None


def faces(of: FacesLike, vertices: int, name: str = "faces") -> Faces:
    """Return faces of three and more corners."""
    rows: Any = of
    if isinstance(rows, (list, tuple)):
        try:
            counts = np.fromiter(map(len, rows), dtype=np.uint32, count=len(rows))
        except TypeError:
            raise InputError(f"{name} must be a sequence of sequences of vertices") from None
        if len(counts) and counts.min() < 3:
            bad = int(np.flatnonzero(counts < 3)[0])
            raise InputError(f"{name}[{bad}] has fewer than three corners")
        if len(counts) and counts.min() < counts.max():
            flat = itertools.chain.from_iterable(rows)
            joined = indices(_array(list(flat), name), name, vertices)
            return Faces(joined, counts, None)
    array = indices(rows, name, vertices)
    if array.size == 0:
        raise InputError(f"{name} is empty")
    if array.ndim != 2 or array.shape[1] < 3:
        raise InputError(f"{name} must have the shape [M, 3], not {list(array.shape)}")
    count, width = array.shape
    sizes = None if width == 3 else np.full(count, width, dtype=np.uint32)
    return Faces(array.reshape(-1), sizes, width)


def edges(of: npt.ArrayLike | None, vertices: int, name: str) -> Indices:
    """Return pairs of vertices `[K, 2]`."""
    if of is None:
        return np.empty((0, 2), dtype=np.uint32)
    array = indices(of, name, vertices)
    if array.size == 0:
        return np.empty((0, 2), dtype=np.uint32)
    if array.ndim != 2 or array.shape[1] != 2:
        raise InputError(f"{name} must have the shape [K, 2], not {list(array.shape)}")
    return array


def per_face(of: npt.ArrayLike | None, count: int, name: str) -> list[int] | None:
    """Return a number for every face: any integers become 0, 1, 2… in ascending order."""
    if of is None:
        return None
    array = _array(of, name)
    if array.dtype.kind not in "iub" or array.shape != (count,):
        raise InputError(f"{name} must be one integer for each of the {count} faces")
    _, numbered = np.unique(array, return_inverse=True)
    found: list[int] = numbered.reshape(-1).tolist()
    return found


def flags(of: npt.ArrayLike, count: int, name: str) -> list[bool]:
    """Return True or False for every face."""
    array = _array(of, name)
    if array.dtype.kind != "b" or array.shape != (count,):
        raise InputError(f"{name} must be True or False for each of the {count} faces")
    found: list[bool] = array.tolist()
    return found


def per_each(of: npt.ArrayLike, count: int, name: str, things: str) -> Floats:
    """Return a finite number for every one of so many vertices or faces."""
    array = _array(of, name)
    array = numbers(array.astype(float) if array.dtype.kind == "b" else array, name)
    if array.shape != (count,):
        raise InputError(f"{name} must be one number for each of the {count} {things}")
    if not np.isfinite(array).all():
        bad = int(np.flatnonzero(~np.isfinite(array))[0])
        raise InputError(f"{name}[{bad}] is not a finite number")
    return array


def face_uvs(of: Any, faces: Faces, name: str = "uvs") -> Singles:
    """Return UVs `[C, 2]` of all corners, of those of faces: `[M, K, 2]`, or a list of `[K, 2]`."""
    if faces.width is None:
        if not isinstance(of, Sequence):
            raise InputError(f"{name} must be a sequence: UVs [K, 2] for each face")
        parts = [numbers(part, name) for part in of]
        sizes = [] if faces.sizes is None else faces.sizes.tolist()
        if [part.shape for part in parts] != [(size, 2) for size in sizes]:
            raise InputError(f"{name} must have UVs [K, 2] for each of the {len(faces)} faces")
        joined = np.concatenate(parts)
    else:
        array = numbers(of, name)
        expected = (len(faces), faces.width, 2)
        if array.shape != expected:
            raise InputError(
                f"{name} must have the shape {list(expected)}, not {list(array.shape)}"
            )
        joined = array.reshape(-1, 2)
    return np.require(joined, np.float32, ["C", "A"])


def corner_uvs(of: npt.ArrayLike, triangles: int | None, name: str = "uvs") -> Singles:
    """Return UVs of the corners of triangles `[M, 3, 2]` as `[3 M, 2]`."""
    array = numbers(of, name)
    count = "M" if triangles is None else triangles
    if array.ndim != 3 or array.shape[1:] != (3, 2) or count not in ("M", len(array)):
        raise InputError(f"{name} must have the shape [{count}, 3, 2], not {list(array.shape)}")
    return np.require(array.reshape(-1, 2), np.float32, ["C", "A"])
