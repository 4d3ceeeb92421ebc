"""Files: OBJ, glTF, PLY, OFF, STL and XYZ."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _arrays, _native
from ._arrays import Floats, Indices, Singles
from ._errors import InputError

if TYPE_CHECKING:
    from ._layout import Layout, PointLayout


class File:
    """A surface with the file it came from, which is written back with nothing lost."""

    def __init__(self, native: _native.File) -> None:
        self._native = native
        self.vertices: Floats = native.positions
        """Positions `[N, 3]`."""
        self.faces: Indices | None = native.triangles
        """Triangles `[M, 3]`, of polygons several each; none of a cloud."""
        self.normals: Floats | None = native.normals
        """Normals `[N, 3]` of the vertices, if the file has any."""
        self.objects: Indices | None = native.objects
        """The object of every triangle `[M]`; none if there is one object."""
        self.materials: npt.NDArray[np.int64] | None = native.materials
        """The material of every triangle `[M]`, −1 for none; none if there are no materials."""
        self.material_names: list[str] = native.material_names
        """The names of the materials."""
        self.companions: list[Path] = native.companions
        """The files beside it that it refers to: buffers, materials, images."""
        self.warnings: list[str] = native.warnings
        """What the user should know about the file, in sentences."""

    @property
    def uvs(self) -> Singles | None:
        """The UVs in the file: of corners `[M, 3, 2]`, or of the points of a cloud `[N, 2]`."""
        found = self._native.uvs
        return found.reshape(-1, 3, 2) if found is not None and self.faces is not None else found

    def write(
        self,
        path: str | os.PathLike[str],
        uvs: Layout | PointLayout | npt.ArrayLike,
        *,
        uv_set: int = 0,
    ) -> None:
        """Write the surface with other UVs: in its own format, or in the one that `path` names.

        Arguments:
        - `uvs`: a layout, UVs of the triangles' corners `[M, 3, 2]`, or of points `[N, 2]`.
        - `uv_set`: of glTF, the set that takes the UVs; other sets are kept.

        """
        # The annotation of arrays has types without attributes.
        given: Any = uvs
        native = getattr(given, "_native", None)
        if isinstance(native, _native.IndexedUvs):
            is_even = isinstance(given.faces, np.ndarray) and self.faces is not None
            own: Any = self.faces
            if not is_even or not np.array_equal(given.vertex_map[given.faces], own):
                raise InputError("the layout is that of another mesh")
            self._native.write_layout(os.fspath(path), native, uv_set)
            return
        array = _arrays.numbers(getattr(given, "uvs", given), "uvs")
        if self.faces is None:
            expected: tuple[int, ...] = (len(self.vertices), 2)
        else:
            expected = (len(self.faces), 3, 2)
        if array.shape != expected:
            raise InputError(f"uvs must have the shape {list(expected)}, not {list(array.shape)}")
        flat = np.ascontiguousarray(array.reshape(-1, 2), dtype=np.float32)
        self._native.write(os.fspath(path), flat, uv_set)

    def __repr__(self) -> str:
        of_faces = "" if self.faces is None else f", {len(self.faces)} triangles"
        return f"<flatten_anything.File: {len(self.vertices)} vertices{of_faces}>"


def read(path: str | os.PathLike[str]) -> File:
    """Read a mesh or a point cloud. Raises `FileError`."""
    return File(_native.read(os.fspath(path)))


def write(
    path: str | os.PathLike[str],
    file: File,
    uvs: Layout | PointLayout | npt.ArrayLike,
    *,
    uv_set: int = 0,
) -> None:
    """Write a file that was read with other UVs; see `File.write`."""
    file.write(path, uvs, uv_set=uv_set)
