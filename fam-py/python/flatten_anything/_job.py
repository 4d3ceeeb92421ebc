"""Waiting for computations, and computing in the background."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Generic, ParamSpec, TypeVar

from . import _native
from ._errors import Cancelled

#: Seconds between two looks at a computation: how long an interrupt waits at most.
_INTERVAL = 0.1

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Progress:
    """How far a computation is."""

    stage: str
    """`start`, `plan`, `train`, `reconstruct`, `flatten` or `pack`."""
    fraction: float
    """Estimated fraction of the stage that is over, from 0 to 1."""
    parts: int
    """How many parts the surface has, as far as it is known."""
    parts_done: int
    """How many of them are done."""
    energy: float | None
    """The symmetric Dirichlet energy that was reached last; 4 is that of an isometry."""


#: Is called about ten times a second. What it raises cancels the computation.
Observer = Callable[[Progress], None]


def wait(job: _native.Job, observe: Observer | None) -> Any:
    """Return the result of a job. Whatever is raised meanwhile cancels it."""
    try:
        while not job.wait(_INTERVAL):
            if observe is not None:
                stage, fraction, parts, done, energy = job.progress()
                reached = energy if math.isfinite(energy) else None
                observe(Progress(stage, fraction, parts, done, reached))
    except BaseException:
        job.cancel()
        raise
    return job.take()


class Job(Future[Result], Generic[Result]):
    """A computation in the background: a `concurrent.futures.Future` that can be cancelled.

    `submit` makes one. `asyncio.wrap_future` makes it awaitable. It runs from the start on, though
    `running` is False: that state of a future cannot be cancelled.
    """

    def __init__(self) -> None:
        super().__init__()
        self._stop = False
        self._ended = False
        self._lock = threading.Lock()
        self._progress: Progress | None = None

    @property
    def progress(self) -> Progress | None:
        """How far it is; none before it says so."""
        return self._progress

    def cancel(self) -> bool:
        """Ask it to end soon; `result` raises `CancelledError` then. False if it has ended."""
        with self._lock:
            self._stop = self._stop or not self._ended
            return self._stop

    def _observe(self, now: Progress) -> None:
        self._progress = now
        if self._stop:
            raise Cancelled("cancelled")

    def _end(self) -> bool:
        """Say that it has ended; return whether somebody cancelled it before."""
        with self._lock:
            self._ended = True
            return self._stop

    def _become_cancelled(self) -> None:
        super().cancel()
        # Whoever waits for several futures is told only by this.
        self.set_running_or_notify_cancel()


def submit(
    function: Callable[Parameters, Result],
    /,
    *args: Parameters.args,
    **kwargs: Parameters.kwargs,
) -> Job[Result]:
    """Start `unwrap`, `unwrap_points`, `unwrap_meshes` or `train` in the background.

    >>> job = submit(unwrap, vertices, faces, distortion_bound=4.05)  # doctest: +SKIP
    >>> layout = job.result(timeout=60)  # doctest: +SKIP
    """
    job: Job[Result] = Job()
    given: Any = kwargs.pop("progress", None)

    def observe(now: Progress) -> None:
        job._observe(now)
        if given is not None:
            given(now)

    def run() -> None:
        try:
            result = function(*args, **kwargs, progress=observe)  # type: ignore[arg-type]
        except BaseException as error:
            failed: BaseException | None = error
        else:
            failed = None
        if job._end():
            job._become_cancelled()
        elif failed is not None:
            job.set_exception(failed)
        else:
            job.set_result(result)

    threading.Thread(target=run, name="flatten-anything-wait", daemon=True).start()
    return job
