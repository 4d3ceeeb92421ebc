# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in edit mode: what is read of them, and the UVs and seams that are written back."""

from dataclasses import dataclass

import bmesh
import numpy as np


@dataclass
class Chosen:
    """Faces of one mesh that are to be unwrapped."""

    mesh: object
    vertices: np.ndarray
    """Positions `[N, 3]` in world units, so that objects keep their sizes against each other."""
    faces: list
    """Faces by their vertices."""
    numbers: list
    """The index of every face in the mesh."""
    seams: np.ndarray
    """Marked edges `[K, 2]` by their vertices."""
    smooth: np.ndarray
    """Edges that are not to be cut: neither sharp nor marked."""


def chosen(objects, only_selected, spare_smooth):
    """Return the faces of every mesh, each mesh once, however many objects share it."""
    found = []
    seen = set()
    for of_mesh in objects:
        mesh = of_mesh.data
        if mesh in seen:
            continue
        seen.add(mesh)
        edit = bmesh.from_edit_mesh(mesh)
        edit.verts.index_update()
        edit.faces.index_update()
        faces = [f for f in edit.faces if not f.hide and (f.select or not only_selected)]
        if not faces:
            continue
        used = sorted({v.index for f in faces for v in f.verts})
        number = {v: k for k, v in enumerate(used)}
        edit.verts.ensure_lookup_table()
        world = np.array(of_mesh.matrix_world, dtype=float)
        own = np.array([edit.verts[v].co for v in used], dtype=float)
        edges = {e for f in faces for e in f.edges}

        def pairs(of, number=number):
            rows = sorted(sorted(number[v.index] for v in e.verts) for e in of)
            return np.array(rows, dtype=np.uint32).reshape(-1, 2)

        smooth = [e for e in edges if e.smooth and not e.seam] if spare_smooth else []
        found.append(
            Chosen(
                mesh=mesh,
                vertices=own @ world[:3, :3].T + world[:3, 3],
                faces=[[number[v.index] for v in f.verts] for f in faces],
                numbers=[f.index for f in faces],
                seams=pairs(e for e in edges if e.seam),
                smooth=pairs(smooth),
            )
        )
    return found


def write(part, corner_uvs, seams):
    """Write the UVs of the corners of the chosen faces, and mark `seams` if there are any.

    `seams` are pairs of vertices of the part, or None to leave marks as they are.
    """
    import bpy

    edit = bmesh.from_edit_mesh(part.mesh)
    edit.faces.ensure_lookup_table()
    layer = edit.loops.layers.uv.verify()
    at = 0
    for number in part.numbers:
        for loop in edit.faces[number].loops:
            loop[layer].uv = corner_uvs[at]
            at += 1
    if seams is not None:
        used = sorted({v.index for n in part.numbers for v in edit.faces[n].verts})
        wanted = {(used[a], used[b]) for a, b in np.sort(seams, axis=1)}
        for number in part.numbers:
            for edge in edit.faces[number].edges:
                ends = tuple(sorted(v.index for v in edge.verts))
                edge.seam = ends in wanted
    bmesh.update_edit_mesh(part.mesh, loop_triangles=False, destructive=False)
    bpy.context.view_layer.update()
