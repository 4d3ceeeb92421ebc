"""The extension in a real Blender."""

import importlib
import time
from types import SimpleNamespace

import bmesh
import bpy
import numpy as np
import pytest
import scenes


def is_valid(metrics) -> None:
    assert metrics["flipped_triangles"] == 0
    assert metrics["overlapping_pairs"] == 0
    assert metrics["symmetric_dirichlet"] <= 4.1001


def operator_module():
    """The operator's module, wherever extensions are."""
    return importlib.import_module(bpy.types.UV_OT_flatten_anything.__module__)


def test_suzanne_is_unwrapped() -> None:
    monkey = scenes.monkey()
    assert scenes.unwrap(monkey) == {"FINISHED"}
    metrics = scenes.measured(monkey.data)
    is_valid(metrics)
    assert metrics["charts"] <= 12
    found = scenes.uvs(monkey.data)
    assert found.min() >= 0 and found.max() <= 1
    assert not any(edge.use_seam for edge in monkey.data.edges)


def test_a_character_keeps_all_but_its_uvs() -> None:
    monkey = scenes.monkey(1)
    mesh = monkey.data
    materials = [bpy.data.materials.new(name) for name in ("skin", "eyes")]
    for material in materials:
        mesh.materials.append(material)
    for polygon in mesh.polygons:
        polygon.material_index = polygon.index % 2
    other = mesh.uv_layers[0]
    other.name = "Other"
    before_other = scenes.uvs(mesh)
    layer = mesh.uv_layers.new(name="Active")
    mesh.uv_layers.active = layer
    group = monkey.vertex_groups.new(name="head")
    group.add(range(50), 0.5, "REPLACE")
    monkey.shape_key_add(name="Basis")
    key = monkey.shape_key_add(name="Smile")
    key.data[3].co.x += 1
    bpy.ops.object.armature_add()
    armature = scenes.active()
    modifier = monkey.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    monkey.modifiers.new("Subdivision", "SUBSURF")

    def content():
        return (
            [tuple(polygon.vertices) for polygon in mesh.polygons],
            [polygon.material_index for polygon in mesh.polygons],
            [tuple(vertex.co) for vertex in mesh.vertices],
            [[(g.group, g.weight) for g in vertex.groups] for vertex in mesh.vertices],
            [[tuple(point.co) for point in key.data] for key in mesh.shape_keys.key_blocks],
            [(m.name, m.type) for m in monkey.modifiers],
            [one.name for one in mesh.uv_layers],
        )

    before = content()
    assert scenes.unwrap(monkey) == {"FINISHED"}
    assert content() == before and mesh.uv_layers.active.name == "Active"
    is_valid(scenes.measured(mesh))
    mesh.uv_layers.active = mesh.uv_layers["Other"]
    assert (scenes.uvs(mesh) == before_other).all()


def test_objects_share_one_square_and_linked_duplicates_one_layout() -> None:
    monkey = scenes.monkey()
    bpy.ops.mesh.primitive_torus_add(location=(3, 0, 0))
    torus = scenes.active()
    twin = monkey.copy()
    bpy.context.collection.objects.link(twin)
    twin.location.x = -3
    assert scenes.unwrap(monkey, torus, twin) == {"FINISHED"}
    is_valid(scenes.measured(monkey.data, torus.data))


def test_only_selected_faces_change() -> None:
    monkey = scenes.monkey()
    mesh = monkey.data
    before = scenes.uvs(mesh)
    scenes.edit(monkey)
    bpy.ops.mesh.select_all(action="DESELECT")
    edit = bmesh.from_edit_mesh(mesh)
    edit.faces.ensure_lookup_table()
    chosen = [face.index for face in edit.faces if face.calc_center_median().x > 0.2]
    for number in chosen:
        edit.faces[number].select = True
    bmesh.update_edit_mesh(mesh)
    assert bpy.ops.uv.flatten_anything() == {"FINISHED"}
    scenes.leave()
    changed = (scenes.uvs(mesh) != before).any(axis=1)
    for polygon in mesh.polygons:
        assert changed[polygon.loop_indices].any() == (polygon.index in chosen)
    scenes.edit(monkey)
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="No faces are selected"):
        bpy.ops.uv.flatten_anything()
    assert bpy.ops.uv.flatten_anything(only_selected=False) == {"FINISHED"}
    scenes.leave()
    assert (scenes.uvs(mesh) != before).any(axis=1).all()


