"""Progress, cancelling, threads and processes."""

import asyncio
import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import CancelledError, ThreadPoolExecutor, wait

import numpy as np
import pytest

import flatten_anything as fa
import shapes


def bumpy() -> shapes.Mesh:
    """A mesh that takes seconds."""
    vertices, faces = shapes.torus(160, 80)
    waves = np.sin(5 * vertices).sum(axis=1, keepdims=True)
    return vertices * (1 + 0.1 * waves), faces


def test_progress_is_told() -> None:
    vertices, faces = bumpy()
    seen: list[fa.Progress] = []
    fa.unwrap(vertices, faces, progress=seen.append)
    stages = {now.stage for now in seen}
    assert "flatten" in stages and stages <= {"start", "flatten", "pack"}
    assert all(0 <= now.fraction <= 1 for now in seen)
    assert any(now.energy is not None and now.energy >= 4 for now in seen)


def test_what_the_observer_raises_ends_it() -> None:
    class Enough(Exception):
        pass

    def observe(_: fa.Progress) -> None:
        raise Enough

    started = time.monotonic()
    with pytest.raises(Enough):
        fa.unwrap(*bumpy(), distortion_bound=4.005, progress=observe)
    # The whole of it takes several times as long.
    assert time.monotonic() - started < 5


def test_an_interrupt_ends_it_at_once() -> None:
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        fa.unwrap(*bumpy(), distortion_bound=4.005)
    assert time.monotonic() - started < 5


def test_jobs_run_in_the_background() -> None:
    job = fa.submit(fa.unwrap, *shapes.torus())
    layout = job.result(timeout=60)
    assert layout.metrics["charts"] == 1 and job.done() and not job.cancel()
    failed = fa.submit(fa.unwrap, np.zeros((3, 3)), [[0, 1, 2]])
    with pytest.raises(fa.InputError):
        failed.result(timeout=60)
    cancelled = fa.submit(fa.unwrap, *bumpy(), distortion_bound=4.01)
    assert cancelled.cancel()
    with pytest.raises(CancelledError):
        cancelled.result(timeout=60)
    assert cancelled.cancelled()
    # Whoever waits for several is told, too; and what is cancelled has no result.
    jobs = [fa.submit(fa.unwrap, *shapes.sheet()) for _ in range(20)]
    stopped = [job for job in jobs if job.cancel()]
    assert stopped
    assert wait(jobs, timeout=60).not_done == set()
    assert all(job.cancelled() for job in stopped)

    async def awaited() -> fa.Layout:
        return await asyncio.wrap_future(fa.submit(fa.unwrap, *shapes.sheet()))

    assert asyncio.run(awaited()).metrics["charts"] == 1


def test_threads_get_the_same_layouts() -> None:
    meshes = [shapes.torus(12 + 2 * k, 12) for k in range(8)]
    alone = [fa.unwrap(*mesh).vertex_uvs for mesh in meshes]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda mesh: fa.unwrap(*mesh).vertex_uvs, meshes))
    assert all((a == b).all() for a, b in zip(alone, together, strict=True))


def layout_of_torus(iterations: int) -> fa.Layout:
    """A layout, after use of all else that has threads."""
    map_ = fa.train(*shapes.sheet(), iterations=iterations)
    map_.seams(shapes.sheet()[0])
    return fa.unwrap(*shapes.torus())


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_processes_work(method: str) -> None:
    # The parent has threads by now, of which a fork has none.
    own = layout_of_torus(1)
    with multiprocessing.get_context(method).Pool(2) as pool:
        found = pool.map_async(layout_of_torus, [1, 2, 1]).get(timeout=120)
    assert all((layout.uvs == own.uvs).all() for layout in found)


def test_memory_does_not_grow() -> None:
    vertices, faces = shapes.sheet()
    resource = pytest.importorskip("resource")

    def peak() -> int:
        return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)

    for _ in range(100):
        fa.unwrap(vertices, faces)
    before = peak()
    for _ in range(400):
        fa.unwrap(vertices, faces)
    assert peak() - before < 8 * 1024, "KiB"
