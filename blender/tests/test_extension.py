"""The extension in a real Blender."""

import importlib
import re
import time
from types import SimpleNamespace

import bmesh
import bpy
import numpy as np
import pytest
import scenes

#: Options that a task needs.
SQUARE = {"margin": 4.0, "resolution": 2048}


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


def test_seams_mirror_on_a_symmetric_mesh() -> None:
    def seams_and_images(**options):
        monkey = scenes.monkey()
        mesh = monkey.data
        assert scenes.unwrap(monkey, mark_seams=True, **options) == {"FINISHED"}
        is_valid(scenes.measured(mesh))
        ends = [
            [mesh.vertices[v].co for v in edge.vertices] for edge in mesh.edges if edge.use_seam
        ]
        middles = [np.round((a + b) / 2, 4) + 0.0 for a, b in ends]
        return [{tuple(of * (sign, 1, 1) + 0.0) for of in middles} for sign in (1, -1)]

    for symmetry in ("auto", "x"):
        seams, images = seams_and_images(symmetry=symmetry)
        assert seams and seams == images
    seams, images = seams_and_images()
    assert seams != images


@pytest.mark.parametrize("side", [-1, 1])
def test_seams_are_hidden_by_a_wall(side: int) -> None:
    bpy.ops.mesh.primitive_cylinder_add(end_fill_type="NOTHING")
    tube = scenes.active()
    bpy.ops.mesh.primitive_plane_add(
        size=8, location=(0, 1.1 * side, 0), rotation=(np.pi / 2, 0, 0)
    )
    wall = scenes.active()
    assert scenes.unwrap(tube, wall, mark_seams=True, hide_seams=1.0) == {"FINISHED"}
    is_valid(scenes.measured(tube.data, wall.data))
    marked = [edge.vertices for edge in tube.data.edges if edge.use_seam]
    assert marked
    assert all(tube.data.vertices[v].co.y * side > 0.3 for ends in marked for v in ends)


def test_hard_edges_are_cut_and_sides_stand_upright() -> None:
    bpy.ops.mesh.primitive_cube_add(rotation=(0, 0, 0.3))
    cube = scenes.active()
    mesh = cube.data
    is_side = np.repeat([abs(face.normal.z) < 0.5 for face in mesh.polygons], 4)
    zs = np.array([mesh.vertices[loop.vertex_index].co.z for loop in mesh.loops])[is_side]
    options = {"hard_angle": np.radians(60), "upright": True}
    assert scenes.unwrap(cube, **options) == {"FINISHED"}
    assert scenes.measured(mesh)["charts"] == 6
    sides = scenes.uvs(mesh)[is_side].reshape(-1, 4, 2)
    up = (zs > 0).reshape(-1, 4)
    for face, is_up in zip(sides, up, strict=True):
        assert face[is_up, 1].min() > face[~is_up, 1].max() + 0.1
    # Packed with another face, they still do.
    scenes.edit(cube)
    scenes.select(mesh, lambda face: face.normal.z < 0.5)
    assert bpy.ops.uv.flatten_anything(other_faces="pack", **options) == {"FINISHED"}
    scenes.leave()
    is_valid(scenes.measured(mesh))
    for face, is_up in zip(scenes.uvs(mesh)[is_side].reshape(-1, 4, 2), up, strict=True):
        assert np.ptp(face[is_up, 1]) < 1e-5 and np.ptp(face[~is_up, 1]) < 1e-5
        assert face[is_up, 1].min() > face[~is_up, 1].max()
    assert scenes.unwrap(cube, hard_angle=np.pi) == {"FINISHED"}
    assert scenes.measured(mesh)["charts"] < 6


