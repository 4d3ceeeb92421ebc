"""Layouts of meshes in arrays."""

import numpy as np
import pytest

import flatten_anything as fa
import shapes


def check(vertices: np.ndarray, faces: np.ndarray, layout: fa.Layout) -> None:
    """What holds of every layout of triangles."""
    assert layout.vertex_uvs.dtype == np.float32 and layout.vertex_map.dtype == np.uint32
    assert len(layout.vertex_uvs) == len(layout.vertex_map)
    assert (layout.vertex_map[: len(vertices)] == np.arange(len(vertices))).all()
    assert (layout.vertex_map[layout.faces] == faces).all()
    assert layout.vertex_uvs.min() >= 0 and layout.vertex_uvs.max() <= 1
    assert isinstance(layout.uvs, np.ndarray) and layout.uvs.shape == (len(faces), 3, 2)
    metrics = fa.measure(vertices, faces, layout.uvs)
    assert metrics == layout.metrics
    assert metrics["flipped_triangles"] == metrics["overlapping_pairs"] == 0
    assert metrics["symmetric_dirichlet"] <= 4.1
    assert len(np.unique(layout.charts)) == metrics["charts"]


def test_a_layout_fits_its_mesh() -> None:
    for vertices, faces in (shapes.sheet(), shapes.torus()):
        layout = fa.unwrap(vertices, faces)
        check(vertices, faces, layout)
        assert layout.map is None and layout.squares is None and layout.warnings == []
    # The torus is cut open, and each seam is an edge of it.
    edges = {
        frozenset(edge) for face in faces for edge in zip(face, np.roll(face, -1), strict=True)
    }
    assert len(layout.seams) > 0
    assert all(frozenset(seam.tolist()) in edges for seam in layout.seams)


def test_polygons_stay_whole() -> None:
    vertices, quads = shapes.cube()
    layout = fa.unwrap(vertices, quads)
    assert isinstance(layout.faces, np.ndarray) and layout.faces.shape == (6, 4)
    assert (layout.face_map == np.arange(6)).all()
    ragged = [quads[0][:3], [quads[0][0], *quads[0][2:]], *quads[1:]]
    layout = fa.unwrap(vertices, ragged)
    assert [len(face) for face in layout.faces] == [3, 3, 4, 4, 4, 4, 4]
    assert [list(layout.vertex_map[face]) for face in layout.faces] == ragged
    assert [uvs.shape for uvs in layout.uvs] == [(len(face), 2) for face in ragged]
    assert layout.corner_uvs.shape == (26, 2)


def test_options_are_kept() -> None:
    vertices, faces = shapes.torus()
    tight = fa.unwrap(vertices, faces, distortion_bound=4.02)
    assert tight.metrics["symmetric_dirichlet"] <= 4.02
    around = [[i * 12, (i + 1) % 24 * 12] for i in range(24)]
    cut = fa.unwrap(vertices, faces, seams=around)
    seams = {frozenset(seam.tolist()) for seam in cut.seams}
    assert all(frozenset(edge) in seams for edge in around)
    spared = fa.unwrap(vertices, faces, no_seams=around)
    seams = {frozenset(seam.tolist()) for seam in spared.seams}
    assert not any(frozenset(edge) in seams for edge in around[1:])
    halves = (vertices[faces].mean(axis=1)[:, 0] > 0).astype(int)
    apart = fa.unwrap(vertices, faces, objects=halves)
    assert not set(apart.charts[halves == 0]) & set(apart.charts[halves == 1])
    squares = fa.unwrap(vertices, faces, materials=halves * 7 - 3)
    assert squares.squares is not None and (squares.squares == halves).all()
    assert not set(squares.charts[halves == 0]) & set(squares.charts[halves == 1])
    quick = fa.unwrap(vertices, faces, time_budget=1e-6)
    assert quick.metrics["overlapping_pairs"] == quick.metrics["flipped_triangles"] == 0
    assert quick.warnings[0] == "finishing was stopped early"


