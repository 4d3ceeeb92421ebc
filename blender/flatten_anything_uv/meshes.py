# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in edit mode: what is read of them, and the UVs and seams that are written back."""

from dataclasses import dataclass

import bmesh
import numpy as np


@dataclass
class Chosen:
    """Faces of one mesh that are to be unwrapped, as the triangles that Blender makes of them."""

    mesh: object
    vertices: np.ndarray
    """Positions `[N, 3]` in world units, so that objects keep their sizes against each other."""
    used: list
    """The index of every vertex in the mesh."""
    faces: dict
    """For the index of every face the vertices of its corners, to tell whether it has changed."""
    triangles: np.ndarray
    """Triangles `[M, 3]` by the vertices above."""
    corners: list
    """For every triangle the index of its face, and which of its corners it has."""
    seams: np.ndarray
    """Marked edges `[K, 2]`."""
    spared: np.ndarray
    """Edges that are not to be cut: those inside of faces, and smooth ones if asked for."""


def chosen(objects, only_selected, spare_smooth):
    """Return the faces of every object; objects have meshes of their own."""
    found = (_of_mesh(one, only_selected, spare_smooth) for one in objects)
    return [part for part in found if part is not None]


def _of_mesh(one, only_selected, spare_smooth):
    edit = bmesh.from_edit_mesh(one.data)
    edit.verts.index_update()
    edit.faces.index_update()
    edit.verts.ensure_lookup_table()
    faces = [f for f in edit.faces if not f.hide and (f.select or not only_selected)]
    if not faces:
        return None
    used = sorted({v.index for f in faces for v in f.verts})
    number = {v: k for k, v in enumerate(used)}
    is_chosen = {f.index for f in faces}
    loops = [t for t in edit.calc_loop_triangles() if t[0].face.index in is_chosen]
    place = {loop: k for f in faces for k, loop in enumerate(f.loops)}
    triangles = [[number[loop.vert.index] for loop in t] for t in loops]
    edges = {e for f in faces for e in f.edges}
    ends = {e: tuple(sorted(number[v.index] for v in e.verts)) for e in edges}
    outer = set(ends.values())
    sides = {tuple(sorted(p)) for t in triangles for p in zip(t, [*t[1:], t[0]], strict=True)}
    smooth = [ends[e] for e in edges if e.smooth and not e.seam] if spare_smooth else []
    return Chosen(
        mesh=one.data,
        vertices=_placed(np.array([edit.verts[v].co for v in used], dtype=float), one),
        used=used,
        faces={f.index: [v.index for v in f.verts] for f in faces},
        triangles=np.array(triangles, dtype=np.uint32),
        corners=[(t[0].face.index, [place[loop] for loop in t]) for t in loops],
        seams=_pairs(ends[e] for e in edges if e.seam),
        spared=_pairs([*(sides - outer), *smooth]),
    )


def _placed(own, one):
    """Return positions in world units; in the object's own where its scale leaves no volume."""
    world = np.array(one.matrix_world, dtype=float)
    if np.linalg.matrix_rank(world[:3, :3]) < 3:
        return own
    return own @ world[:3, :3].T + world[:3, 3]


def _pairs(of):
    return np.array(sorted(of), dtype=np.uint32).reshape(-1, 2)


def is_unchanged(part):
    """Return whether the chosen faces are in edit mode as they were."""
    try:
        if not part.mesh.is_editmode:
            return False
        edit = bmesh.from_edit_mesh(part.mesh)
    except (ReferenceError, ValueError):
        # The mesh is gone, or no longer edited.
        return False
    edit.verts.index_update()
    edit.faces.ensure_lookup_table()
    return all(
        number < len(edit.faces) and [v.index for v in edit.faces[number].verts] == vertices
        for number, vertices in part.faces.items()
    )


def write(part, triangle_uvs, seams):
    """Write the UVs `[M, 3, 2]` of the triangles; return how many faces a seam crosses.

    Blender has one UV for a corner: where triangles of a face disagree, that of the first counts.
    `seams` are pairs of vertices of the part whose edges are to be marked, or None to leave marks
    as they are. Marks inside of the part that are no seams go.
    """
    edit = bmesh.from_edit_mesh(part.mesh)
    edit.faces.ensure_lookup_table()
    layer = edit.loops.layers.uv.active or edit.loops.layers.uv.new("UVMap")
    found, crossed = {}, set()
    for (face, corners), uvs in zip(part.corners, triangle_uvs.tolist(), strict=True):
        for corner, uv in zip(corners, uvs, strict=True):
            if found.setdefault((face, corner), uv) != uv:
                crossed.add(face)
    for face in part.faces:
        for corner, loop in enumerate(edit.faces[face].loops):
            loop[layer].uv = found[face, corner]
    if seams is not None:
        wanted = {(part.used[a], part.used[b]) for a, b in np.sort(seams, axis=1)}
        for edge in {edge for face in part.faces for edge in edit.faces[face].edges}:
            ends = tuple(sorted(v.index for v in edge.verts))
            is_inside = all(face.index in part.faces for face in edge.link_faces)
            # The border of the part is cut from the rest of the mesh.
            edge.seam = ends in wanted or not is_inside
    bmesh.update_edit_mesh(part.mesh, loop_triangles=False, destructive=False)
    return len(crossed)
