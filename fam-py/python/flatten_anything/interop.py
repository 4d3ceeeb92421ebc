"""Meshes of trimesh, to layouts and back."""

from __future__ import annotations

import copy
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from ._errors import InputError
from ._job import Observer
from ._layout import Layout
from ._options import Options
from ._unwrap import unwrap


def from_trimesh(
    mesh: Any,
    *,
    seams: npt.ArrayLike | None = None,
    no_seams: npt.ArrayLike | None = None,
    paint: npt.ArrayLike | None = None,
    objects: npt.ArrayLike | None = None,
    materials: npt.ArrayLike | bool | None = None,
    per_object: bool = False,
    weight: npt.ArrayLike | None = None,
    keep_seams: bool = False,
    improve: bool = False,
    selected: npt.ArrayLike | None = None,
    progress: Observer | None = None,
    **options: Unpack[Options],
) -> Layout:
    """Return a layout of a `trimesh.Trimesh`.

    Arguments are those of `unwrap`. With `materials` true, each material of the mesh has a UV
    square of its own, as `visual.face_materials` says. With `keep_seams`, `improve` and `selected`,
    the UVs that are kept are those of `visual.uv`.

    A `trimesh.Scene` has several meshes, which share a square like this:

    >>> meshes = scene.geometry  # doctest: +SKIP
    >>> layouts = unwrap_meshes([(m.vertices, m.faces) for m in meshes.values()])  # doctest: +SKIP
    >>> for name, layout in zip(list(meshes), layouts):  # doctest: +SKIP
    ...     meshes[name] = to_trimesh(meshes[name], layout)

    Raises `InputError` for what is no mesh, and for arrays and options that make no sense.

    """
    if not hasattr(mesh, "faces"):
        raise InputError(f"from_trimesh takes a Trimesh, not a {type(mesh).__name__}")
    if isinstance(materials, bool):
        materials = getattr(mesh.visual, "face_materials", None) if materials else None
    uvs = None
    if keep_seams or improve or selected is not None:
        of_vertices = getattr(mesh.visual, "uv", None)
        if of_vertices is None:
            raise InputError("the mesh has no UVs of which some could be kept")
        uvs = np.asarray(of_vertices)[mesh.faces]
    return unwrap(
        mesh.vertices,
        mesh.faces,
        seams=seams,
        no_seams=no_seams,
        paint=paint,
        objects=objects,
        materials=materials,
        per_object=per_object,
        weight=weight,
        uvs=uvs,
        keep_seams=keep_seams,
        improve=improve,
        selected=selected,
        progress=progress,
        **options,
    )


def to_trimesh(mesh: Any, layout: Layout) -> Any:
    """Return a `trimesh.Trimesh` with the UVs of its layout.

    All else stays: normals, attributes of vertices and faces, materials and metadata. Colours go
    where trimesh keeps them beside UVs: those of vertices to `visual.vertex_attributes["color"]`,
    which GLB files keep and OBJ files do not; those of faces to `face_attributes["color"]`.
    """
    import trimesh

    visuals: Any = trimesh.visual
    of_vertices, of_faces = layout.vertex_map, layout.face_map
    old = mesh.visual
    face_attributes: dict[str, Any] = {
        name: np.asarray(values)[of_faces] for name, values in mesh.face_attributes.items()
    }
    material = getattr(old, "material", None)
    colors = None
    if old.kind == "vertex":
        colors = old.vertex_colors
        # White, as viewers multiply colours by the material; that of trimesh is dark grey.
        material = visuals.material.SimpleMaterial(diffuse=[255, 255, 255, 255])
    elif old.kind == "face":
        face_attributes["color"] = np.asarray(old.face_colors)[of_faces]
    elif old.kind == "texture":
        colors = old.vertex_attributes.get("color")
    materials = getattr(old, "face_materials", None)
    visual = visuals.TextureVisuals(
        uv=layout.vertex_uvs,
        material=material,
        face_materials=None if materials is None else np.asarray(materials)[of_faces],
    )
    if colors is not None:
        visual.vertex_attributes["color"] = np.asarray(colors)[of_vertices]
    return trimesh.Trimesh(
        vertices=np.asarray(mesh.vertices)[of_vertices],
        faces=layout.faces,
        vertex_normals=np.asarray(mesh.vertex_normals)[of_vertices],
        vertex_attributes={
            name: np.asarray(values)[of_vertices] for name, values in mesh.vertex_attributes.items()
        },
        face_attributes=face_attributes,
        metadata=copy.deepcopy(mesh.metadata),
        visual=visual,
        process=False,
    )
