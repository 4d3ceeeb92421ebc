"""Files, trimesh, and the program beside the package."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

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


def test_the_program_writes_the_same_bytes(tmp_path: Path) -> None:
    program = [sys.executable, "-m", "flatten_anything"]
    vertices, faces = shapes.torus()
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path = tmp_path / "torus.obj"
    path.write_text("\n".join(lines) + "\n")
    call = [*program, "unwrap", "torus.obj", "-q", "-o", "out"]
    subprocess.run(call, cwd=tmp_path, check=True)
    file = fa.read(path)
    fa.write(tmp_path / "own.obj", file, fa.unwrap(file))
    written = (tmp_path / "out" / "torus.obj").read_bytes()
    assert (tmp_path / "own.obj").read_bytes() == written
    bad = subprocess.run([*program, "unwrap", "none.obj"], cwd=tmp_path, capture_output=True)
    assert bad.returncode == 2 and bad.stderr.startswith(b"fam: none.obj")
    assert subprocess.run([*program, "--version"], capture_output=True).returncode == 0


def test_trimesh_meshes_go_there_and_back() -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=2)
    mesh.vertex_attributes["weight"] = np.arange(len(mesh.vertices), dtype=float)
    layout = fa.from_trimesh(mesh)
    flat = fa.to_trimesh(mesh, layout)
    assert flat.visual.uv.shape == (len(flat.vertices), 2)
    assert np.allclose(flat.triangles, mesh.triangles)
    assert (flat.vertex_attributes["weight"] == layout.vertex_map).all()
    assert np.allclose(flat.area, mesh.area)


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
    with pytest.raises(fa.InputError, match="uvs must have the shape"):
        fa.pack(layout.vertex_uvs)
    for options in ({"margin": -5}, {"resolution": 3}, {"margin": float("nan")}):
        with pytest.raises(fa.InputError, match="must"):
            fa.pack(layout.uvs, **options)
