"""Making meshes in Blender, and judging their UVs."""

import bmesh
import bpy
import numpy as np


def active():
    return bpy.context.view_layer.objects.active


def edit(*objects) -> None:
    """Go to edit mode with objects, all of their faces selected."""
    bpy.ops.object.select_all(action="DESELECT")
    for one in objects:
        one.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_mode(type="FACE")
    bpy.ops.mesh.select_all(action="SELECT")


def select(mesh, is_chosen) -> list[int]:
    """Select those faces of a mesh in edit mode, and no others of any; return their numbers."""
    bpy.ops.mesh.select_all(action="DESELECT")
    edit = bmesh.from_edit_mesh(mesh)
    chosen = [face for face in edit.faces if is_chosen(face)]
    for face in chosen:
        face.select = True
    bmesh.update_edit_mesh(mesh)
    return [face.index for face in chosen]


def leave() -> None:
    bpy.ops.object.mode_set(mode="OBJECT")


def unwrap(*objects, **options) -> set[str]:
    edit(*objects)
    result = bpy.ops.uv.flatten_anything(**options)
    leave()
    return result


def uvs(mesh) -> np.ndarray:
    """UVs of all corners of the active layer."""
    flat = np.empty(2 * len(mesh.loops), dtype=np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", flat)
    return flat.reshape(-1, 2)


def set_uvs(mesh, new) -> None:
    mesh.uv_layers.active.data.foreach_set("uv", np.asarray(new, dtype=np.float32).reshape(-1))


def triangles(mesh):
    """Positions, triangles, and the UVs of their corners."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    positions = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", positions)
    corners = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    loops = np.empty(3 * count, dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    return positions.reshape(-1, 3), corners.reshape(-1, 3), uvs(mesh)[loops].reshape(-1, 3, 2)


def measured(*meshes):
    """The metrics of meshes together, as they share a UV square."""
    import flatten_anything as fa

    first, all_of = 0, ([], [], [])
    for mesh in meshes:
        positions, corners, of_corners = triangles(mesh)
        for found, own in zip(all_of, (positions, corners + first, of_corners), strict=True):
            found.append(own)
        first += len(positions)
    return fa.measure(*(np.concatenate(found) for found in all_of))


def grid(size: float, **options):
    """A flat object whose UVs fill the square."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, size=size, **options)
    return active()


def monkey(subdivisions: int = 0):
    bpy.ops.mesh.primitive_monkey_add()
    one = active()
    if subdivisions:
        modifier = one.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = subdivisions
        bpy.ops.object.modifier_apply(modifier=modifier.name)
    return one
