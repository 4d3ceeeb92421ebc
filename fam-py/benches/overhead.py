"""What the package costs beside the library: the import, and what a call adds to the layout.

    python benches/overhead.py MESH...

Of each it takes the median of five. The import should take 0.2 s at most, numpy's included. A call
of `unwrap` should take 1.05 times as long as its native part at most: both are timed in the same
call. What it adds is checking and copying arrays, and making arrays and dictionaries of the result.
"""

import statistics
import subprocess
import sys
import time

import flatten_anything as fa
from flatten_anything import _unwrap

RUNS = 5


def imports() -> tuple[float, float]:
    """Return the seconds of the import, and of numpy's in it."""
    code = (
        "import time; t = time.perf_counter(); import numpy; n = time.perf_counter(); "
        "import flatten_anything; print(time.perf_counter() - t, n - t)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    whole, numpy = map(float, done.stdout.split())
    return whole, numpy


def call(file: fa.File) -> tuple[float, float]:
    """Return the seconds from arrays to arrays, and those that the native part ran."""
    native = 0.0

    def wait(job, observe):
        nonlocal native
        started = time.perf_counter()
        while not job.wait(1.0):
            pass
        native = time.perf_counter() - started
        return job.take()

    original, _unwrap.wait = _unwrap.wait, wait
    started = time.perf_counter()
    fa.unwrap(file.vertices, file.faces)
    whole = time.perf_counter() - started
    _unwrap.wait = original
    return whole, native


def main() -> None:
    """Print a row for the import and one for every mesh."""
    whole, numpy = map(statistics.median, zip(*(imports() for _ in range(RUNS)), strict=True))
    print(f"import: {whole:.3f} s, of which numpy {numpy:.3f} s")
    for path in sys.argv[1:]:
        file = fa.read(path)
        calls = [call(file) for _ in range(RUNS)]
        whole, native = map(statistics.median, zip(*calls, strict=True))
        ratio = statistics.median(both / own for both, own in calls)
        print(f"{path}: {whole:.3f} s, native part {native:.3f} s, ratio {ratio:.3f}")


if __name__ == "__main__":
    main()
