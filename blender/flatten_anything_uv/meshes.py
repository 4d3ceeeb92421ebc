# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in edit mode: what is read of them, and the UVs and seams that are written back."""

from contextlib import contextmanager
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np


@dataclass
class Part:
    """One mesh, as the triangles that Blender makes of its faces."""

    mesh: object
    corners: np.ndarray
    """For every corner of a face `[C, 3]` the face, the vertex, and the edge to the next corner."""
    chosen: np.ndarray
    """The triangles to be unwrapped `[M, 3]`, by their corners."""
    vertices: np.ndarray
    """Positions `[N, 3]` of their vertices in world units, so that objects keep their sizes."""
    triangles: np.ndarray
    """The triangles to be unwrapped `[M, 3]`, by the vertices above."""
    edges: np.ndarray
    """The edges `[E]` of the faces to be unwrapped."""
    ends: np.ndarray
    """Their ends `[E, 2]`, by the vertices above."""
    is_border: np.ndarray
    """Which of them `[E]` have faces that are not to be unwrapped."""
    seams: np.ndarray
    """Marked edges `[K, 2]`."""
    spared: np.ndarray
    """Edges that are not to be cut: those inside of faces, and smooth ones if asked for."""
    others: np.ndarray
    """The triangles that are to be packed with them `[O, 3]`, by their corners."""
    other_positions: np.ndarray
    """Positions `[O, 3, 3]` of their corners in world units."""
    other_uvs: np.ndarray
    """UVs `[O, 3, 2]` of their corners."""


def parts(objects, only_selected, spare_smooth, with_others):
    """Return the faces of every object, none if there are none to unwrap.

    Objects have meshes of their own. `with_others` is whether the faces that are not unwrapped,
    hidden ones too, are to be packed with those that are.
    """
    read = (_of_mesh(one, only_selected, spare_smooth, with_others) for one in objects)
    found = [part for part in read if len(part.chosen) or len(part.others)]
    return found if any(len(part.chosen) for part in found) else []


def _of_mesh(one, only_selected, spare_smooth, with_others):
    with _copied(one.data) as copy:
        copy.calc_loop_triangles()
        corners = _corners(copy)
        triangles = _read(copy.loop_triangles, "loops", np.int32, 3)
        own = _read(copy.vertices, "co", np.float32, 3).astype(float)
        of_edges = _read(copy.edges, "vertices", np.int32, 2)
        is_seam = _read(copy.edges, "use_seam", bool)
        is_sharp = _read(copy.edges, "use_edge_sharp", bool)
        is_chosen = ~_read(copy.polygons, "hide", bool)
        if only_selected:
            is_chosen &= _read(copy.polygons, "select", bool)
        layer = copy.uv_layers.active
        no_uvs = np.zeros((len(corners), 2), dtype=np.float32)
        uvs = _read(layer.data, "uv", np.float32, 2) if layer else no_uvs
    positions = _placed(own, one)
    is_chosen_triangle = is_chosen[corners[triangles[:, 0], 0]]
    chosen = triangles[is_chosen_triangle]
    others = triangles[~is_chosen_triangle] if with_others else triangles[:0]
    used, numbers = np.unique(corners[chosen, 1], return_inverse=True)
    by_vertex = numbers.reshape(-1, 3)
    all_faces = np.bincount(corners[:, 2], minlength=len(of_edges))
    chosen_faces = np.bincount(corners[is_chosen[corners[:, 0]], 2], minlength=len(of_edges))
    edges = np.flatnonzero(chosen_faces)
    ends = np.searchsorted(used, of_edges[edges])
    inside = np.setdiff1d(_keys(by_vertex[:, [[0, 1], [1, 2], [2, 0]]]), _keys(ends))
    smooth = ends[~(is_sharp | is_seam)[edges]] if spare_smooth else ends[:0]
    return Part(
        mesh=one.data,
        corners=corners,
        chosen=chosen,
        vertices=positions[used],
        triangles=by_vertex.astype(np.uint32),
        edges=edges,
        ends=ends,
        is_border=(chosen_faces < all_faces)[edges],
        seams=ends[is_seam[edges]].astype(np.uint32),
        spared=np.concatenate([_pairs(inside), smooth]).astype(np.uint32),
        others=others,
        other_positions=positions[corners[others, 1]],
        other_uvs=uvs[others],
    )


