"""Thousands of assets on a Ray cluster: a stage of a Ray Data pipeline.

>>> import flatten_anything.ray  # doctest: +SKIP
>>> rows = flatten_anything.ray.unwrap(["a.obj", "b.glb"], out="s3://bucket/uvs")  # doctest: +SKIP
>>> rows.drop_columns(["uvs"]).write_parquet("s3://bucket/summary")  # doctest: +SKIP

Every asset becomes one row. One that cannot be unwrapped becomes a row with the reason: it runs in
a process of its own, so it ends neither the dataset nor its worker.
"""

from __future__ import annotations

import hashlib
import json
import math
import operator
import os
import re
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from ._assets import hash_of, unwrap_file
from ._errors import InputError
from ._isolated import Child, Died, OutOfMemory, TimedOut, line_of
from ._native import __version__
from ._options import Options, complete

try:
    import ray.data

    from ._store import Store
except ImportError as error:
    raise ImportError(
        "flatten_anything.ray needs Ray: pip install flatten-anything[ray]"
    ) from error

__all__ = ["unwrap"]

#: The end of a name by which readers and writers tell the format.
_SUFFIX = re.compile(r"\.\w+$", re.ASCII)

#: Bytes that the process takes for any asset.
_LEAST_MEMORY = 300_000_000


def unwrap(
    assets: ray.data.Dataset | Sequence[str | os.PathLike[str]],
    *,
    timeout: float = 600.0,
    retries: int = 2,
    out: str | os.PathLike[str] | None = None,
    concurrency: int | tuple[int, int] | None = None,
    batch: int = 1,
    num_cpus: float = 1,
    num_gpus: float = 0,
    memory: int | None = None,
    **options: Unpack[Options],
) -> ray.data.Dataset:
    """Return a dataset with one row for every asset, in any order.

    Arguments:
    - `assets`: paths of files that all machines see, or a dataset. Its rows have the column `path`,
      or `bytes`, the content of a file, and `path`, its name, as
      `ray.data.read_binary_files(..., include_paths=True)` has them. Content has no files beside
      it: materials of OBJ and buffers of glTF must be in it.
    - `timeout`: seconds that an asset may take.
    - `retries`: how often an asset is tried again whose process died. An asset that cannot be read
      or takes too long is not tried again, since it would end as before.
    - `out`: a folder that all machines see, or a URI that `pyarrow.fs` understands, such as
      `s3://bucket/folder`. Every result is kept there under a key, the hash of the content of the
      asset, the options and the version of this package. An asset whose result is there is not
      unwrapped. Failures are not kept, so the next run tries them again.
    - `concurrency`: how many workers there are, or the least and the most; by default as many as
      the cluster has room for.
    - `batch`: how many assets a worker takes at once. Ray needs some 10 ms each time, for one
      worker after the other: take more where all workers together end assets faster than that. A
      worker that is killed does its whole batch again, but for results that are in `out`.
    - `num_cpus`, `num_gpus`: those of a worker. It uses as many threads as it has CPUs.
    - `memory`: bytes that the process of a worker's asset may hold. Ray starts no more workers on a
      machine than have room there, and an asset that needs more fails and harms no other. A mesh
      takes some 1,500 bytes per triangle, and the process 300 MB in any case; the worker itself
      takes as much beside it. Only Linux enforces it.
    - `options`: those of `Options`.

    Columns:
    - `path`: that of the asset, empty if there is none.
    - `hash`: SHA-256 of the asset, followed by the files that it refers to, such as buffers and
      materials, in hexadecimal digits; empty if it cannot be read.
    - `state`: `done`, `failed` or `timed-out`.
    - `seconds`: how long it took; of a result that was there, how long that took.
    - `message`: the reason in one line; empty if it is done.
    - `uvs`: of triangles' corners `[M, 3, 2]`, of points `[N, 1, 2]`, in single precision;
      `[0, 3, 2]` if it is not done.
    - `metrics`: `Layout.metrics` as JSON; `{}` for points, and if it is not done.
    - `warnings`: where the layout falls short of what was asked for, in sentences.
    - `file`: where the asset with its new UVs is, in its own format, and STL as OBJ; empty
      without `out`.

    Raises `TypeError` or `InputError` for options that make no sense.

    """
    if not timeout > 0 or retries < 0 or batch < 1:
        raise InputError("timeout must be above 0, retries from 0 on, and batch from 1 on")
    if memory is not None:
        memory = operator.index(memory)
        if memory < _LEAST_MEMORY:
            raise InputError(f"memory must be at least {_LEAST_MEMORY:,} bytes")
    # Ray starts a killed worker again and repeats the block that it had, so a block is a batch.
    if isinstance(assets, ray.data.Dataset):
        batches = assets.repartition(target_num_rows_per_block=batch)
    else:
        # Workers have another working directory.
        items = [{"path": os.path.abspath(path)} for path in assets]
        blocks = max(1, math.ceil(len(items) / batch))
        batches = ray.data.from_items(items, override_num_blocks=blocks)
    low, high = concurrency if isinstance(concurrency, tuple) else (concurrency, concurrency)
    # Ray's annotation leaves out classes.
    worker: Any = _Worker
    return batches.map(
        worker,
        fn_constructor_kwargs={
            "timeout": timeout,
            "retries": retries,
            "store": None if out is None else Store(os.fspath(out)),
            "threads": max(1, int(num_cpus)),
            "memory": memory,
            "options": complete(options),
        },
        # An asset may take minutes: none waits for one while another worker is idle.
        compute=ray.data.ActorPoolStrategy(
            min_size=low, max_size=high, max_tasks_in_flight_per_actor=1
        ),
        num_cpus=num_cpus,
        num_gpus=num_gpus,
        memory=memory,
    )


