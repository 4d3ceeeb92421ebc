"""The stage of a Ray Data pipeline, on a cluster of this machine."""

import base64
import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flatten_anything as fa
import shapes
from flatten_anything._assets import hash_of

if "FAM_REQUIRE_RAY" not in os.environ:
    pytest.importorskip("ray", reason="Ray is not installed: pip install flatten-anything[ray]")

import ray

import flatten_anything.ray as stage

#: Seconds: more than any of these assets takes on a slow machine.
TIMEOUT = 20.0

#: Of training on a point cloud, so that it takes a second.
OPTIONS: fa.Options = {"iterations": 3, "seed": 1}

Row = dict[str, Any]


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    ray.init(num_cpus=3, include_dashboard=False, log_to_driver=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    yield
    ray.shutdown()


def obj(vertices: np.ndarray, faces: Any) -> str:
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    return "\n".join(lines) + "\n"


def stl(vertices: np.ndarray, faces: np.ndarray) -> str:
    corners = "\n".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in vertices[face])
        + "endloop\nendfacet"
        for face in faces
    )
    return f"solid a\n{corners}\nendsolid a\n"


def write_assets(folder: Path, count: int) -> list[str]:
    """Write meshes of several shapes and formats, all different, and a point cloud."""
    made: list[Callable[[int], Any]] = [
        lambda size: shapes.sheet(3 + size % 3, 3),
        lambda size: shapes.torus(6 + size % 3, 5),
        lambda _: shapes.cube(),
    ]
    paths = [folder / "cloud.xyz"]
    np.savetxt(paths[0], shapes.sheet(5, 5)[0])
    for number in range(count - 1):
        vertices, faces = made[number % 3](number)
        vertices = vertices * (1 + number / 100)
        suffix = ("obj", "ply", "off", "glb", "gltf", "stl")[number % 6 if number % 3 < 2 else 0]
        path = folder / f"mesh-{number}.{suffix}"
        if suffix == "obj":
            path.write_text(obj(vertices, faces))
        elif suffix == "stl":
            path.write_text(stl(vertices, faces))
        else:
            (folder / "made.obj").write_text(obj(vertices, faces))
            file = fa.read(folder / "made.obj")
            file.write(path, np.zeros((len(file.faces), 3, 2)))
            (folder / "made.obj").unlink()
        paths.append(path)
    return [str(path) for path in paths]


