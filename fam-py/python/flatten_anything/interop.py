"""Meshes of trimesh, to layouts and back."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np

from ._job import Observer
from ._layout import Layout
from ._options import Options
from ._unwrap import unwrap


def from_trimesh(
    mesh: Any, *, progress: Observer | None = None, **options: Unpack[Options]
) -> Layout:
    """Return a layout of a `trimesh.Trimesh`."""
    return unwrap(mesh.vertices, mesh.faces, progress=progress, **options)


def to_trimesh(mesh: Any, layout: Layout) -> Any:
    """Return a `trimesh.Trimesh` with the UVs of its layout.

    Normals and attributes of vertices and a material stay; colours, attributes of faces and
    metadata do not.
    """
    import trimesh

    material = getattr(mesh.visual, "material", None)
    visuals: Any = trimesh.visual.TextureVisuals
    visual = visuals(uv=layout.vertex_uvs, material=material)
    return trimesh.Trimesh(
        vertices=np.asarray(mesh.vertices)[layout.vertex_map],
        faces=layout.faces,
        vertex_normals=np.asarray(mesh.vertex_normals)[layout.vertex_map],
        vertex_attributes={
            name: np.asarray(values)[layout.vertex_map]
            for name, values in mesh.vertex_attributes.items()
        },
        visual=visual,
        process=False,
    )