def texels(vertices: np.ndarray, faces: np.ndarray, layout: fa.Layout) -> np.ndarray:
    """The length of a side in the square against that on the surface, of every triangle."""
    lengths = [
        np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).sum(axis=1)
        for corners in (layout.uvs, vertices[faces])
    ]
    return lengths[0] / lengths[1]


def test_faces_have_as_many_texels_as_they_are_worth() -> None:
    vertices, faces = shapes.torus()
    halves = vertices[faces].mean(axis=1)[:, 0] > 0
    layout = fa.unwrap(vertices, faces, weight=np.where(halves, 3, 1))
    assert not set(layout.charts[halves]) & set(layout.charts[~halves])
    found = texels(vertices, faces, layout)
    assert found[halves].mean() / found[~halves].mean() == pytest.approx(3, rel=0.02)
    assert layout.squares is None and layout.metrics["overlapping_pairs"] == 0
    # Polygons have one number, too.
    corners, quads = shapes.cube()
    cube = fa.unwrap(corners, quads, weight=[2, 1, 1, 1, 1, 1], hard_angle=60)
    areas = [np.linalg.norm(uvs[1] - uvs[0]) for uvs in cube.uvs]
    assert areas[0] / areas[1] == pytest.approx(2, rel=1e-3)


def test_objects_have_squares_of_their_own() -> None:
    vertices, faces = shapes.torus()
    halves = vertices[faces].mean(axis=1)[:, 0] > 0
    layout = fa.unwrap(vertices, faces, objects=halves, per_object=True)
    assert layout.squares is not None and (layout.squares == halves).all()
    assert fa.unwrap(vertices, faces, objects=halves).squares is None
    # A part with another weight stays in the square of its object.
    high = vertices[faces].mean(axis=1)[:, 2] > 0
    weight = np.where(halves & high, 2.0, 1.0)
    both = fa.unwrap(vertices, faces, objects=halves, per_object=True, weight=weight)
    assert both.squares is not None and (both.squares == halves).all()
    found = texels(vertices, faces, both)
    ratio = found[halves & high].mean() / found[halves & ~high].mean()
    assert ratio == pytest.approx(2, rel=0.02)


def test_seams_are_where_nobody_painted() -> None:
    vertices, faces = shapes.tube()
    towards = vertices[:, 0] * 0.6 + vertices[:, 1] * 0.8
    layout = fa.unwrap(vertices, faces, paint=towards < 0.9, paint_weight=2)
    assert len(layout.seams) > 0 and (towards[layout.seams] > 0.89).all()
    away = fa.unwrap(vertices, faces, paint=towards > -0.9)
    assert (towards[away.seams] < -0.89).all()
    without = fa.unwrap(vertices, faces)
    idle = fa.unwrap(vertices, faces, paint=towards > -0.9, paint_weight=0)
    assert (idle.uvs == without.uvs).all()


def seam_set(layout: fa.Layout) -> set[frozenset[int]]:
    return {frozenset(seam.tolist()) for seam in layout.seams}


def test_seams_that_are_there_are_kept() -> None:
    vertices, faces = shapes.torus()
    first = fa.unwrap(vertices, faces, distortion_bound=4.01)
    kept = fa.unwrap(vertices, faces, uvs=first.uvs, keep_seams=True)
    assert seam_set(kept) == seam_set(first) != seam_set(fa.unwrap(vertices, faces))
    assert (kept.charts == first.charts).all() and (kept.uvs != first.uvs).any()


def test_charts_that_are_fine_stay_and_others_are_improved() -> None:
    vertices, faces = shapes.torus()
    both = np.concatenate([vertices, vertices + np.array([5, 0, 0])])
    all_faces = np.concatenate([faces, faces + len(vertices)])
    uvs = np.float32(0.9) * np.array(fa.unwrap(both, all_faces).uvs)
    uvs[: len(faces), :, 1] *= 0.5
    better = fa.unwrap(both, all_faces, uvs=uvs, improve=True)
    assert (better.uvs[len(faces) :] == uvs[len(faces) :]).all()
    assert better.metrics["overlapping_pairs"] == better.metrics["flipped_triangles"] == 0
    own = fa.measure(vertices, faces, better.uvs[: len(faces)])
    before = fa.measure(vertices, faces, uvs[: len(faces)])
    assert own["symmetric_dirichlet"] < 4.1 < before["symmetric_dirichlet"]
    assert own["seam_length"] == pytest.approx(before["seam_length"])


