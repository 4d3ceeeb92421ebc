"""Unwrapping meshes and point clouds."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from . import _arrays, _native
from ._arrays import FacesLike
from ._errors import InputError
from ._files import File
from ._job import Observer, wait
from ._layout import Layout, PointLayout, layout_of, point_layout_of
from ._maps import _normals
from ._options import Options, by_name, complete


def unwrap(
    vertices: npt.ArrayLike | File,
    faces: FacesLike | None = None,
    *,
    seams: npt.ArrayLike | None = None,
    no_seams: npt.ArrayLike | None = None,
    paint: npt.ArrayLike | None = None,
    objects: npt.ArrayLike | None = None,
    materials: npt.ArrayLike | bool | None = None,
    per_object: bool = False,
    weight: npt.ArrayLike | Mapping[str, float] | None = None,
    uvs: npt.ArrayLike | Sequence[npt.ArrayLike] | None = None,
    keep_seams: bool = False,
    improve: bool = False,
    only: str | Sequence[str] = (),
    selected: npt.ArrayLike | None = None,
    progress: Observer | None = None,
    **options: Unpack[Options],
) -> Layout:
    """Return a UV layout of a mesh: few charts, no flipped triangles, no overlaps, packed.

    Arguments:
    - `vertices`: positions `[N, 3]`, or a file that `read` returned, which has everything.
    - `faces`: `[M, K]` with K ≥ 3, or a sequence of faces of any number of corners.
    - `seams`: edges `[K, 2]` by their vertices, along which the mesh is cut.
    - `no_seams`: edges along which it is cut only where there is no other way.
    - `paint`: a number for each vertex, from 0, where seams are welcome, to 1, where they are
      avoided as far as `paint_weight` says. Of a file, the name of an attribute of its vertices: a
      property of PLY, an attribute of glTF such as `COLOR_0`, or `color` of OBJ.
    - `objects`: an integer for each face; faces of different objects are in different charts.
    - `materials`: an integer for each face; each material has a UV square of its own. Of a file,
      True takes its materials.
    - `per_object`: whether each object has a UV square of its own instead.
    - `weight`: how many times as many texels along every length a face has as others: a number for
      each face, from 0.001 to 1000. Faces of different numbers are in different charts. Of a file,
      numbers by the names of materials and objects, `{"face": 2}`; others have 1, and a face of
      several has the last.
    - `progress`: is called about ten times a second; what it raises cancels.
    - `options`: those of `Options`.

    Some of the UVs that the mesh already has can be kept, by the direct method:
    - `uvs`: these, of the corners of every face: `[M, K, 2]`, or a sequence of `[K, 2]` where not
      all have K corners. A file has its own.
    - `keep_seams`: their seams stay, and there are no others unless there is no other way. The
      charts are flattened anew.
    - `improve`: charts stay as they are that are within `distortion_bound`, and have neither
      flipped triangles nor overlaps. The others are flattened anew along the same seams, and
      placed beside them.
    - `selected`: True or False for each face. Faces with False keep their UVs; the others are cut,
      flattened and placed beside them. Of a file, the name of an attribute: faces are selected of
      whose vertices all have more than 0.5 of it.
    - `only`: of a file, materials and objects by name, which are selected, too.

    Raises `InputError` for arrays and options that make no sense.

    """
    settings = complete(options)
    others = (seams, no_seams, selected)
    if improve and (keep_seams or only or any(one is not None for one in others)):
        raise InputError("improve goes without seams, no_seams, keep_seams, selected and only")
    if per_object and materials is not None and materials is not False:
        raise InputError("materials or objects have squares of their own, not both")
    if isinstance(vertices, File):
        positions = vertices.vertices
    else:
        positions = _arrays.points(vertices, "vertices")
    asked: _native.Asked = {
        "seams": _arrays.edges(seams, len(positions), "seams"),
        "no_seams": _arrays.edges(no_seams, len(positions), "no_seams"),
        "keep_seams": bool(keep_seams),
        "improve": bool(improve),
    }
    names = [only] if isinstance(only, str) else list(only)
    if isinstance(vertices, File):
        is_own = faces is None and objects is None and uvs is None
        if not is_own or not isinstance(materials, bool | None):
            raise InputError(
                "a file has its own faces, objects and uvs; materials is True or False"
            )
        job = _native.unwrap_file(
            vertices._native,
            materials is True,
            bool(per_object),
            by_name("weight", weight),
            names,
            _attribute(selected, "selected"),
            _attribute(paint, "paint"),
            asked,
            settings,
        )
        return layout_of(wait(job, progress), 3)
    if faces is None:
        raise InputError("a mesh has faces; a cloud of points takes unwrap_points")
    if names:
        raise InputError("only is for files, which have names; selected is for arrays")
    if isinstance(weight, Mapping):
        raise InputError("weight has names for files only; of arrays it is a number for each face")
    if per_object and objects is None:
        raise InputError("per_object needs objects")
    given = _arrays.faces(faces, len(positions))
    if (uvs is not None) != (keep_seams or improve or selected is not None):
        raise InputError("keep_seams, improve and selected need uvs, and nothing else does")
    chosen = None if selected is None else _arrays.flags(selected, len(given), "selected")
    if chosen is not None and not any(chosen):
        raise InputError("no face is selected")
    job = _native.unwrap(
        positions,
        given.corners,
        given.sizes,
        _arrays.per_face(objects, len(given), "objects"),
        _arrays.per_face(materials, len(given), "materials"),
        bool(per_object),
        None if weight is None else _arrays.per_each(weight, len(given), "weight", "faces"),
        None if uvs is None else _arrays.face_uvs(uvs, given, "uvs"),
        chosen,
        None if paint is None else _arrays.per_each(paint, len(positions), "paint", "vertices"),
        asked,
        settings,
    )
    return layout_of(wait(job, progress), given.width)


def _attribute(name: npt.ArrayLike | None, option: str) -> str | None:
    """Return the name of an attribute of a file."""
    if name is None or isinstance(name, str):
        return name
    raise InputError(f"{option} is the name of an attribute of the file")


def unwrap_meshes(
    meshes: Sequence[tuple[npt.ArrayLike, FacesLike]],
    *,
    progress: Observer | None = None,
    **options: Unpack[Options],
) -> list[Layout]:
    """Return UV layouts of several meshes that share one UV square, all at one scale.

    Each mesh is `(vertices, faces)`. The metrics, the report and the warnings are those of all of
    them together.
    """
    positions, corners, sizes, objects, widths = [], [], [], [], []
    first = 0
    for number, (vertices, faces) in enumerate(meshes):
        own = _arrays.points(vertices, f"vertices of mesh {number}")
        given = _arrays.faces(faces, len(own), f"faces of mesh {number}")
        positions.append(own)
        corners.append(given.corners + np.uint32(first))
        sizes.append(
            np.full(len(given), 3, dtype=np.uint32) if given.sizes is None else given.sizes
        )
        objects.extend([number] * len(given))
        widths.append(given.width)
        first += len(own)
    settings = complete(options)
    if not positions:
        return []
    none = np.empty((0, 2), dtype=np.uint32)
    job = _native.unwrap(
        np.concatenate(positions),
        np.concatenate(corners),
        np.concatenate(sizes),
        objects,
        None,
        False,
        None,
        None,
        None,
        None,
        {"seams": none, "no_seams": none, "keep_seams": False, "improve": False},
        settings,
    )
    found = wait(job, progress)
    counts = [(len(own), len(of_faces)) for own, of_faces in zip(positions, sizes, strict=True)]
    report = json.loads(found["report"])
    return [
        layout_of(part, width, report)
        for part, width in zip(_parts(found, counts), widths, strict=True)
    ]


def _parts(found: dict[str, Any], counts: list[tuple[int, int]]) -> list[dict[str, Any]]:
    """Return what was found of all meshes for each of them."""
    firsts = np.cumsum([(0, 0), *counts], axis=0)
    vertex_order, vertex_ends = _by_mesh(found["vertex_map"], firsts[:, 0])
    seam_order, seam_ends = _by_mesh(found["seams"][:, 0], firsts[:, 0])
    face_ends = np.searchsorted(found["source"], firsts[:, 1])
    corner_ends = np.concatenate([[0], np.cumsum(found["sizes"], dtype=np.int64)])[face_ends]
    # Where each vertex stands when they are mesh by mesh.
    places = np.empty(len(vertex_order), dtype=np.uint32)
    places[vertex_order] = np.arange(len(vertex_order), dtype=np.uint32)
    parts = []
    for mesh, (first_vertex, first_face) in enumerate(firsts[:-1].astype(np.uint32)):
        vertices = vertex_order[vertex_ends[mesh] : vertex_ends[mesh + 1]]
        seams = seam_order[seam_ends[mesh] : seam_ends[mesh + 1]]
        faces = slice(*face_ends[mesh : mesh + 2])
        corners = found["corners"][slice(*corner_ends[mesh : mesh + 2])]
        charts = found["charts"][faces]
        parts.append(
            {
                **found,
                "vertex_map": found["vertex_map"][vertices] - first_vertex,
                "vertex_uvs": found["vertex_uvs"][vertices],
                "source": found["source"][faces] - first_face,
                "sizes": found["sizes"][faces],
                "corners": places[corners] - np.uint32(vertex_ends[mesh]),
                "charts": charts - charts.min(),
                "seams": found["seams"][seams] - first_vertex,
                "indexed": None,
            }
        )
    return parts


def _by_mesh(
    vertices: _arrays.Indices, firsts: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the order in which vertices are mesh by mesh, and where the meshes begin and end."""
    meshes = np.searchsorted(firsts, vertices, side="right") - 1
    order = np.argsort(meshes, kind="stable")
    return order, np.searchsorted(meshes[order], np.arange(len(firsts)))


def unwrap_points(
    points: npt.ArrayLike,
    normals: npt.ArrayLike | None = None,
    *,
    progress: Observer | None = None,
    **options: Unpack[Options],
) -> PointLayout:
    """Return a UV layout of a point cloud `[N, 3]`: one UV for each point.

    Networks are trained on the points; then the surface through them is cut and laid out as their
    map suggests. `normals` `[N, 3]` help where they are known.
    """
    positions = _arrays.points(points, "points")
    directions = None if normals is None else _normals(normals, len(positions))
    job = _native.unwrap_points(positions, directions, complete(options))
    return point_layout_of(wait(job, progress))