def test_equal_objects_are_stacked_and_others_spread_over_tiles() -> None:
    grids = [scenes.grid(1, location=(3 * k, 0, 0)) for k in range(4)]
    assert scenes.unwrap(*grids, stack="identical") == {"FINISHED"}
    first, *others = [scenes.uvs(one.data) for one in grids]
    assert all((found == first).all() for found in others)
    assert np.ptp(first, axis=0).max() > 0.9
    assert scenes.unwrap(*grids, tiles=4) == {"FINISHED"}
    tiles = [np.floor(scenes.uvs(one.data)) for one in grids]
    assert all((tile == tile[0]).all() for tile in tiles)
    assert sorted(tile[0, 0] for tile in tiles) == [0, 1, 2, 3]


def test_charts_have_the_texel_density_that_is_asked_for(monkeypatch) -> None:
    import flatten_anything as fa

    grids = [scenes.grid(1, location=(3 * k, 0, 0)) for k in range(4)]
    scenes.edit(*grids)
    operator = operator_module()
    parts = operator.meshes.parts(grids, True, False, False)
    told = []
    own = SimpleNamespace(mark_seams=False, report=lambda _, text: told.append(text))
    for options in ({}, {"texel_density": 100.0}):
        assert not told
        task = operator.Task(parts, use_seams=True, **options, **SQUARE)
        assert operator.UV_OT_flatten_anything.end(own, task) == {"FINISHED"}
    side = int(re.fullmatch(r"The image is to have (\d+) pixels a side", *told)[1])
    # Two grids in a row, a margin between them and half of one at each border.
    assert 208 <= side <= 212
    scenes.leave()

    def pixels(of_image):
        found = []
        for one in grids:
            positions, corners, uvs = scenes.triangles(one.data)
            found.append(of_image * sides(uvs) / sides(positions[corners]))
        return np.concatenate(found)

    assert np.allclose(pixels(side), 100, rtol=1e-3)
    # A tile has room for one of them.
    options = {"texel_density": 100.0, "resolution": 128}
    assert scenes.unwrap(*grids, tiles=4, **options) == {"FINISHED"}
    assert np.allclose(pixels(128), 100, rtol=1e-3)
    tiles = [np.floor(scenes.uvs(one.data))[0, 0] for one in grids]
    assert sorted(tiles) == [0, 1, 2, 3]
    scenes.edit(*grids)
    with pytest.raises(RuntimeError, match="need 4 tiles, but there may be 3"):
        bpy.ops.uv.flatten_anything(tiles=3, **options)
    # Packed together, they are in one square, whatever else is asked for.
    unwrap, given = fa.unwrap, []
    monkeypatch.setattr(fa, "unwrap", lambda *a, **k: given.append(k) or unwrap(*a, **k))
    assert bpy.ops.uv.flatten_anything(tiles=4, other_faces="pack", **options) == {"FINISHED"}
    assert given[0]["tiles"] == 1 and given[0]["texel_density"] is None
    scenes.leave()


def test_options_of_shapes_reach_the_layout(monkeypatch) -> None:
    import flatten_anything as fa

    unwrap, given = fa.unwrap, []
    monkeypatch.setattr(fa, "unwrap", lambda *a, **k: given.append(k) or unwrap(*a, **k))
    monkey = scenes.monkey()
    options = {"straighten": True, "coverage_weight": 2.0, "stack": "mirrored"}
    assert scenes.unwrap(monkey, **options) == {"FINISHED"}
    assert given[0].items() >= options.items()
    metrics = scenes.measured(monkey.data)
    # One eye lies on the other.
    assert metrics["overlapping_pairs"] == metrics["stacked_pairs"] > 0


def test_only_selected_faces_change() -> None:
    monkey = scenes.monkey()
    mesh = monkey.data

    def bits():
        return scenes.uvs(mesh).view(np.uint32)

    before = bits()
    scenes.edit(monkey)
    chosen = scenes.select(mesh, lambda face: face.calc_center_median().x > 0.2)
    assert bpy.ops.uv.flatten_anything(other_faces="keep") == {"FINISHED"}
    scenes.leave()
    changed = (bits() != before).any(axis=1)
    for polygon in mesh.polygons:
        assert changed[polygon.loop_indices].any() == (polygon.index in chosen)
    scenes.edit(monkey)
    bpy.ops.mesh.select_all(action="DESELECT")
    for other_faces in ("keep", "pack"):
        with pytest.raises(RuntimeError, match="No faces are selected"):
            bpy.ops.uv.flatten_anything(other_faces=other_faces)
    assert bpy.ops.uv.flatten_anything(only_selected=False) == {"FINISHED"}
    scenes.leave()
    assert (bits() != before).any(axis=1).all()