def write_hostile(folder: Path) -> dict[str, tuple[str, str]]:
    """Write files that cannot be unwrapped; return state and message of the row of each."""
    vertices, faces = shapes.sheet(2, 2)
    text = obj(vertices, faces)
    (folder / "made.obj").write_text(text)
    file = fa.read(folder / "made.obj")
    file.write(folder / "whole.glb", np.zeros((len(faces), 3, 2)))
    whole = (folder / "whole.glb").read_bytes()
    (folder / "whole.glb").unlink()
    contents = {
        "empty.obj": (b"", "failed", "empty.obj: "),
        "empty.glb": (b"", "failed", "empty.glb: "),
        "garbage.glb": (np.random.default_rng(1).bytes(999), "failed", "garbage.glb: "),
        "nan.obj": (text.replace("v 0.0", "v nan", 1).encode(), "failed", "nan.obj: "),
        "cut.glb": (whole[: len(whole) // 2], "failed", "cut.glb: "),
        "index.obj": (f"{text}f 1 2 4000000000\n".encode(), "failed", "refers to vertex 4000000"),
        "flat.obj": (obj(0 * vertices, faces).encode(), "failed", "area"),
        "photo.png": (b"\x89PNG\r\n\x1a\n", "failed", "photo.png: "),
    }
    expected = {"missing.obj": ("failed", "missing.obj: No such file")}
    for name, (content, state, message) in contents.items():
        (folder / name).write_bytes(content)
        expected[name] = (state, message)
    os.mkfifo(folder / "hanging.obj")
    expected["hanging.obj"] = ("timed-out", f"not done within {TIMEOUT:g} s")
    os.mkfifo(folder / "deadly.obj")
    expected["deadly.obj"] = ("failed", r"killed by signal 9 \(SIGKILL\), .*; tried 3 times")
    return {str(folder / name): row for name, row in expected.items()}


def processes(argument: str) -> list[int]:
    """The processes with an argument."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if argument in (folder / "cmdline").read_text().split("\0"):
                found.append(int(folder.name))
    return found


def readers(path: str) -> list[int]:
    """The children that have a file open."""
    found = []
    for process in processes("flatten_anything._isolated"):
        with contextlib.suppress(OSError):
            links = [os.readlink(link) for link in Path(f"/proc/{process}/fd").iterdir()]
            if path in links:
                found.append(process)
    return found


def parent(process: int) -> int:
    return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])


def is_of_this_cluster(process: int) -> bool:
    while process > 1 and process != os.getpid():
        process = parent(process)
    return process == os.getpid()


class Killer(threading.Thread):
    """Kills every child that reads a pipe, and workers as soon as there are enough results."""

    def __init__(self, pipe: str, out: Path | None = None, results: int = 0) -> None:
        super().__init__(daemon=True)
        self.pipe, self.out, self.results = pipe, out, results
        self.children = 0
        self.workers: list[int] = []
        self.stopped = threading.Event()

    def run(self) -> None:
        while not self.stopped.wait(0.02):
            self.kill_reader()
            if self.out is not None and not self.workers:
                self.kill_worker(self.out)

    def kill_reader(self) -> None:
        try:
            # A reader waits until somebody writes; without one this fails.
            writer = os.open(self.pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:
            return
        while not (found := readers(self.pipe)):
            time.sleep(0.01)
        for process in found:
            os.kill(process, signal.SIGKILL)
            self.children += 1
        while readers(self.pipe):
            time.sleep(0.01)
        os.close(writer)

    def kill_worker(self, out: Path) -> None:
        if len(list(out.glob("*/*/record.json"))) < self.results:
            return
        for process in processes("flatten_anything._isolated"):
            with contextlib.suppress(OSError):
                worker = parent(process)
                if is_of_this_cluster(worker) and worker != os.getpid():
                    os.kill(worker, signal.SIGKILL)
                    self.workers.append(worker)
                    return

    def stop(self) -> None:
        self.stopped.set()
        self.join()


def rows_of(dataset: Any) -> dict[str, Row]:
    """The rows by their paths, of which none is there twice."""
    rows = dataset.take_all()
    found = {row["path"]: row for row in rows}
    assert len(found) == len(rows)
    return found


def equal(one: Row, other: Row) -> bool:
    assert one.keys() == other.keys()
    return all(np.array_equal(one[name], other[name]) for name in one)


def direct(path: str) -> np.ndarray:
    """The UVs that the package finds without Ray."""
    file = fa.read(path)
    if file.faces is None:
        return fa.unwrap_points(file.vertices, **OPTIONS).uvs[:, None]
    return np.asarray(fa.unwrap(file, **OPTIONS).uvs)


def stamps(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def test_every_asset_becomes_one_row(cluster: None, tmp_path: Path) -> None:
    good = write_assets(tmp_path, 189)
    hostile = write_hostile(tmp_path)
    # Hostile assets are spread over the others.
    paths = list(good)
    for number, path in enumerate(hostile):
        paths.insert(7 + 17 * number, path)
    assert len(paths) == 200
    out = tmp_path / "out"
    killer = Killer(str(tmp_path / "deadly.obj"), out, results=60)
    killer.start()
    rows = rows_of(stage.unwrap(paths, out=out, timeout=TIMEOUT, concurrency=2, **OPTIONS))
    killer.stop()
    assert len(killer.workers) == 1 and killer.children >= 3
    assert sorted(rows) == sorted(paths)
    for path, (state, message) in hostile.items():
        row = rows[path]
        assert row["state"] == state, row["message"]
        assert pytest.raises(Exception, match=message).matches(Exception(row["message"]))
        assert "\n" not in row["message"] and row["uvs"].shape == (0, 3, 2)
        assert (row["metrics"], list(row["warnings"]), row["file"]) == ("{}", [], "")
    for path in good:
        row = rows[path]
        assert (row["state"], row["message"]) == ("done", "")
        assert row["uvs"].dtype == np.float32 and np.array_equal(row["uvs"], direct(path)), path
        assert row["hash"] == hashlib.sha256(Path(path).read_bytes()).hexdigest()
        assert 0 < row["seconds"] < TIMEOUT
        written = fa.read(row["file"])
        assert Path(row["file"]).suffix == Path(path).suffix.replace("stl", "obj")
        assert written.uvs is not None
        assert np.allclose(written.uvs.reshape(row["uvs"].shape), row["uvs"], atol=1e-6)

    # Another run computes nothing and says the same.
    before = stamps(out)
    again = rows_of(stage.unwrap(good, out=out, concurrency=2, batch=10, **OPTIONS))
    assert all(equal(rows[path], again[path]) for path in good) and stamps(out) == before


def test_contents_become_rows(cluster: None, tmp_path: Path) -> None:
    paths = write_assets(tmp_path, 7)
    dataset = ray.data.read_binary_files(paths, include_paths=True)
    rows = rows_of(stage.unwrap(dataset, concurrency=1, memory=10**9, **OPTIONS))
    assert sorted(rows) == sorted(paths)
    for path in paths:
        assert rows[path]["message"] == "" and rows[path]["file"] == ""
        assert np.array_equal(rows[path]["uvs"], direct(path))
    assert stage.unwrap([]).take_all() == []


def test_options_are_checked_at_once() -> None:
    with pytest.raises(TypeError, match="no option 'bound'"):
        stage.unwrap(["a.obj"], bound=4.2)  # type: ignore[call-arg]
    with pytest.raises(fa.InputError, match="margin must be a number"):
        stage.unwrap(["a.obj"], margin="wide")  # type: ignore[arg-type]
    with pytest.raises(fa.InputError, match="timeout must be above 0"):
        stage.unwrap(["a.obj"], timeout=0.0)
    with pytest.raises(fa.InputError, match="batch from 1 on"):
        stage.unwrap(["a.obj"], batch=0)
    with pytest.raises(fa.InputError, match="memory must be at least"):
        stage.unwrap(["a.obj"], memory=1_000_000)
    with pytest.raises(TypeError):
        stage.unwrap(["a.obj"], memory=1e9)  # type: ignore[arg-type]


def worker(out: Path | None = None, **given: Any) -> Callable[[Row], Row]:
    """A worker of the stage in this process."""
    options = fa._options.complete({**OPTIONS, **given.pop("options", {})})
    store = None if out is None else stage.Store(str(out))
    settings = {"timeout": TIMEOUT, "retries": 2, "threads": 1, "memory": None, **given}
    return stage._Worker(store=store, options=options, **settings)


def test_only_what_dies_is_tried_again(tmp_path: Path) -> None:
    pipe = tmp_path / "deadly.obj"
    os.mkfifo(pipe)
    killer = Killer(str(pipe))
    killer.start()
    row = worker(retries=1)({"path": str(pipe)})
    killer.stop()
    assert killer.children == 2 and row["message"].endswith("; tried 2 times")
    started = time.monotonic()
    row = worker(timeout=2.0)({"path": str(pipe)})
    assert row["state"] == "timed-out" and 2 <= row["seconds"] <= time.monotonic() - started < 4
    assert row["message"] == "not done within 2 s"


def test_a_huge_asset_fails_alone(tmp_path: Path) -> None:
    large, small = tmp_path / "large.obj", tmp_path / "small.obj"
    for path, cells in ((large, 500), (small, 20)):
        path.write_text(obj(*shapes.torus(cells, cells)))
    run = worker(retries=5, memory=stage._LEAST_MEMORY)
    row = run({"path": str(large)})
    assert row["state"] == "failed", row
    assert re.search("^[Mm]emory.*; tried 2 times$", row["message"]), row["message"]
    assert run({"path": str(small)})["state"] == "done"


def test_results_are_kept_by_content(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (path,) = write_assets(tmp_path, 2)[1:]
    work = worker(out)
    first = work({"path": path})
    assert first["state"] == "done"
    before = stamps(out)
    # The same content elsewhere, and as bytes, is the same asset.
    copy = str(shutil.copy(path, tmp_path / "copy.obj"))
    for row in ({"path": copy}, {"path": copy, "bytes": Path(path).read_bytes()}):
        assert equal(work(row), {**first, "path": copy}) and stamps(out) == before
    # Another content, another format and another option are not.
    other = str(shutil.copy(path, tmp_path / "other.obj"))
    with open(other, "a") as file:
        file.write("# other\n")
    assert work({"path": other})["file"] != first["file"]
    changed = worker(out, options={"margin": 8.0})({"path": path})
    assert changed["state"] == "done" and changed["file"] != first["file"]
    assert not np.array_equal(changed["uvs"], first["uvs"])
    assert stage._key("a", ".obj", {}) != stage._key("a", ".ply", {})
    # A result that is not complete is made again; a failure is not kept.
    (Path(first["file"]).parent / "record.json").write_text("{")
    assert work({"path": path})["seconds"] != first["seconds"]
    late = tmp_path / "late.obj"
    assert work({"path": str(late)})["state"] == "failed"
    shutil.copy(path, late)
    assert work({"path": str(late)})["state"] == "done"
    # Nothing is left behind.
    assert not [name for name in out.rglob("*") if name.name.startswith(".")]


def test_the_files_that_an_asset_names_count(tmp_path: Path) -> None:
    vertices, faces = shapes.sheet()
    path = tmp_path / "a.obj"
    path.write_text(f"mtllib my colours.mtl\nusemtl red\n{obj(vertices, faces)}")
    hashes = {hash_of(str(path))}
    library = tmp_path / "my colours.mtl"
    library.write_text("newmtl red\nmap_Kd -s 1 1 1 red.png\n")
    hashes.add(hash_of(str(path)))
    for content in (b"1", b"2"):
        (tmp_path / "red.png").write_bytes(content)
        hashes.add(hash_of(str(path)))
    assert len(hashes) == 4
    row = worker(tmp_path / "out")({"path": str(path)})
    folder = Path(row["file"]).parent
    assert (folder / "my colours.mtl").is_file() and (folder / "red.png").read_bytes() == b"2"
    # A buffer of glTF is a file, too.
    scene, buffer = tmp_path / "a.gltf", tmp_path / "a 1.bin"
    file = fa.read(path)
    file.write(scene, np.zeros((len(faces), 3, 2)))
    content = json.loads(scene.read_text())
    data = base64.b64decode(content["buffers"][0]["uri"].partition(",")[2])
    content["buffers"][0]["uri"] = "a%201.bin"
    scene.write_text(json.dumps(content))
    hashes = {hash_of(str(scene))}
    for moved in (data, data[:8] + np.float32(2).tobytes() + data[12:]):
        buffer.write_bytes(moved)
        hashes.add(hash_of(str(scene)))
    assert len(hashes) == 3


def test_no_row_ends_the_worker(tmp_path: Path) -> None:
    work = worker()
    assert work({})["message"] == "the row has neither path nor bytes"
    assert work({"path": None, "bytes": b"\0"})["message"].startswith("bytes: ")
    assert work({"path": "s3://x/a.glb", "bytes": b"\0"})["message"].startswith("s3://x/a.glb: ")
    assert work({"path": 3})["message"].startswith("3: No such file")
    assert work({"path": "a\0b"})["message"].startswith("ValueError: ")
    assert work({"path": "x", "bytes": 5})["state"] == "failed"
    # Neither does a store that cannot be written to.
    (path,) = write_assets(tmp_path, 2)[1:]
    (tmp_path / "out").write_text("a file")
    row = worker(tmp_path / "out")({"path": path})
    assert row["state"] == "failed" and row["hash"] and row["uvs"].shape == (0, 3, 2)
    assert row["message"]


def test_an_asset_that_changes_meanwhile_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path,) = write_assets(tmp_path, 2)[1:]
    work = worker(tmp_path / "out")
    call = work._child.call

    def late(function: Any, *args: Any, timeout: float) -> Any:
        found = call(function, *args, timeout=timeout)
        with open(path, "a") as file:
            file.write("# changed\n")
        return found

    monkeypatch.setattr(work._child, "call", late)
    assert work({"path": path})["message"].endswith("it was changed while it was unwrapped")
    assert stamps(tmp_path / "out") == {}


def test_ray_is_imported_only_for_the_stage() -> None:
    code = "import sys, flatten_anything; print('ray' in sys.modules or 'pyarrow' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
    code = "import sys; sys.modules['ray'] = None; import flatten_anything.ray"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    last = done.stderr.splitlines()[-1]
    assert last == (
        "ImportError: flatten_anything.ray needs Ray: pip install flatten-anything[ray]"
    )