def test_faces_that_are_not_selected_keep_their_uvs() -> None:
    vertices, faces = shapes.torus()
    first = fa.unwrap(vertices, faces)
    selected = vertices[faces].mean(axis=1)[:, 0] > 0
    layout = fa.unwrap(vertices, faces, uvs=first.uvs, selected=selected)
    assert (layout.uvs[~selected] == first.uvs[~selected]).all()
    assert (layout.uvs[selected] != first.uvs[selected]).any()
    assert layout.metrics["overlapping_pairs"] == layout.metrics["flipped_triangles"] == 0
    # Polygons, of one number of corners and of several.
    corners, quads = shapes.cube()
    ragged = [quads[0][:3], [quads[0][0], *quads[0][2:]], *quads[1:]]
    for polygons in (quads, ragged):
        whole = fa.unwrap(corners, polygons, hard_angle=60)
        last = np.arange(len(polygons)) == len(polygons) - 1
        part = fa.unwrap(corners, polygons, uvs=whole.uvs, selected=last)
        assert len(part.uvs) == len(polygons)
        same = [(one == other).all() for one, other in zip(part.uvs, whole.uvs, strict=True)]
        assert same[:-1] == [True] * (len(polygons) - 1)
        assert part.metrics["overlapping_pairs"] == 0


def test_uvs_that_cannot_be_kept_are_named() -> None:
    vertices, faces = shapes.torus()
    uvs = np.array(fa.unwrap(vertices, faces).uvs)
    none, some = np.zeros(len(faces), dtype=bool), np.arange(len(faces)) < 9
    broken = np.where(np.arange(len(vertices)) == 5, np.nan, 0.0)
    cases = [
        ({"keep_seams": True}, "need uvs"),
        ({"uvs": uvs}, "need uvs"),
        ({"uvs": uvs[1:], "keep_seams": True}, r"uvs must have the shape \[576, 3, 2\]"),
        ({"uvs": uvs * np.nan, "keep_seams": True}, "texture coordinate"),
        ({"uvs": uvs, "selected": none}, "no face is selected"),
        ({"uvs": uvs, "selected": some[1:]}, "selected must be True or False for each"),
        ({"uvs": uvs, "selected": "_SELECTED"}, "selected must be True or False for each"),
        ({"uvs": uvs, "selected": some, "improve": True}, "improve goes without"),
        ({"uvs": uvs, "seams": [[0, 1]], "improve": True}, "improve goes without"),
        ({"uvs": uvs, "selected": some, "method": "neural"}, "by the direct method only"),
        ({"only": "skin"}, "only is for files"),
        ({"paint": some}, "paint must be one number for each of the 288 vertices"),
        ({"paint": broken}, r"paint\[5\] is not a finite number"),
        ({"paint_weight": -1}, "paint_weight must lie"),
        ({"weight": some[1:]}, "weight must be one number for each of the 576 faces"),
        ({"weight": np.where(some, np.nan, 1)}, r"weight\[0\] is not a finite number"),
        ({"weight": some}, r"weight must lie in 0\.001\.\.=1000"),
        ({"weight": {"skin": 2}}, "weight has names for files only"),
        ({"per_object": True}, "per_object needs objects"),
        ({"per_object": True, "objects": some, "materials": some}, "squares of their own, not"),
    ]
    for given, message in cases:
        with pytest.raises(fa.InputError, match=message):
            fa.unwrap(vertices, faces, **given)