def sides(corners):
    return np.linalg.norm(np.roll(corners, 1, axis=1) - corners, axis=2)


def test_other_faces_are_packed_with_the_selected_ones() -> None:
    import flatten_anything as fa

    monkey = scenes.monkey()
    bpy.ops.mesh.primitive_torus_add(location=(3, 0, 0))
    torus = scenes.active()
    meshes = [monkey.data, torus.data]
    assert scenes.unwrap(monkey, torus) == {"FINISHED"}
    # One lies far away and is larger, and hidden in part.
    scenes.set_uvs(torus.data, 3 * scenes.uvs(torus.data) + (-2, 5))
    scenes.edit(monkey, torus)
    scenes.select(torus.data, lambda face: face.calc_center_median().x < -0.5)
    bpy.ops.mesh.hide()
    chosen = scenes.select(monkey.data, lambda face: face.calc_center_median().x > 0.2)
    scenes.leave()
    before = [scenes.triangles(mesh) for mesh in meshes]
    scenes.edit(monkey, torus)
    scenes.select(monkey.data, lambda face: face.index in chosen)
    assert bpy.ops.uv.flatten_anything(other_faces="pack") == {"FINISHED"}
    scenes.leave()
    is_valid(scenes.measured(*meshes))
    for mesh, (positions, corners, old) in zip(meshes, before, strict=True):
        new = scenes.triangles(mesh)[2]
        assert new.min() >= 0 and new.max() <= 1
        faces = [triangle.polygon_index for triangle in mesh.loop_triangles]
        other = ~np.isin(faces, chosen) if mesh == monkey.data else np.full(len(faces), True)
        assert (new != old).any(axis=(1, 2)).all()
        # Triangles keep their shapes, and what they hang together with.
        ratios = sides(new[other]) / sides(old[other])
        assert np.allclose(ratios.max(axis=1), ratios.min(axis=1), rtol=2e-3)
        charts = [fa.measure(positions, corners[other], uv[other])["charts"] for uv in (old, new)]
        assert charts[0] == charts[1]


def test_charts_on_each_other_are_packed_apart_at_one_texel_density() -> None:
    """Four grids fill one square: two in one mesh, one in another, and a larger one selected."""
    grids = [scenes.grid(size, location=(9 * k, 0, 0)) for k, size in enumerate((1, 1, 1, 2))]
    first, second, third, chosen = grids
    bpy.ops.object.select_all(action="DESELECT")
    first.select_set(True)
    second.select_set(True)
    bpy.context.view_layer.objects.active = first
    bpy.ops.object.join()
    objects = (first, third, chosen)
    scenes.edit(*objects)
    scenes.select(chosen.data, lambda face: True)
    assert bpy.ops.uv.flatten_anything(other_faces="pack") == {"FINISHED"}
    scenes.leave()
    meshes = [one.data for one in objects]
    metrics = scenes.measured(*meshes)
    assert metrics["overlapping_pairs"] == 0
    assert metrics["charts"] == 4
    scales = []
    for mesh in meshes:
        positions, corners, uvs = scenes.triangles(mesh)
        scales.append(sides(uvs) / sides(positions[corners]))
    assert np.allclose(np.concatenate(scales), scales[0][0, 0], rtol=1e-3)


