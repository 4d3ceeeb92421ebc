"""Calls in a process of their own, which can be killed.

A `Child` runs functions for the process that owns it, one after the other. They speak over the
child's standard input and output: a message is its length in eight bytes, then a pickle. The
child ends when its input is closed, in the middle of a call, too: it never outlives its owner.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable
from typing import IO, Any

from ._errors import FlattenAnythingError

#: The length of a message in bytes.
_LENGTH = struct.Struct("<Q")

#: Lines of the child's standard error that are kept: a crash says why in its last few.
_KEPT_LINES = 20

#: What the allocator of a child with a limit reserves at once.
_ARENA = "64MiB"

#: Seconds from the end of the child's output to its exit code: the system needs milliseconds.
_ENDING = 5.0


class Failure(Exception):
    """Why a call has no result. The message is one line."""


class Raised(Failure):
    """The function raised an exception, whose message this is."""


class TimedOut(Failure):
    """The call was not done in its time."""


class Died(Failure):
    """The process ended before the call did."""


class OutOfMemory(Died):
    """The process could not get the memory that the call needed."""


class Child:
    """A process that runs functions, started anew whenever a call needs one.

    Arguments:
    - `threads`: how many threads computations take; by default as many as there are cores.
    - `memory`: bytes of data that it may hold; a call that needs more fails. Only Linux enforces
      it.

    """

    def __init__(self, threads: int | None = None, memory: int | None = None) -> None:
        self._threads = threads
        self._memory = memory
        self._process: subprocess.Popen[bytes] | None = None
        self._said: deque[str] = deque(maxlen=_KEPT_LINES)
        self._listener: threading.Thread | None = None

    def call(self, function: Callable[..., Any], *args: Any, timeout: float) -> Any:
        """Return what the function returns in the child.

        The function must be one that a module has by its name. The seconds of `timeout` count from
        now, so they include the child's start. Raises `Raised`, `TimedOut`, `Died` or
        `OutOfMemory`; after the last three the next call starts another child.
        """
        request = pickle.dumps((function, args))
        process = self._running()
        expired = threading.Event()

        def expire() -> None:
            expired.set()
            process.kill()

        timer = threading.Timer(timeout, expire)
        timer.daemon = True
        timer.start()
        answer = None
        try:
            with contextlib.suppress(OSError):
                _send(_pipe(process.stdin), request)
                answer = _receive(_pipe(process.stdout))
        except BaseException:
            # The answer to this call must not become that of the next one.
            self.close()
            raise
        finally:
            timer.cancel()
            timer.join()
        if answer is None:
            died = self._death(process)
            self.close()
            raise TimedOut(f"not done within {timeout:g} s") if expired.is_set() else died
        if expired.is_set():
            self.close()
        succeeded, result = pickle.loads(answer)
        if not succeeded and result.startswith("MemoryError"):
            # What it holds still counts against its limit.
            self.close()
            raise OutOfMemory(result)
        if not succeeded:
            raise Raised(result)
        return result

    def close(self) -> None:
        """Kill the child, if there is one."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        with contextlib.suppress(OSError):
            _pipe(process.stdin).close()
        _pipe(process.stdout).close()

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is not None:
            self.close()
        if self._process is None:
            environment = dict(os.environ)
            if self._threads is not None:
                environment["RAYON_NUM_THREADS"] = str(self._threads)
                # Each of numpy's threads takes memory, too.
                environment["OPENBLAS_NUM_THREADS"] = str(self._threads)
            if self._memory is not None:
                # It reserves 1 GiB otherwise, which counts though it is not in use.
                environment["MIMALLOC_ARENA_RESERVE"] = _ARENA
            # -P: a folder of the package's name in the working directory is not the package.
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, str(self._memory or 0)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=environment,
            )
            self._said.clear()
            lines = _pipe(self._process.stderr)
            self._listener = threading.Thread(target=self._listen, args=(lines,), daemon=True)
            self._listener.start()
        return self._process

    def _listen(self, lines: IO[bytes]) -> None:
        """Keep what the child says, and keep its pipe empty."""
        with lines:
            for line in lines:
                self._said.append(line.decode(errors="replace").strip())

    def _death(self, process: subprocess.Popen[bytes]) -> Died:
        """Return how the process ended, and the line that says why: as a rule the last one."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_ENDING)
        if self._listener is not None:
            self._listener.join(_ENDING)
        said = [line for line in self._said if line]
        # Later lines do not give the cause.
        cause = [line for line in said if line.startswith("memory allocation of")]
        if cause:
            return OutOfMemory(cause[-1])
        return Died(": ".join([_ending(process.returncode), *said[-1:]]))


def line_of(error: BaseException) -> str:
    """Return an error in one line; one that is not of this package with its type."""
    own = isinstance(error, FlattenAnythingError | Failure)
    message = str(error) if own else f"{type(error).__name__}: {error}"
    return " ".join(message.split())


def _ending(code: int | None) -> str:
    if code is None:
        return "the process closed its output"
    if code >= 0:
        return f"the process ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = "unknown"
    hint = ", as systems do when memory is short" if name == "SIGKILL" else ""
    return f"the process was killed by signal {-code} ({name}){hint}"


def _pipe(of: IO[bytes] | None) -> IO[bytes]:
    assert of is not None
    return of


def _send(stream: IO[bytes], message: bytes) -> None:
    stream.write(_LENGTH.pack(len(message)))
    stream.write(message)
    stream.flush()


def _receive(stream: IO[bytes]) -> bytes | None:
    """Return the next message; none if the stream ends before its end."""
    start = stream.read(_LENGTH.size)
    if len(start) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(start)
    message = stream.read(length)
    return message if len(message) == length else None


def _answer(request: bytes) -> bytes:
    """Call the function and return its result, or what it raised in one line."""
    try:
        function, args = pickle.loads(request)
        return pickle.dumps((True, function(*args)), pickle.HIGHEST_PROTOCOL)
    except BaseException as error:
        return pickle.dumps((False, line_of(error)))


def _limit_memory(limit: int) -> None:
    """Let this process hold at most so many bytes of data, if that is above 0."""
    if limit > 0:
        with contextlib.suppress(ImportError):
            import resource

            _, hard = resource.getrlimit(resource.RLIMIT_DATA)
            most = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
            resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def main() -> None:
    """Answer the owner's requests until it closes the standard input."""
    _limit_memory(int(sys.argv[1]))
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # Nothing that libraries read or print gets between the messages.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    # Ctrl-C goes to all processes of a terminal; the owner decides what becomes of this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def listen() -> None:
        while (request := _receive(requests)) is not None:
            waiting.put(request)
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        _send(answers, _answer(waiting.get()))


if __name__ == "__main__":
    main()
