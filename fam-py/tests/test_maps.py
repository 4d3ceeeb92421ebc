"""Point clouds and trained maps."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import flatten_anything as fa
import shapes


@pytest.fixture(scope="module")
def trained() -> fa.Map:
    return fa.train(*shapes.sheet(16, 12), iterations=60, seed=1)


def test_a_cloud_has_uvs() -> None:
    vertices, _ = shapes.sheet(24, 20)
    seen: list[fa.Progress] = []
    layout = fa.unwrap_points(vertices, iterations=40, progress=seen.append)
    assert layout.uvs.shape == (len(vertices), 2) and layout.uvs.dtype == np.float32
    assert layout.uvs.min() >= 0 and layout.uvs.max() <= 1
    assert "train" in {now.stage for now in seen}
    assert layout.map is not None and layout.map.uvs(vertices).shape == layout.uvs.shape
    normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    with_normals = fa.unwrap_points(vertices, normals, iterations=5)
    assert with_normals.uvs.shape == layout.uvs.shape
    with pytest.raises(fa.InputError, match="normals must have the shape"):
        fa.unwrap_points(vertices, normals[:5])
    with pytest.raises(fa.InputError, match="a point cloud needs"):
        fa.unwrap_points(vertices, method="direct")


def test_a_map_gives_uvs_to_any_point(trained: fa.Map) -> None:
    vertices, _ = shapes.sheet(16, 12)
    uvs = trained.uvs(vertices)
    assert uvs.shape == (len(vertices), 2) and np.isfinite(uvs).all()
    assert trained.uvs(np.zeros((0, 3))).shape == (0, 2)
    assert trained.seams(vertices).dtype == np.uint32
    with pytest.raises(fa.InputError, match="points must have the shape"):
        trained.uvs([1.0, 2.0, 3.0])


def test_the_jacobian_is_that_of_the_uvs(trained: fa.Map) -> None:
    points = shapes.sheet(16, 12)[0][5::40] + 0.03
    jacobian = trained.jacobian(points)
    assert jacobian.shape == (len(points), 2, 3)
    step = 1e-2
    for axis in range(3):
        offset = step * np.eye(3)[axis]
        high, low = trained.uvs(points + offset), trained.uvs(points - offset)
        quotient = (high.astype(float) - low) / (2 * step)
        assert np.allclose(jacobian[:, :, axis], quotient, atol=2e-3), axis


def test_training_takes_its_own_options() -> None:
    vertices, faces = shapes.sheet()
    with pytest.raises(fa.InputError, match="normals are those of a cloud"):
        fa.train(vertices, faces, normals=vertices)
    with pytest.raises(fa.InputError, match="there is no preset"):
        fa.train(vertices, faces, preset="slow")


def test_maps_are_saved_and_pickled(trained: fa.Map, tmp_path: Path) -> None:
    points = shapes.sheet(5, 5)[0]
    path = tmp_path / "model.safetensors"
    trained.save(path)
    loaded, pickled = fa.Map.load(path), pickle.loads(pickle.dumps(trained))
    assert (loaded.uvs(points) == pickled.uvs(points)).all()
    # Weights in another order in memory round differently.
    assert np.allclose(loaded.uvs(points), trained.uvs(points), atol=1e-6)
    path.write_bytes(b"nothing")
    with pytest.raises(fa.FileError, match="model.safetensors: "):
        fa.Map.load(path)
    with pytest.raises(OSError, match="No such file"):
        fa.Map.load(tmp_path / "missing")


def test_a_mesh_is_laid_out_along_its_map() -> None:
    vertices, faces = shapes.torus()
    layout = fa.unwrap(vertices, faces, method="neural", iterations=20, seed=3)
    assert layout.map is not None and layout.metrics["symmetric_dirichlet"] <= 4.1