def test_meshes_share_a_square() -> None:
    meshes = [shapes.sheet(), shapes.torus(), shapes.cube()]
    layouts = fa.unwrap_meshes(meshes)
    for (vertices, faces), layout in zip(meshes[:2], layouts[:2], strict=True):
        assert (layout.vertex_map[layout.faces] == faces).all()
        metrics = fa.measure(vertices, faces, layout.uvs)
        assert metrics["symmetric_dirichlet"] <= 4.1 and metrics["overlapping_pairs"] == 0
    assert isinstance(layouts[2].faces, np.ndarray) and layouts[2].faces.shape == (6, 4)
    # Of all of them together nothing overlaps, and the scale is one.
    both = np.concatenate([layout.uvs for layout in layouts[:2]])
    vertices = np.concatenate([meshes[0][0], meshes[1][0] + 10])
    faces = np.concatenate([meshes[0][1], meshes[1][1] + len(meshes[0][0])])
    assert fa.measure(vertices, faces, both)["overlapping_pairs"] == 0
    assert fa.measure(vertices, faces, both)["symmetric_dirichlet"] <= 4.1
    assert fa.unwrap_meshes([]) == []
    with pytest.raises(fa.InputError, match="faces of mesh 1 is empty"):
        fa.unwrap_meshes([meshes[0], (meshes[1][0], [])])


def test_meshes_have_their_parts_of_a_joint_layout() -> None:
    meshes = [shapes.torus(6, 5), shapes.sheet(3, 2), shapes.torus(5, 3), shapes.sheet(2, 2)] * 3
    layouts = fa.unwrap_meshes(meshes)
    counts = [(len(vertices), len(faces)) for vertices, faces in meshes]
    firsts = np.cumsum([(0, 0), *counts], axis=0)[:-1]
    joint = fa.unwrap(
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([mesh[1] + first for mesh, (first, _) in zip(meshes, firsts, strict=True)]),
        objects=np.repeat(np.arange(len(meshes)), [faces for _, faces in counts]),
    )
    assert isinstance(joint.uvs, np.ndarray) and joint.metrics == layouts[0].metrics
    for layout, (vertices, faces), (first, face) in zip(layouts, counts, firsts, strict=True):
        own = (joint.vertex_map >= first) & (joint.vertex_map < first + vertices)
        assert (layout.vertex_map == joint.vertex_map[own] - first).all()
        assert (layout.vertex_uvs == joint.vertex_uvs[own]).all()
        assert (layout.uvs == joint.uvs[face : face + faces]).all()
        assert (layout.face_map == np.arange(faces)).all()
        charts = joint.charts[face : face + faces]
        assert (layout.charts == charts - charts.min()).all()
        inside = (joint.seams[:, 0] >= first) & (joint.seams[:, 0] < first + vertices)
        assert inside.any() == (len(layout.seams) > 0)
        assert (layout.seams == joint.seams[inside] - first).all()


def test_the_same_input_gives_the_same_layout() -> None:
    vertices, faces = shapes.torus()
    one, other = fa.unwrap(vertices, faces), fa.unwrap(vertices, faces)
    assert (one.uvs == other.uvs).all() and (one.seams == other.seams).all()


def misaligned(array: np.ndarray) -> np.ndarray:
    """The array one byte beside where its numbers should be."""
    room = np.zeros(array.nbytes + 1, dtype=np.uint8)
    found = room[1:].view(array.dtype).reshape(array.shape)
    found[:] = array
    return found


def test_arrays_of_all_kinds_are_taken() -> None:
    vertices, faces = shapes.sheet()
    expected = fa.unwrap(vertices, faces).uvs
    wide = np.zeros((len(vertices), 6))
    wide[:, ::2] = vertices
    read_only = faces.astype(np.int32)
    read_only.flags.writeable = False
    for own, corners in (
        (vertices.tolist(), faces.tolist()),
        (wide[:, ::2], np.asfortranarray(faces)),
        (vertices, read_only),
        (vertices[::-1][::-1], faces.astype(np.uint64)),
        (misaligned(vertices), misaligned(faces)),
    ):
        assert (fa.unwrap(own, corners).uvs == expected).all()
    half = fa.unwrap(vertices.astype(np.float16), faces)
    assert half.metrics["symmetric_dirichlet"] <= 4.1