class _Worker:
    """Unwraps asset after asset in a child that only crashes and timeouts end."""

    def __init__(
        self,
        timeout: float,
        retries: int,
        store: Store | None,
        threads: int,
        memory: int | None,
        options: Options,
    ) -> None:
        self._timeout = timeout
        self._retries = retries
        self._store = store
        self._options = options
        self._child = Child(threads, memory)

    def __call__(self, asset: dict[str, Any]) -> dict[str, Any]:
        """Return the row of an asset."""
        started = time.monotonic()
        row: dict[str, Any] = {
            "path": str(asset.get("path") or ""),
            "hash": "",
            "state": "failed",
            "seconds": 0.0,
            "message": "",
            "uvs": np.empty((0, 3, 2), np.float32),
            "metrics": "{}",
            "warnings": [],
            "file": "",
        }
        with tempfile.TemporaryDirectory(prefix="flatten-anything-") as folder:
            suffix = _suffix(row["path"])
            copy = Path(folder, f"asset{suffix}")
            try:
                if asset.get("bytes") is not None:
                    copy.write_bytes(asset["bytes"])
                    path = str(copy)
                else:
                    path = row["path"]
                # STL has no place for UVs.
                target = Path(folder, "out", f"asset{'.obj' if suffix == '.stl' else suffix}")
                self._complete(row, path, suffix, target, started)
            except TimedOut:
                row["state"] = "timed-out"
                row["message"] = f"not done within {self._timeout:g} s"
            except Exception as error:
                # Whatever an asset or the store does, the other assets go on.
                row["message"] = line_of(error).replace(str(copy), row["path"] or "bytes")
        if row["state"] != "done":
            row["seconds"] = time.monotonic() - started
        return row

    def _complete(
        self, row: dict[str, Any], path: str, suffix: str, target: Path, started: float
    ) -> None:
        """Fill in the row of an asset: first its hash, then all else at once."""
        if not path:
            raise InputError("the row has neither path nor bytes")
        row["hash"] = self._call(started, hash_of, path)
        if self._store is None:
            found = self._call(started, unwrap_file, path, row["hash"], self._options, None)
            row.update(found, state="done", seconds=time.monotonic() - started)
            return
        key = _key(row["hash"], suffix, self._options)
        kept = self._store.get(key)
        if kept is None:
            target.parent.mkdir()
            found = self._call(started, unwrap_file, path, row["hash"], self._options, str(target))
            done = {**row, **found, "state": "done", "seconds": time.monotonic() - started}
            kept = self._store.put(key, done, target)
        row.update(kept, path=row["path"])

    def _call(self, started: float, function: Callable[..., Any], *args: Any) -> Any:
        """Call a function in the child, in what is left of the time."""
        for tries in range(1, self._retries + 2):
            left = started + self._timeout - time.monotonic()
            try:
                return self._child.call(function, *args, timeout=left)
            except Died as error:
                died = Died(f"{error}; tried {tries} times" if tries > 1 else str(error))
                # A new process has all of its memory for this asset.
                if tries > 1 and isinstance(error, OutOfMemory):
                    break
        raise died


def _suffix(path: str) -> str:
    """Return the end of a path that names a format, in small letters; empty if it has none."""
    found = _SUFFIX.search(path)
    return found[0].lower() if found else ""


def _key(digest: str, suffix: str, options: Options) -> str:
    """Return a hash of all that a result depends on."""
    what = [digest, suffix, dict(sorted(options.items())), __version__]
    return hashlib.sha256(json.dumps(what).encode()).hexdigest()
