"""Layouts by Blender; its module `bpy` must be there."""

import time

import bpy
import numpy as np

from charts import is_seam, joins, to_flatten
from obj import Refused


def smart_uv_project():
    bpy.ops.uv.smart_project()


def minimum_stretch():
    bpy.ops.uv.unwrap(method="MINIMUM_STRETCH")
    bpy.ops.uv.pack_islands()


PEERS = {"smart-uv-project": smart_uv_project, "minimum-stretch": minimum_stretch}


def mesh_of(surface):
    """An object of this surface, alone in the scene and active."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("surface")
    mesh.from_pydata(surface.vertices.tolist(), [], surface.faces.tolist())
    mesh.uv_layers.new(name="UV")
    thing = bpy.data.objects.new("surface", mesh)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    return mesh


def mark(mesh, surface):
    """Makes the seams of the surface's UVs those of the mesh; whether there are any."""
    seams = is_seam(surface.faces, joins(surface.faces, surface.uvs))
    edges = np.zeros(3 * len(surface.faces), np.int32)
    mesh.loops.foreach_get("edge_index", edges)
    is_cut = np.zeros(len(mesh.edges), bool)
    is_cut[edges[seams]] = True
    mesh.edges.foreach_set("use_seam", is_cut)
    return bool(is_cut.any())


def by_blender(peer, surface):
    """UVs [3T, 2] of the corners, triangles [T, 3] into them, seconds of the operators alone, and
    whether the surface was cut along the seams of its UVs."""
    mesh = mesh_of(surface)
    is_cut = False
    if peer == "minimum-stretch" and surface.uvs is not None:
        is_cut = mark(mesh, surface)
    elif peer == "minimum-stretch":
        to_flatten(surface)  # refuses what cannot be flattened whole
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.scene.tool_settings.use_uv_select_sync = True
    bpy.ops.mesh.select_all(action="SELECT")
    started = time.perf_counter()
    PEERS[peer]()
    seconds = time.perf_counter() - started
    bpy.ops.object.mode_set(mode="OBJECT")
    corners = np.zeros(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    if not np.array_equal(corners, surface.faces.ravel()):
        raise Refused("Blender does not keep its triangles")
    uvs = np.zeros(2 * len(corners), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uvs)
    return uvs.reshape(-1, 2), np.arange(len(corners)).reshape(-1, 3), seconds, is_cut
