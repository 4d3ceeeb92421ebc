"""How many assets per second the Ray stage unwraps, and what more cores would do.

    python benches/scale.py [--cores N] [--assets 200] [--batch 1] [FOLDER]

Prints tables in Markdown: for 1, 2, 4… up to N workers of one CPU each the seconds, assets per
second and the speed-up; the seconds per asset; and a model of more cores. FOLDER has assets of the
user; otherwise they are generated.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import ray

import flatten_anything.ray as stage

#: Bytes per second that a shared file system or an object store gives to all machines together:
#: those of a link of 10 Gbit/s.
STORE_RATE = 1.25e9

#: How often an asset goes through the store: it is read twice, and its result is written.
PASSES = 3

#: Rows without work, by which the scheduler's time for a row is measured.
IDLE_ROWS = 400

#: How many assets the model has for each one here, so that many cores have work.
COPIES = 10_000


def generate(folder: Path, count: int) -> None:
    """Write bumpy spheres of 200 to 3000 triangles."""
    random = np.random.default_rng(1)
    for number in range(count):
        columns, rows, waves = random.integers([10, 10, 2], [40, 40, 5])
        angles = np.linspace(0, 2 * np.pi, columns, endpoint=False)
        u, v = np.meshgrid(angles, np.linspace(0.1, 3.0, rows))
        radius = 1 + 0.1 * np.sin(waves * u) * np.sin(3 * v)
        points = radius * [np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)]
        index = np.arange(columns * rows).reshape(rows, columns) + 1
        right = np.roll(index, -1, axis=1)
        quads = np.stack([index[:-1], right[:-1], right[1:], index[1:]], axis=-1)
        with open(folder / f"{number}.obj", "w") as file:
            np.savetxt(file, points.reshape(3, -1).T, "v %.6f %.6f %.6f")
            np.savetxt(file, quads.reshape(-1, 4), "f %d %d %d %d")


def run(
    paths: list[str], workers: int, batch: int, out: str | None = None
) -> tuple[float, list[Any]]:
    """Return the seconds from start to end, and the rows."""
    started = time.perf_counter()
    rows = stage.unwrap(paths, concurrency=workers, batch=batch, out=out).take_all()
    return time.perf_counter() - started, rows


def model(seconds: list[float], size: int, startup: float, per_row: float) -> None:
    """Print what takes how long with more cores."""
    assets = COPIES * len(seconds)
    print("\nModel: start-up + the largest of work / cores, longest asset, scheduler and store;")
    print(f"{assets} assets like these.\n")
    print("| cores | seconds | assets/s | bound by |\n| --: | --: | --: | --- |")
    for cores in (10, 100, 1000):
        bounds = {
            "work": COPIES * sum(seconds) / cores,
            "longest asset": max(seconds),
            "scheduler": assets * per_row,
            "store": COPIES * PASSES * size / STORE_RATE,
        }
        bound = max(bounds, key=lambda name: bounds[name])
        total = startup + bounds[bound]
        print(f"| {cores} | {total:.0f} | {assets / total:.0f} | {bound} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--cores", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--assets", type=int, default=200)
    parser.add_argument("--batch", type=int, default=1)
    arguments = parser.parse_args()
    # One more for Ray's own tasks, which take hardly any time.
    ray.init(num_cpus=arguments.cores + 1, include_dashboard=False, log_to_driver=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or f"{temporary}/assets")
        if arguments.folder is None:
            folder.mkdir()
            generate(folder, arguments.assets)
        paths = [str(path) for path in sorted(folder.rglob("*")) if path.is_file()]
        size = sum(Path(path).stat().st_size for path in paths)
        print(f"{len(paths)} assets of {size / len(paths) / 1e3:.0f} kB on average\n")
        print("| workers | start-up s | s after it | assets/s | speed-up |")
        print("| --: | --: | --: | --: | --: |")
        batch = arguments.batch
        run(["missing"], 1, batch)  # The first run also starts processes that stay.
        counts = {2**power for power in range(12) if 2**power < arguments.cores}
        first, seconds = 0.0, []
        for workers in sorted(counts | {arguments.cores}):
            startup, _ = run(["missing"] * workers * batch, workers, batch)
            total, rows = run(paths, workers, batch, f"{temporary}/{workers}")
            took = total - startup
            first, seconds = first or took, seconds or [row["seconds"] for row in rows]
            rate, faster = len(paths) / took, first / took
            print(f"| {workers} | {startup:.1f} | {took:.1f} | {rate:.1f} | {faster:.2f} |")
        idle, _ = run(["missing"] * IDLE_ROWS, arguments.cores, batch)
        per_row = max(0.0, idle - startup) / IDLE_ROWS
    failed = sum(row["state"] != "done" for row in rows)
    middle, high = np.percentile(seconds, [50, 95])
    print(f"\nSeconds per asset: median {middle:.3f}, p95 {high:.3f}, max {max(seconds):.3f};")
    print(f"{failed} failed. A row without work takes the scheduler {1e3 * per_row:.1f} ms.")
    model(seconds, size, startup, per_row)


if __name__ == "__main__":
    main()
