"""What the package costs beside the library: seconds of `unwrap` on arrays, and of the import.

    python benches/overhead.py MESH...

Both in turn, the median of five: the call from arrays to arrays, and the layout alone as the
program tells it, which runs the same code in a process of its own. The call also measures the
layout and splits vertices at seams.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time

import flatten_anything as fa

RUNS = 5


def layout_alone(path: str) -> float:
    """Return the seconds that the program's layout took."""
    with tempfile.TemporaryDirectory() as folder:
        call = [sys.executable, "-m", "flatten_anything", "unwrap", path, "-q", "--json"]
        done = subprocess.run([*call, "-o", folder], check=True, capture_output=True, text=True)
    seconds: float = json.loads(done.stdout)["finishing_seconds"]
    return seconds


def call(file: fa.File) -> float:
    """Return the seconds from arrays to arrays."""
    started = time.perf_counter()
    fa.unwrap(file.vertices, file.faces)
    return time.perf_counter() - started


def imported() -> float:
    """Return the seconds of the import, numpy's left out."""
    code = (
        "import numpy, time; t = time.perf_counter(); import flatten_anything; "
        "print(time.perf_counter() - t)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return float(done.stdout)


def main() -> None:
    """Print a row for every mesh."""
    print(f"import: {statistics.median(imported() for _ in range(RUNS)):.3f} s")
    for path in sys.argv[1:]:
        file = fa.read(path)
        both = [(call(file), layout_alone(path)) for _ in range(RUNS)]
        own, alone = (statistics.median(times) for times in zip(*both, strict=True))
        print(f"{path}: {own:.3f} s, layout alone {alone:.3f} s, ratio {own / alone:.3f}")


if __name__ == "__main__":
    main()