def test_marked_seams_are_cut_and_new_ones_marked() -> None:
    bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=12)
    torus = scenes.active()
    mesh = torus.data

    def is_outer(edge) -> bool:
        return all(abs(mesh.vertices[v].co.xy.length - 1.25) < 1e-4 for v in edge.vertices)

    outer = [edge.index for edge in mesh.edges if is_outer(edge)]
    assert len(outer) == 24
    for number in outer:
        mesh.edges[number].use_seam = True
    assert scenes.unwrap(torus, mark_seams=True) == {"FINISHED"}
    marked = {edge.index for edge in mesh.edges if edge.use_seam}
    assert marked > set(outer)
    is_valid(scenes.measured(mesh))
    assert scenes.unwrap(torus, use_seams=False, mark_seams=True) == {"FINISHED"}
    assert not set(outer) <= {edge.index for edge in mesh.edges if edge.use_seam}


def test_smooth_edges_are_spared() -> None:
    bpy.ops.mesh.primitive_cube_add()
    cube = scenes.active()
    scenes.edit(cube)
    bpy.ops.mesh.subdivide(number_cuts=3)
    bpy.ops.mesh.select_all(action="SELECT")
    scenes.leave()
    # Sharp where two sides of the cube meet.
    for edge in cube.data.edges:
        places = [cube.data.vertices[v].co for v in edge.vertices]
        on_sides = sum(
            all(abs(abs(place[axis]) - 1) < 1e-6 for place in places) for axis in range(3)
        )
        edge.use_edge_sharp = on_sides == 2
    assert scenes.unwrap(cube, avoid_smooth=True, mark_seams=True) == {"FINISHED"}
    seams = [edge for edge in cube.data.edges if edge.use_seam]
    assert seams and all(edge.use_edge_sharp for edge in seams)


def test_meshes_that_are_not_manifold_are_unwrapped() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=6)
    grid = scenes.active()
    edit = bmesh.new()
    edit.from_mesh(grid.data)
    edit.verts.ensure_lookup_table()
    edit.edges.ensure_lookup_table()
    inner = next(edge for edge in edit.edges if not edge.is_boundary)
    top = edit.verts.new((0.0, 0.0, 1.0))
    edit.faces.new([*inner.verts, top])
    edit.verts.new((5.0, 5.0, 5.0))
    edit.to_mesh(grid.data)
    edit.free()
    assert scenes.unwrap(grid) == {"FINISHED"}
    is_valid(scenes.measured(grid.data))


def test_undo_is_one_step() -> None:
    monkey = scenes.monkey()
    name = monkey.name
    scenes.edit(monkey)
    bpy.ops.ed.undo_push(message="before")
    scenes.leave()
    before = scenes.uvs(monkey.data)
    scenes.edit(monkey)
    assert bpy.ops.uv.flatten_anything() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    scenes.leave()
    assert (scenes.uvs(bpy.data.objects[name].data) == before).all()


def test_cancelling_leaves_the_mesh_as_it_was() -> None:
    monkey = scenes.monkey(2)
    mesh = monkey.data
    before = scenes.uvs(mesh)
    scenes.edit(monkey)
    operator = operator_module()
    parts = operator.meshes.chosen(bpy.context.objects_in_mode_unique_data, True, False)
    task = operator.Task(parts, use_seams=True, distortion_bound=4.001)
    assert task.status().startswith("Flatten Anything: ")
    assert task.job.cancel()
    with pytest.raises(operator.CancelledError):
        task.write(False)
    scenes.leave()
    assert (scenes.uvs(mesh) == before).all()


def test_errors_are_reports_of_one_line() -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = scenes.active()
    for vertex in plane.data.vertices:
        vertex.co = (0.0, 0.0, 0.0)
    scenes.edit(plane)
    with pytest.raises(RuntimeError, match="Error: .*area") as error:
        bpy.ops.uv.flatten_anything()
    assert len(str(error.value).strip().splitlines()) == 1
    scenes.leave()


def test_menus_and_the_panel_are_there_and_go_away() -> None:
    module = "bl_ext.user_default.flatten_anything_uv"
    assert hasattr(bpy.types, "IMAGE_PT_flatten_anything")
    bpy.ops.preferences.addon_disable(module=module)
    assert not hasattr(bpy.types, "IMAGE_PT_flatten_anything")
    bpy.ops.preferences.addon_enable(module=module)
    assert hasattr(bpy.types, "IMAGE_PT_flatten_anything")


