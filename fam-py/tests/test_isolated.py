"""Calls in a process of their own."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flatten_anything as fa
import shapes
from flatten_anything._isolated import Child, Died, Raised, TimedOut

#: Seconds for what takes a child's start or less, on a machine that does other things, too.
ENOUGH = 60.0


@pytest.fixture
def child() -> Iterator[Child]:
    own = Child(threads=1)
    yield own
    own.close()


def is_running(process: int) -> bool:
    """Whether any thread of a process is there that has not ended."""
    try:
        texts = [path.read_text() for path in Path(f"/proc/{process}/task").glob("*/stat")]
    except OSError:
        return is_running(process)
    return any(text.rpartition(")")[2].split()[0] not in "ZX" for text in texts)


def ends(process: int) -> bool:
    """Whether a process ends soon."""
    until = time.monotonic() + 10
    while is_running(process) and time.monotonic() < until:
        time.sleep(0.02)
    return not is_running(process)


def test_a_child_returns_what_its_functions_return(child: Child) -> None:
    process = child.call(os.getpid, timeout=ENOUGH)
    assert process != os.getpid()
    vertices, faces = shapes.torus()
    layout = child.call(fa.unwrap, vertices, faces, timeout=ENOUGH)
    assert (layout.uvs == fa.unwrap(vertices, faces).uvs).all()
    large = bytes(10_000_000)
    assert child.call(bytes.__len__, large, timeout=ENOUGH) == len(large)
    assert child.call(os.getenv, "RAYON_NUM_THREADS", timeout=ENOUGH) == "1"
    assert child.call(os.getpid, timeout=ENOUGH) == process


def test_what_a_function_raises_is_told_in_a_line(child: Child) -> None:
    process = child.call(os.getpid, timeout=ENOUGH)
    with pytest.raises(Raised, match="^missing.obj: No such file"):
        child.call(fa.read, "missing.obj", timeout=ENOUGH)
    with pytest.raises(Raised, match="^vertices must have the shape"):
        child.call(fa.unwrap, np.zeros((3, 2)), [[0, 1, 2]], timeout=ENOUGH)
    with pytest.raises(Raised, match="^ValueError: invalid literal"):
        child.call(int, "one\ntwo", timeout=ENOUGH)
    with pytest.raises(Raised, match="cannot pickle|TypeError"):
        child.call(open, os.devnull, timeout=ENOUGH)
    with pytest.raises(Raised, match="^SystemExit: 3"):
        child.call(sys.exit, 3, timeout=ENOUGH)
    assert child.call(os.getpid, timeout=ENOUGH) == process


def test_what_functions_print_does_no_harm(child: Child) -> None:
    for function, args in ((print, ("noise",)), (os.write, (1, b"noise\n")), (os.system, ("ls",))):
        child.call(function, *args, timeout=ENOUGH)
    # More than a pipe holds.
    child.call(os.write, 2, b"noise\n" * 50_000, timeout=ENOUGH)
    assert child.call(os.read, 0, 1, timeout=ENOUGH) == b""
    assert child.call(abs, -1, timeout=ENOUGH) == 1


def test_a_call_ends_with_its_time(child: Child) -> None:
    process = child.call(os.getpid, timeout=ENOUGH)
    started = time.monotonic()
    with pytest.raises(TimedOut, match=r"^not done within 0.5 s$"):
        child.call(time.sleep, 100, timeout=0.5)
    assert time.monotonic() - started < 10 and ends(process)
    other = child.call(os.getpid, timeout=ENOUGH)
    assert other != process
    # Native code is killed, too.
    vertices, faces = shapes.torus(300, 200)
    with pytest.raises(TimedOut):
        child.call(fa.unwrap, vertices, faces, timeout=1)
    assert ends(other)
    with pytest.raises(TimedOut):
        child.call(abs, 1, timeout=-1)


def test_the_end_of_a_child_is_told(child: Child) -> None:
    with pytest.raises(Died, match=r"killed by signal 9 \(SIGKILL\), as systems do when memory"):
        child.call(signal.raise_signal, signal.SIGKILL, timeout=ENOUGH)
    assert child.call(abs, -1, timeout=ENOUGH) == 1
    with pytest.raises(Died, match=r"^the process ended with exit code 3$"):
        child.call(os._exit, 3, timeout=ENOUGH)
    child.call(os.write, 2, b"first\nthe last words\n\n", timeout=ENOUGH)
    with pytest.raises(Died, match=r"killed by signal 6 \(SIGABRT\): the last words$"):
        child.call(os.abort, timeout=ENOUGH)
    # One that died between two calls is noticed by the next.
    process = child.call(os.getpid, timeout=ENOUGH)
    os.kill(process, signal.SIGKILL)
    assert ends(process)
    assert child.call(os.getpid, timeout=ENOUGH) != process


OWNER = """
import os, time
import flatten_anything as fa, shapes
from flatten_anything._isolated import Child
child = Child()
print(child.call(os.getpid, timeout=60), flush=True)
child.call({call}, timeout=60)
"""

CALLS = [
    "time.sleep, 50",
    "eval, 'any(x for x in iter(int, 1))'",
    "fa.unwrap, *shapes.torus(300, 200)",
]


@pytest.mark.parametrize("call", CALLS)
def test_a_child_ends_with_its_owner(call: str) -> None:
    program = [sys.executable, "-c", OWNER.format(call=call)]
    paths = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True, env=paths) as owner:
        assert owner.stdout is not None
        process = int(owner.stdout.readline())
        # In the middle of the second call.
        time.sleep(0.5)
        assert is_running(process) and owner.poll() is None
        owner.kill()
    assert ends(process)


def test_an_interrupted_call_leaves_no_answer_behind(child: Child) -> None:
    class Interrupted(Exception):
        pass

    def interrupt(*_: object) -> None:
        raise Interrupted

    child.call(abs, 1, timeout=ENOUGH)
    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        with pytest.raises(Interrupted):
            child.call(time.sleep, 1, timeout=ENOUGH)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert child.call(abs, -2, timeout=ENOUGH) == 2
