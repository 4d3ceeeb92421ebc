"""The program `fam`: `python -m flatten_anything unwrap mesh.obj`."""

import signal
import sys

from . import _native


def main() -> None:
    """Run the program with the arguments of this process."""
    # Python's handler would wait until the program returns.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    program = [sys.executable, "-m", "flatten_anything"]
    sys.exit(_native.run_program(program, ["fam", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