def test_faces_that_a_seam_crosses_are_counted() -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = scenes.active()
    scenes.edit(plane)
    operator = operator_module()
    [part] = operator.meshes.chosen([plane], True, False)
    assert part.triangles.shape == (2, 3) and len(part.spared) == 1
    uvs = np.arange(12, dtype=np.float32).reshape(2, 3, 2)
    assert operator.meshes.write(part, uvs, None) == 1
    own = part.vertices[part.triangles][:, :, :2]
    assert operator.meshes.write(part, own, None) == 0
    scenes.leave()
    places = np.array([plane.data.vertices[loop.vertex_index].co.xy for loop in plane.data.loops])
    assert np.allclose(scenes.uvs(plane.data), places)


def test_marks_on_the_border_of_the_selection_stay() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
    grid = scenes.active()
    scenes.edit(grid)
    bpy.ops.mesh.select_all(action="DESELECT")
    edit = bmesh.from_edit_mesh(grid.data)
    for face in edit.faces:
        face.select = face.calc_center_median().x > 0
    bmesh.update_edit_mesh(grid.data)
    assert bpy.ops.uv.flatten_anything(mark_seams=True) == {"FINISHED"}
    scenes.leave()
    marked = [edge for edge in grid.data.edges if edge.use_seam]
    assert len(marked) == 4
    assert all(abs(grid.data.vertices[v].co.x) < 1e-6 for edge in marked for v in edge.vertices)


def test_faces_that_are_not_flat_do_not_overlap() -> None:
    bpy.ops.mesh.primitive_circle_add(vertices=20, fill_type="NGON")
    saddle = scenes.active()
    for vertex in saddle.data.vertices:
        vertex.co.z = 0.8 * (vertex.co.x**2 - vertex.co.y**2)
    assert scenes.unwrap(saddle) == {"FINISHED"}
    is_valid(scenes.measured(saddle.data))


def test_a_mesh_that_changed_meanwhile_is_left_alone() -> None:
    monkey = scenes.monkey()
    scenes.edit(monkey)
    operator = operator_module()
    parts = operator.meshes.chosen([monkey], True, False)
    task = operator.Task(parts, use_seams=True)
    task.job.exception()
    bpy.ops.mesh.delete(type="FACE")
    with pytest.raises(operator.Changed):
        task.write(True)
    scenes.leave()
    with pytest.raises(operator.Changed):
        task.write(True)
    bpy.data.meshes.remove(monkey.data)
    with pytest.raises(operator.Changed):
        task.write(True)


def test_objects_without_volume_are_unwrapped() -> None:
    monkey = scenes.monkey()
    monkey.scale = (1, 1, 0)
    bpy.context.view_layer.update()
    assert scenes.unwrap(monkey) == {"FINISHED"}
    is_valid(scenes.measured(monkey.data))


@pytest.mark.parametrize("cancelled", [False, True])
def test_it_runs_in_the_background_until_it_ends_or_esc(cancelled: bool) -> None:
    """What Blender does with a window, done by hand: there is none here."""
    monkey = scenes.monkey(1)
    mesh = monkey.data
    before = scenes.uvs(mesh)
    scenes.edit(monkey)
    operator = operator_module()
    kind = operator.UV_OT_flatten_anything
    parts = operator.meshes.chosen(bpy.context.objects_in_mode_unique_data, True, False)
    texts = []
    context = SimpleNamespace(
        window_manager=SimpleNamespace(event_timer_remove=lambda timer: texts.append(timer)),
        workspace=SimpleNamespace(status_text_set=texts.append),
    )
    own = SimpleNamespace(mark_seams=False, report=print, _timer="timer")
    own._task = operator.Task(parts, use_seams=True)
    own.leave = lambda *given: kind.leave(own, *given)
    own.end = lambda task: kind.end(own, task)
    assert kind.modal(own, context, SimpleNamespace(type="A")) == {"RUNNING_MODAL"}
    for passing in ("WHEELUPMOUSE", "TIMER_REPORT", "NDOF_MOTION"):
        assert kind.modal(own, context, SimpleNamespace(type=passing)) == {"PASS_THROUGH"}
    if cancelled:
        assert kind.modal(own, context, SimpleNamespace(type="ESC")) == {"CANCELLED"}
    else:
        result = {"PASS_THROUGH"}
        while result == {"PASS_THROUGH"}:
            time.sleep(operator.INTERVAL)
            result = kind.modal(own, context, SimpleNamespace(type="TIMER"))
        assert result == {"FINISHED"}
        assert any(text and text.startswith("Flatten Anything: ") for text in texts)
    assert texts[-2:] == ["timer", None]
    scenes.leave()
    assert (scenes.uvs(mesh) == before).all() == cancelled
