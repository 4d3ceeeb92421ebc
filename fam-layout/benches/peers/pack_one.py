"""The charts of one file packed by one peer, in a process of its own; `packing` starts it.

    pack_one.py PEER IN OUT MARGIN     prints the seconds that packing alone took

IN and OUT are OBJ files; MARGIN is what the peer is asked for, in texels of 2,048 to a side.
"""

import sys
import time

import numpy as np

import obj
from charts import components, joins

RESOLUTION = 2048


def islands(surface):
    """UVs [N, 2], each once, and the triangles [T, 3] into them."""
    uvs, corners = np.unique(surface.uvs.reshape(-1, 2), axis=0, return_inverse=True)
    return uvs, corners.reshape(-1, 3)


def by_xatlas(surface, margin):
    """By xatlas, trying every place as its documentation advises for the best results."""
    import xatlas

    uvs, corners = islands(surface)
    # xatlas leaves out triangles whose area is nearly 0; UVs of about 100 units have none of these.
    uvs = (uvs / np.ptp(uvs, axis=0).max() * 100).astype(np.float32)
    charts = components(len(surface.faces), joins(surface.faces, surface.uvs) // 3)

    def packed(texels_per_unit):
        atlas = xatlas.Atlas()
        atlas.add_uv_mesh(uvs, corners.astype(np.uint32))
        options = xatlas.PackOptions()
        options.texels_per_unit, options.padding = texels_per_unit, max(round(margin), 1)
        # Every texel is tried where that does not take many minutes.
        options.bruteForce = charts.max() < 200
        started = time.perf_counter()
        atlas.generate(pack_options=options)
        return atlas, time.perf_counter() - started

    # The page is as large as the charts need; the second time it is about the square's size.
    a, b = uvs[corners[:, 1]] - uvs[corners[:, 0]], uvs[corners[:, 2]] - uvs[corners[:, 0]]
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
    guess = 0.7 * RESOLUTION / np.sqrt(area)
    first, _ = packed(guess)
    atlas, seconds = packed(guess * RESOLUTION / max(first.width, first.height))
    if atlas.atlas_count != 1:
        raise obj.Refused(f"it takes {atlas.atlas_count} squares")
    _, indices, placed = atlas.get_mesh(0)
    return square(np.asarray(placed, np.float64), atlas.width, atlas.height), indices, seconds


def square(uvs, width, height):
    """UVs of a page of some width and height, in the square around it."""
    return uvs * [width, height] / max(width, height)


def by_uvunwrap(surface, margin):
    """By uvunwrap, which keeps the UVs that it is given as charts."""
    import uvunwrap

    uvs, corners = islands(surface)
    flat = np.column_stack([uvs, np.zeros(len(uvs))])
    mesh = uvunwrap.Mesh(flat.ravel().tolist(), corners.ravel().tolist(),
                         existing_uvs=uvs.ravel().tolist())
    started = time.perf_counter()
    atlas = uvunwrap.generate([mesh], page_size=RESOLUTION, padding=round(margin))
    seconds = time.perf_counter() - started
    assert atlas.page_count == 1
    output = atlas.meshes[0]
    placed = np.array(output.uv, np.float64).reshape(-1, 2)
    if placed.max() > 2.0:
        placed = placed / [atlas.width, atlas.height]
    indices = np.array(output.indices, np.uint32).reshape(-1, 3)
    return square(placed, atlas.width, atlas.height), indices, seconds


def by_blender(surface, margin):
    """By Blender's packing of exact shapes, turned by any angle."""
    import bpy

    from blender import mesh_of

    mesh = mesh_of(surface)
    mesh.uv_layers.active.uv.foreach_set("vector", surface.uvs.astype(np.float32).ravel())
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.scene.tool_settings.use_uv_select_sync = True
    bpy.ops.mesh.select_all(action="SELECT")
    started = time.perf_counter()
    bpy.ops.uv.pack_islands(shape_method="CONCAVE", rotate=True, rotate_method="ANY", scale=True,
                            margin_method="FRACTION", margin=margin / RESOLUTION)
    seconds = time.perf_counter() - started
    bpy.ops.object.mode_set(mode="OBJECT")
    uvs = np.zeros(6 * len(surface.faces), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uvs)
    return uvs.reshape(-1, 2), np.arange(3 * len(surface.faces)).reshape(-1, 3), seconds


PEERS = {"xatlas": by_xatlas, "uvunwrap": by_uvunwrap, "blender": by_blender}


def main():
    _, peer, source, out, margin = sys.argv
    surface = obj.read(source)
    uvs, corners, seconds = PEERS[peer](surface, float(margin))
    obj.write(out, surface.vertices, surface.faces, np.asarray(uvs, np.float64), corners)
    print(seconds)


if __name__ == "__main__":
    main()