def test_charts_without_an_area_stay_as_they_are() -> None:
    """Faces on the left have no UVs yet, or on a line."""
    for on_line in (False, True):
        monkey = scenes.monkey()
        mesh = monkey.data
        flat = np.zeros((len(mesh.loops), 2), dtype=np.float32)
        if on_line:
            flat[:, 0] = scenes.uvs(mesh)[:, 0]
            flat[:, 1] = 0.3 * flat[:, 0]
        scenes.set_uvs(mesh, flat)
        scenes.edit(monkey)
        chosen = scenes.select(mesh, lambda face: face.calc_center_median().x > 0)
        assert bpy.ops.uv.flatten_anything(other_faces="pack") == {"FINISHED"}
        scenes.leave()
        others = [p.loop_indices for p in mesh.polygons if p.index not in chosen]
        assert all((scenes.uvs(mesh)[corners] == flat[corners]).all() for corners in others)
        _, _, uvs = scenes.triangles(mesh)
        is_new = np.isin([triangle.polygon_index for triangle in mesh.loop_triangles], chosen)
        assert np.ptp(uvs[is_new], axis=(0, 1)).max() > 0.9


def test_a_mesh_without_uvs_gets_some() -> None:
    monkey = scenes.monkey()
    mesh = monkey.data
    mesh.uv_layers.remove(mesh.uv_layers[0])
    scenes.edit(monkey)
    scenes.select(mesh, lambda face: face.calc_center_median().x > 0)
    assert bpy.ops.uv.flatten_anything(other_faces="pack") == {"FINISHED"}
    assert bpy.ops.uv.flatten_anything(only_selected=False) == {"FINISHED"}
    scenes.leave()
    is_valid(scenes.measured(mesh))


def test_too_narrow_a_margin_is_told() -> None:
    grid = scenes.grid(2)
    # Each face is a chart.
    corners = np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (len(grid.data.polygons), 1))
    scenes.set_uvs(grid.data, corners + 2 * np.repeat(np.arange(16), 4)[:, None])
    scenes.edit(grid)
    scenes.select(grid.data, lambda face: face.index == 0)
    operator = operator_module()
    parts = operator.meshes.parts([grid], True, False, True)
    task = operator.Task(parts, use_seams=True, margin=60.0, resolution=240)
    [warning] = task.write(mark_seams=False)
    assert warning.startswith("with other charts the margin is ")
    scenes.leave()


