"""The program `fam`: `python -m flatten_anything unwrap mesh.obj`."""

import sys

from . import _native


def main() -> None:
    """Run the program with the arguments of this process."""
    sys.exit(_native.run_program(["fam", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