@contextmanager
def _copied(mesh):
    """Give a copy of a mesh in edit mode for a while: its arrays can be read at once."""
    copy = bpy.data.meshes.new(mesh.name)
    try:
        bmesh.from_edit_mesh(mesh).to_mesh(copy)
        yield copy
    finally:
        bpy.data.meshes.remove(copy)


def _read(of, name, kind, width=None):
    """Return a property of all elements: `[N]`, or `[N, width]`."""
    found = np.empty(len(of) * (width or 1), dtype=kind)
    of.foreach_get(name, found)
    return found.reshape(-1, width) if width else found


def _corners(copy):
    sizes = _read(copy.polygons, "loop_total", np.int32)
    return np.column_stack(
        [
            np.repeat(np.arange(len(sizes)), sizes),
            _read(copy.loops, "vertex_index", np.int32),
            _read(copy.loops, "edge_index", np.int32),
        ]
    )


def _placed(own, one):
    """Return positions in world units; in the object's own where its scale leaves no volume."""
    world = np.array(one.matrix_world, dtype=float)
    if np.linalg.matrix_rank(world[:3, :3]) < 3:
        return own
    return own @ world[:3, :3].T + world[:3, 3]


def _keys(pairs):
    """Return a number for each pair of vertices, whatever their order."""
    low, high = np.sort(pairs.reshape(-1, 2).astype(np.int64), axis=1).T
    return low << 32 | high


def _pairs(keys):
    return np.column_stack([keys >> 32, keys & 0xFFFFFFFF])


def is_unchanged(part):
    """Return whether the mesh is in edit mode and has the faces that it had."""
    try:
        if not part.mesh.is_editmode:
            return False
        with _copied(part.mesh) as copy:
            return np.array_equal(_corners(copy), part.corners)
    except (ReferenceError, ValueError):
        # The mesh is gone, or no longer edited.
        return False


def write_uvs(part, triangles, uvs):
    """Write UVs `[T, 3, 2]` of triangles by their corners; return how many faces a seam crosses.

    Blender has one UV for a corner: where triangles of a face disagree, that of the first counts.
    """
    edit = bmesh.from_edit_mesh(part.mesh)
    edit.faces.ensure_lookup_table()
    layer = edit.loops.layers.uv.active or edit.loops.layers.uv.new("UVMap")
    found = np.empty((len(part.corners), 2), dtype=np.float32)
    # What is written last stays.
    found[triangles.reshape(-1)[::-1]] = uvs.reshape(-1, 2)[::-1]
    of_corners = part.corners[:, 0]
    faces = np.unique(of_corners[triangles])
    us, vs = found[np.isin(of_corners, faces)].T
    next_uv = zip(us.tolist(), vs.tolist(), strict=True).__next__
    for face in faces.tolist():
        for loop in edit.faces[face].loops:
            loop[layer].uv = next_uv()
    bmesh.update_edit_mesh(part.mesh, loop_triangles=False, destructive=False)
    crossed = (found[triangles] != uvs).any(axis=(1, 2))
    return len(np.unique(of_corners[triangles[crossed]]))


def mark_seams(part, seams):
    """Mark the edges of pairs of vertices, and those around the part; other marks inside go."""
    edit = bmesh.from_edit_mesh(part.mesh)
    edit.edges.ensure_lookup_table()
    # The border of the part is cut from the rest of the mesh.
    is_seam = np.isin(_keys(part.ends), _keys(seams)) | part.is_border
    for edge, is_marked in zip(part.edges.tolist(), is_seam.tolist(), strict=True):
        edit.edges[edge].seam = is_marked
    bmesh.update_edit_mesh(part.mesh, loop_triangles=False, destructive=False)