def test_arrays_that_make_no_sense_are_named() -> None:
    vertices, faces = shapes.sheet()
    broken = vertices.copy()
    broken[5, 1] = np.nan
    ragged = [[0, 1, 2], [0, 1]]
    cases = [
        ((vertices[:, :2], faces), "vertices must have the shape"),
        ((vertices.reshape(-1), faces), "vertices must have the shape"),
        ((broken, faces), r"vertices\[5\] has a coordinate that is not a finite number"),
        ((vertices, faces - 1), "the index -1"),
        ((vertices, faces + 5), "there are only 63"),
        ((vertices, faces.astype(np.uint64) + 2**40), "there are only 63"),
        ((vertices, faces.astype(float)), "faces must be integers"),
        ((vertices, faces[:, :2]), "faces must have the shape"),
        ((vertices, faces[:0]), "faces is empty"),
        ((vertices, ragged), r"faces\[1\] has fewer than three corners"),
        ((vertices, None), "a mesh has faces"),
        ((["a", "b"], faces), "vertices is no array of numbers"),
        ((np.zeros((0, 3)), faces), "there are only 0"),
        ((vertices * 0, faces), "area"),
    ]
    for arguments, message in cases:
        with pytest.raises(fa.InputError, match=message):
            fa.unwrap(*arguments)
    options = [
        ({"distortion_bound": 4.0}, "distortion_bound must be a number above 4"),
        ({"margin": -1}, "margin must lie"),
        ({"hide_seams": -1}, "hide_seams must lie"),
        ({"seen_from": [0, 0, 0]}, "seen_from must be a direction"),
        ({"seen_from": [0, 1]}, "seen_from must be three numbers"),
        ({"hard_angle": 200}, "hard_angle must lie"),
        ({"crease_weight": 10}, "crease_weight must lie"),
        ({"tear_weight": 10}, "tear_weight must lie"),
        ({"symmetry": "w"}, "there is no symmetry"),
        ({"stack": "all"}, "there is no stack"),
        ({"upright": [0, 0, 0]}, "upright must be a direction"),
        ({"coverage_weight": -1}, "coverage_weight must lie"),
        ({"texel_density": 0}, "texel_density must be"),
        ({"tiles": 0}, "tiles must lie"),
        ({"texel_density": 1e12}, "texel density"),
        ({"resolution": 3}, "resolution must lie"),
        ({"max_charts": 0}, "max_charts must be at least 1"),
        ({"method": "magic"}, "there is no method"),
        ({"preset": "slow"}, "there is no preset"),
        ({"time_budget": -1.0}, "time_budget"),
        ({"seams": [[0, 99]]}, "seams has the index 99"),
        ({"objects": [1, 2]}, "objects must be one integer for each"),
    ]
    for given, message in options:
        with pytest.raises(fa.InputError, match=message):
            fa.unwrap(vertices, faces, **given)
    with pytest.raises(TypeError, match="no option 'bound'"):
        fa.unwrap(vertices, faces, bound=4.2)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="resolution"):
        fa.unwrap(vertices, faces, resolution=3)
    for option, value in (
        ("resolution", -3),
        ("max_charts", -1),
        ("max_charts", 2.5),
        ("seed", -1),
        ("margin", None),
        ("method", None),
    ):
        with pytest.raises(fa.InputError, match=f"{option} must be"):
            fa.unwrap(vertices, faces, **{option: value})
    with pytest.raises(fa.InputError, match="faces is no array"):
        fa.unwrap(vertices, [[0, 1, [2]], [0, 1, 2]])


def test_odd_meshes_have_layouts() -> None:
    vertices, faces = shapes.sheet()
    # A vertex of no face, a face twice, an edge of three faces, a triangle without area.
    odd = np.concatenate([faces, faces[:1], [[0, 1, 62]], [[3, 3, 4]]])
    layout = fa.unwrap(np.concatenate([vertices, [[9.0, 9, 9]]]), odd)
    assert layout.metrics["flipped_triangles"] == 0
    assert (layout.vertex_map[layout.faces] == odd).all()
    one = fa.unwrap([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert one.metrics["symmetric_dirichlet"] == pytest.approx(4, abs=1e-5)
