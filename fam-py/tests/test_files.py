"""Files, trimesh, and the program beside the package."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import flatten_anything as fa
import shapes

OBJ = """mtllib colours.mtl
o body
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
usemtl red
f 1 2 3 4
usemtl blue
f 1 5 6 2
"""


def test_a_file_is_written_back_with_nothing_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(OBJ)
    file = fa.read(path)
    assert file.vertices.shape == (6, 3) and file.faces is not None and len(file.faces) == 4
    assert file.material_names == ["red", "blue"] and file.uvs is None
    assert file.materials is not None and file.materials.tolist() == [0, 0, 1, 1]
    layout = fa.unwrap(file)
    fa.write(tmp_path / "b.obj", file, layout)
    text = (tmp_path / "b.obj").read_text()
    kept = [line for line in text.splitlines() if not line.startswith(("vt", "f"))]
    assert kept == [line for line in OBJ.splitlines() if not line.startswith("f")]
    assert text.count("\nf ") == 2
    again = fa.read(tmp_path / "b.obj")
    assert again.uvs is not None and np.allclose(again.uvs, layout.uvs, atol=1e-6)
    file.write(tmp_path / "c.glb", again.uvs)
    assert fa.read(tmp_path / "c.glb").uvs is not None
    with pytest.raises(fa.InputError, match=r"uvs must have the shape \[4, 3, 2\]"):
        file.write(tmp_path / "d.obj", layout.vertex_uvs)
    other = fa.unwrap(file.vertices, file.faces[:, ::-1])
    with pytest.raises(fa.InputError, match="that of another mesh"):
        file.write(tmp_path / "d.obj", other)
    per_material = fa.unwrap(file, materials=True)
    assert per_material.squares is not None and len(set(per_material.squares)) == 2
    with pytest.raises(fa.InputError, match="a file has its own faces"):
        fa.unwrap(file, file.faces)
    with pytest.raises(fa.FileError, match="missing.obj"):
        fa.read(tmp_path / "missing.obj")
    with pytest.raises(fa.FileError):
        file.write(tmp_path / "no" / "folder.obj", layout)


PROGRAM = [sys.executable, "-m", "flatten_anything"]


def write_tube(path: Path) -> None:
    """Vertices have a number, 0 on one side of the tube and 1 elsewhere."""
    vertices, faces = shapes.tube()
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        "property float side",
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
        *(f"{x:.9f} {y:.9f} {z:.9f} {int(x > -0.7)}" for x, y, z in vertices),
        *(f"3 {a} {b} {c}" for a, b, c in faces),
    ]
    path.write_text("\n".join(lines) + "\n")


def write_parts(path: Path) -> None:
    """A tube and a cube of other materials, the tube with a hard edge half-way."""
    tube, tube_faces = shapes.tube()
    cube, cube_faces = shapes.cube()
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in (*tube, *(cube + 5))]
    lines += ["o tube", "usemtl skin"]
    is_low = tube[tube_faces].mean(axis=1)[:, 2] < 1
    for group, faces in enumerate((tube_faces[is_low], tube_faces[~is_low]), 1):
        lines += [f"s {group}", *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)]
    lines += ["o cube", "usemtl metal", "s off"]
    lines += ["f " + " ".join(str(v + len(tube) + 1) for v in face) for face in cube_faces]
    path.write_text("\n".join(lines) + "\n")


def test_options_on_files_are_those_of_the_program(tmp_path: Path) -> None:
    write_tube(tmp_path / "tube.ply")
    write_parts(tmp_path / "parts.obj")
    for name in ("tube.ply", "parts.obj"):
        first = fa.read(tmp_path / name)
        uvs = np.array(fa.unwrap(first, distortion_bound=4.002).uvs)
        if first.materials is not None:
            uvs[first.materials == 1, :, 1] *= 0.5
        first.write(tmp_path / f"first-{name}", uvs)
    cases: list[tuple[str, list[str], dict[str, Any]]] = [
        ("tube.ply", ["--paint", "side=2"], {"paint": "side", "paint_weight": 2}),
        ("first-tube.ply", ["--selected", "side"], {"selected": "side"}),
        ("parts.obj", ["--crease-weight", "9"], {"crease_weight": 9}),
        ("parts.obj", ["--per-material"], {"materials": True}),
        ("parts.obj", ["--per-object"], {"per_object": True}),
        ("parts.obj", ["--weight", "metal=2"], {"weight": {"metal": 2}}),
        (
            "parts.obj",
            ["--weight", "tube=0.5", "--weight", "metal=3", "--per-object"],
            {"weight": {"tube": 0.5, "metal": 3}, "per_object": True},
        ),
        ("first-parts.obj", ["--keep-seams"], {"keep_seams": True}),
        ("first-parts.obj", ["--improve"], {"improve": True}),
        ("first-parts.obj", ["--only", "metal"], {"only": ["metal"]}),
        ("first-parts.obj", ["--only", "tube"], {"only": "tube"}),
    ]
    for name, arguments, options in cases:
        call = [*PROGRAM, "unwrap", name, "-q", "-o", "out", *arguments]
        subprocess.run(call, cwd=tmp_path, check=True)
        file = fa.read(tmp_path / name)
        file.write(tmp_path / f"own-{name}", fa.unwrap(file, **options))
        own = (tmp_path / f"own-{name}").read_bytes()
        assert own == (tmp_path / "out" / name).read_bytes(), options
        file.write(tmp_path / f"own-{name}", fa.unwrap(file))
        # The same creases are the cheapest without the option.
        is_same = own == (tmp_path / f"own-{name}").read_bytes()
        assert is_same == ("crease_weight" in options), options
    file = fa.read(tmp_path / "first-parts.obj")
    metal = fa.unwrap(file, only="metal", hard_angle=60)
    assert file.materials is not None and file.uvs is not None
    is_same = (np.asarray(metal.uvs) == file.uvs).all(axis=(1, 2))
    assert is_same[file.materials == 0].all() and not is_same[file.materials == 1].any()
    bare = fa.read(tmp_path / "parts.obj")
    for one, options, message in [
        (bare, {"keep_seams": True}, "no texture coordinates on all of the faces"),
        (bare, {"only": "metal"}, "no texture coordinates on all of the faces"),
        (file, {"only": "hair"}, "no material or object `hair`; there are skin, metal"),
        (bare, {"weight": {"skin": 2, "hair": 3}}, "no material or object `hair`; there are skin"),
        (file, {"weight": {"skin": 0}}, "weight must lie in 0.001..=1000"),
        (file, {"weight": {"skin": "2"}}, "weight of 'skin' must be a number"),
        (file, {"weight": [2, 3]}, "weight must be numbers by names"),
        (file, {"materials": True, "per_object": True}, "squares of their own, not both"),
        (file, {"paint": "side"}, "no attribute `side`"),
        (file, {"selected": [True]}, "selected is the name of an attribute"),
        (file, {"uvs": file.uvs, "keep_seams": True}, "a file has its own faces"),
    ]:
        with pytest.raises(fa.InputError, match=message):
            fa.unwrap(one, **options)


def test_what_has_several_weights_has_the_last(tmp_path: Path) -> None:
    write_parts(tmp_path / "parts.obj")
    file = fa.read(tmp_path / "parts.obj")
    assert file.faces is not None and file.materials is not None
    sides = file.vertices[file.faces[:, 1]] - file.vertices[file.faces[:, 0]]
    for weight, expected in (
        ({"metal": 2}, 2),
        ({"metal": 3, "cube": 2}, 2),
        ({"cube": 2, "metal": 3}, 3),
        ({"tube": 0.5, "skin": 4}, 0.25),
    ):
        uvs = np.asarray(fa.unwrap(file, weight=weight).uvs)
        texels = np.linalg.norm(uvs[:, 1] - uvs[:, 0], axis=1) / np.linalg.norm(sides, axis=1)
        found = [np.median(texels[file.materials == material]) for material in (0, 1)]
        assert found[1] / found[0] == pytest.approx(expected, rel=0.03), weight


def write_torus(path: Path, *sizes: int) -> None:
    vertices, faces = shapes.torus(*sizes)
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def test_seams_follow_the_tears_of_a_map(tmp_path: Path) -> None:
    write_torus(tmp_path / "torus.obj", 14, 8)
    training = ["--method", "neural", "--iterations", "30", "--seed", "1"]
    call = [*PROGRAM, "unwrap", "torus.obj", "-q", "-o", "out", *training, "--tear-weight", "9"]
    subprocess.run(call, cwd=tmp_path, check=True)
    file = fa.read(tmp_path / "torus.obj")
    written = []
    for tear_weight in (9, 0):
        layout = fa.unwrap(
            file, method="neural", iterations=30, seed=1, backend="flex", tear_weight=tear_weight
        )
        file.write(tmp_path / "own.obj", layout)
        written.append((tmp_path / "own.obj").read_bytes())
    assert written[0] == (tmp_path / "out" / "torus.obj").read_bytes() != written[1]


def test_the_program_writes_the_same_bytes(tmp_path: Path) -> None:
    path = tmp_path / "torus.obj"
    write_torus(path)
    call = [*PROGRAM, "unwrap", "torus.obj", "-q", "-o", "out"]
    subprocess.run(call, cwd=tmp_path, check=True)
    file = fa.read(path)
    fa.write(tmp_path / "own.obj", file, fa.unwrap(file))
    written = (tmp_path / "out" / "torus.obj").read_bytes()
    assert (tmp_path / "own.obj").read_bytes() == written
    bad = subprocess.run([*PROGRAM, "unwrap", "none.obj"], cwd=tmp_path, capture_output=True)
    assert bad.returncode == 2 and bad.stderr.startswith(b"fam: none.obj")
    assert subprocess.run([*PROGRAM, "--version"], capture_output=True).returncode == 0


def test_trimesh_meshes_go_there_and_back() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.vertex_attributes["weight"] = np.arange(len(mesh.vertices), dtype=float)
    mesh.face_attributes["part"] = np.arange(len(mesh.faces)) % 7
    mesh.metadata["made"] = {"by": ["hand"]}
    layout = fa.from_trimesh(mesh)
    flat = fa.to_trimesh(mesh, layout)
    assert flat.visual.uv.shape == (len(flat.vertices), 2)
    assert np.allclose(flat.triangles, mesh.triangles)
    assert np.allclose(flat.vertex_normals, mesh.vertex_normals[layout.vertex_map])
    assert (flat.vertex_attributes["weight"] == layout.vertex_map).all()
    assert (flat.face_attributes["part"] == mesh.face_attributes["part"]).all()
    assert np.allclose(flat.area, mesh.area)
    assert flat.metadata["made"] == {"by": ["hand"]}
    flat.metadata["made"]["by"].append("machine")
    flat.face_attributes["part"][0] = 99
    assert mesh.metadata["made"] == {"by": ["hand"]} and mesh.face_attributes["part"][0] == 0


def test_options_of_trimesh_meshes_are_those_of_arrays() -> None:
    mesh = trimesh.Trimesh(*shapes.torus(12, 6), process=False)
    around = [[i * 6, (i + 1) % 12 * 6] for i in range(12)]
    halves = (mesh.triangles_center[:, 0] > 0).astype(int)
    for options in (
        {"seams": around},
        {"no_seams": around},
        {"objects": halves},
        {"materials": halves},
        {"distortion_bound": 4.02},
        {"paint": mesh.vertices[:, 2]},
        {"objects": halves, "per_object": True},
        {"weight": halves + 1.0},
    ):
        given = fa.from_trimesh(mesh, **options)
        expected = fa.unwrap(mesh.vertices, mesh.faces, **options)
        assert (given.uvs == expected.uvs).all() and (given.seams == expected.seams).all()

    class Enough(Exception):
        pass

    def observe(_: fa.Progress) -> None:
        raise Enough

    slow = trimesh.Trimesh(*shapes.torus(160, 80), process=False)
    with pytest.raises(Enough):
        fa.from_trimesh(slow, progress=observe)
    for other in (trimesh.Scene(mesh), trimesh.PointCloud(mesh.vertices)):
        with pytest.raises(fa.InputError, match="takes a Trimesh, not a (Scene|PointCloud)"):
            fa.from_trimesh(other)


def test_uvs_of_trimesh_meshes_are_kept() -> None:
    mesh = trimesh.Trimesh(*shapes.torus(12, 6), process=False)
    halves = mesh.triangles_center[:, 0] > 0
    with pytest.raises(fa.InputError, match="the mesh has no UVs"):
        fa.from_trimesh(mesh, selected=halves)
    first = fa.from_trimesh(mesh)
    flat = fa.to_trimesh(mesh, first)
    again = fa.from_trimesh(flat, selected=halves)
    assert (again.uvs[~halves] == first.uvs[~halves]).all()
    assert (again.uvs[halves] != first.uvs[halves]).any()
    kept = fa.from_trimesh(flat, keep_seams=True)
    assert kept.metrics["seam_length"] == pytest.approx(first.metrics["seam_length"])


def test_materials_of_trimesh_faces_have_squares_of_their_own() -> None:
    mesh = trimesh.Trimesh(*shapes.torus(12, 6), process=False)
    halves = (mesh.triangles_center[:, 0] > 0).astype(int)
    materials = [trimesh.visual.material.PBRMaterial(name=name) for name in "ab"]
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.MultiMaterial(materials), face_materials=halves.tolist()
    )
    layout = fa.from_trimesh(mesh, materials=True)
    assert layout.squares is not None and (layout.squares == halves).all()
    flat = fa.to_trimesh(mesh, layout)
    assert (flat.visual.face_materials == halves).all()
    assert [material.name for material in flat.visual.material] == ["a", "b"]
    assert fa.from_trimesh(mesh).squares is None
    other = fa.from_trimesh(mesh, materials=1 - halves)
    assert other.squares is not None and (other.squares == 1 - halves).all()


def test_colours_of_trimesh_meshes_stay() -> None:
    plain = trimesh.creation.icosphere(subdivisions=1)
    layout = fa.from_trimesh(plain)
    colours = np.random.default_rng(0).integers(0, 256, (len(plain.faces), 4), dtype=np.uint8)
    of_vertices = plain.copy()
    of_vertices.visual.vertex_colors = colours[: len(plain.vertices)]
    flat = fa.to_trimesh(of_vertices, layout)
    kept = flat.visual.vertex_attributes["color"]
    assert (kept == colours[layout.vertex_map]).all()
    assert flat.visual.material.main_color.tolist() == [255] * 4
    # Another layout of the same mesh, which has its colours beside UVs now.
    again = fa.from_trimesh(flat)
    kept_again = fa.to_trimesh(flat, again).visual.vertex_attributes["color"]
    assert (kept_again == kept[again.vertex_map]).all()
    of_faces = plain.copy()
    of_faces.visual.face_colors = colours
    assert (fa.to_trimesh(of_faces, layout).face_attributes["color"] == colours).all()


def coloured() -> tuple[Any, fa.Layout, Any]:
    """A mesh of trimesh with all that files can keep, its layout, and the mesh with that."""
    mesh = trimesh.creation.torus(1.0, 0.4, 12, 8)
    mesh.visual.vertex_colors = np.arange(4 * len(mesh.vertices)).reshape(-1, 4) % 256
    mesh.vertex_attributes["weight"] = np.arange(len(mesh.vertices), dtype=np.float32)
    mesh.metadata["made"] = "by hand"
    layout = fa.from_trimesh(mesh)
    return mesh, layout, fa.to_trimesh(mesh, layout)


def test_a_trimesh_mesh_survives_glb(tmp_path: Path) -> None:
    mesh, layout, flat = coloured()
    flat.export(tmp_path / "a.glb")
    (read,) = trimesh.load(tmp_path / "a.glb").geometry.values()
    assert (read.faces == layout.faces).all()
    assert np.allclose(read.visual.uv, layout.vertex_uvs, atol=1e-6)
    assert np.allclose(read.vertex_normals, mesh.vertex_normals[layout.vertex_map], atol=1e-6)
    colours = mesh.visual.vertex_colors[layout.vertex_map]
    assert (read.visual.vertex_attributes["color"] == colours).all()
    assert (read.vertex_attributes["_weight"].ravel() == layout.vertex_map).all()
    assert read.metadata["made"] == "by hand"


def test_a_trimesh_mesh_survives_obj(tmp_path: Path) -> None:
    mesh, layout, flat = coloured()
    flat.visual.material.name = "red"
    flat.export(tmp_path / "a.obj")
    read = trimesh.load(tmp_path / "a.obj", process=False)
    assert np.allclose(read.triangles, mesh.triangles, atol=1e-6)
    assert np.allclose(read.visual.uv[read.faces], layout.uvs, atol=1e-6)
    normals = mesh.vertex_normals[mesh.faces]
    assert np.allclose(read.vertex_normals[read.faces], normals, atol=1e-6)
    assert read.visual.material.name == "red"


def test_meshes_of_a_scene_share_a_square(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for place, mesh in enumerate((trimesh.creation.icosphere(1), trimesh.creation.box())):
        scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([place] * 3))
    meshes = scene.geometry
    layouts = fa.unwrap_meshes([(mesh.vertices, mesh.faces) for mesh in meshes.values()])
    for name, layout in zip(list(meshes), layouts, strict=True):
        meshes[name] = fa.to_trimesh(meshes[name], layout)
    scene.export(tmp_path / "a.glb")
    read = trimesh.load(tmp_path / "a.glb")
    assert np.allclose(read.bounds, scene.bounds)
    for mesh, layout in zip(read.geometry.values(), layouts, strict=True):
        assert np.allclose(mesh.visual.uv[mesh.faces], layout.uvs, atol=1e-6)


def test_charts_are_packed() -> None:
    vertices, faces = shapes.torus()
    layout = fa.unwrap(vertices, faces, distortion_bound=4.01)
    assert isinstance(layout.uvs, np.ndarray)
    scattered = layout.uvs.copy()
    for chart in np.unique(layout.charts):
        scattered[layout.charts == chart] += 3.0 * chart
    packed = fa.pack(scattered, margin=2)
    assert packed.uvs.min() >= 0 and packed.uvs.max() <= 1 and 0.2 < packed.coverage < 1
    assert packed.margin == 2
    before, after = (fa.measure(vertices, faces, uvs) for uvs in (layout.uvs, packed.uvs))
    assert after["overlapping_pairs"] == 0 and after["charts"] == before["charts"]
    assert after["symmetric_dirichlet"] == pytest.approx(before["symmetric_dirichlet"], abs=1e-4)
    # Not turned at all: every chart was enlarged and moved.
    upright = fa.pack(scattered, turns="none").uvs
    sides, old = (np.roll(uvs, -1, axis=1) - uvs for uvs in (upright, layout.uvs))
    scale = np.abs(sides).sum() / np.abs(old).sum()
    assert np.allclose(sides, scale * old, atol=1e-5)
    with pytest.raises(fa.InputError, match="there are no turns"):
        fa.pack(scattered, turns="some")  # type: ignore[arg-type]
    with pytest.raises(fa.InputError, match="uvs must have the shape"):
        fa.pack(layout.vertex_uvs)
    for options in ({"margin": -5}, {"resolution": 3}, {"margin": float("nan")}):
        with pytest.raises(fa.InputError, match="must"):
            fa.pack(layout.uvs, **options)