def test_neural_layouts_are_not_repeated(monkeypatch) -> None:
    """What Adjust Last Operation does, and Repeat Last."""
    kind = operator_module().UV_OT_flatten_anything
    start, started = kind.start, []

    def watched(self, context):
        started.append(self.method)
        return start(self, context) if self.method == "direct" else None

    monkey = scenes.monkey()
    scenes.edit(monkey)
    bpy.ops.ed.undo_push(message="before")
    # As one of a user, for Blender to keep it.
    assert bpy.ops.uv.flatten_anything("EXEC_DEFAULT", True, method="direct") == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Flatten Anything")
    [last] = bpy.context.window_manager.operators
    [area] = [area for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    [region] = [region for region in area.regions if region.type == "WINDOW"]

    def uvs():
        edit = bmesh.from_edit_mesh(bpy.context.object.data)
        layer = edit.loops.layers.uv.active
        return np.array([loop[layer].uv for face in edit.faces for loop in face.loops])

    monkeypatch.setattr(kind, "start", watched)
    before = uvs()
    for method, is_same in (("neural", True), ("direct", False)):
        for repeat in (bpy.ops.ed.undo_redo, bpy.ops.screen.repeat_last):
            last.properties.method = method
            last.properties.margin += 20
            with bpy.context.temp_override(window=bpy.context.window, area=area, region=region):
                repeat()
            assert (uvs() == before).all() == is_same
            before = uvs()
    assert started == ["direct", "direct"]
    scenes.leave()


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
    parts = operator.meshes.parts(bpy.context.objects_in_mode_unique_data, True, False, False)
    task = operator.Task(parts, use_seams=True, distortion_bound=4.001, **SQUARE)
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


def panels():
    """The panel, and its parts in the order of their names."""
    names = [name for name in dir(bpy.types) if name.startswith("IMAGE_PT_flatten_anything")]
    return [getattr(bpy.types, name) for name in sorted(names)]


def test_menus_and_the_panel_are_there_and_go_away() -> None:
    module = "bl_ext.user_default.flatten_anything_uv"
    count = len(panels())
    assert count > 1
    bpy.ops.preferences.addon_disable(module=module)
    assert not panels()
    bpy.ops.preferences.addon_enable(module=module)
    assert len(panels()) == count


class Drawn:
    """A layout that keeps what is drawn: there is no window."""

    def __init__(self, found=None):
        self.found = [] if found is None else found
        self.enabled = True

    def row(self):
        return Drawn(self.found)

    def prop(self, _properties, name):
        self.found.append((name, self.enabled))

    def label(self, text, icon="NONE"):
        self.found.append((text, icon))

    def operator(self, name):
        self.found.append((name, self.enabled))

    def separator(self):
        pass


def test_every_option_is_in_one_part_of_the_panel() -> None:
    kind = operator_module().UV_OT_flatten_anything
    options = sorted(kind.__annotations__)
    last = bpy.context.window_manager.operator_properties_last(kind.bl_idname)
    redo = {"properties": last, "draw_options": kind.draw_options}

    def drawn(by, **own):
        layout = Drawn()
        by.draw(SimpleNamespace(layout=layout, **own), bpy.context)
        return layout.found

    scenes.edit(scenes.monkey())
    whole, *parts = panels()
    for part in parts:
        assert part.bl_parent_id == whole.__name__ and part.bl_options == {"DEFAULT_CLOSED"}
    assert all(panel.poll(bpy.context) for panel in panels())
    assert drawn(whole)[0] == (kind.bl_idname, True)
    for other_faces, idle in (("keep", []), ("pack", ["texel_density", "tiles"])):
        last.other_faces = other_faces
        for found in ([one for panel in panels() for one in drawn(panel)], drawn(kind, **redo)):
            own = [one for one in found if one[0] in options]
            assert sorted(name for name, _ in own) == options
            assert sorted(name for name, is_enabled in own if not is_enabled) == idle
            reasons = [text for text, icon in found if icon == "INFO"]
            assert reasons == (["Pack Together fills one square"] if idle else [])
    last.other_faces = "keep"
    scenes.leave()
    assert not any(panel.poll(bpy.context) for panel in panels())


def test_faces_that_a_seam_crosses_are_counted() -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = scenes.active()
    scenes.edit(plane)
    operator = operator_module()
    [part] = operator.meshes.parts([plane], True, False, False)
    assert part.triangles.shape == (2, 3) and len(part.spared) == 1
    uvs = np.arange(12, dtype=np.float32).reshape(2, 3, 2)
    assert operator.meshes.write_uvs(part, part.chosen, uvs) == 1
    edit = bmesh.from_edit_mesh(plane.data)
    layer = edit.loops.layers.uv.active
    [face] = edit.faces
    # Where triangles disagree, the first has its way.
    assert [tuple(face.loops[k][layer].uv) for k in part.chosen[0]] == [(0, 1), (2, 3), (4, 5)]
    own = part.vertices[part.triangles][:, :, :2]
    assert operator.meshes.write_uvs(part, part.chosen, own) == 0
    scenes.leave()
    places = np.array([plane.data.vertices[loop.vertex_index].co.xy for loop in plane.data.loops])
    assert np.allclose(scenes.uvs(plane.data), places)


def test_marks_on_the_border_of_the_selection_stay() -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
    grid = scenes.active()
    scenes.edit(grid)
    scenes.select(grid.data, lambda face: face.calc_center_median().x > 0)
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
    parts = operator.meshes.parts([monkey], True, False, False)
    task = operator.Task(parts, use_seams=True, **SQUARE)
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
    parts = operator.meshes.parts(bpy.context.objects_in_mode_unique_data, True, False, False)
    texts = []
    context = SimpleNamespace(
        window_manager=SimpleNamespace(event_timer_remove=lambda timer: texts.append(timer)),
        workspace=SimpleNamespace(status_text_set=texts.append),
    )
    own = SimpleNamespace(mark_seams=False, report=print, _timer="timer")
    own._task = operator.Task(parts, use_seams=True, **SQUARE)
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
