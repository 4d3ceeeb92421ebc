"""What a child does with an asset: a file of a mesh or a point cloud."""

from __future__ import annotations

import contextlib
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from ._errors import FileError, FlattenAnythingError
from ._files import read
from ._layout import Layout, PointLayout
from ._options import Options
from ._unwrap import unwrap, unwrap_points


def hash_of(path: str) -> str:
    """Return SHA-256 of a file, followed by the files beside it that it refers to.

    It is that of the manifest of `fam unwrap`. What is missing, and what a file refers to that
    cannot be read as a surface, does not count. Raises `FileError`.
    """
    try:
        digest = hashlib.sha256(Path(path).read_bytes())
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from None
    # Why it cannot be read is said when it is unwrapped.
    with contextlib.suppress(FlattenAnythingError):
        for companion in read(path).companions:
            with contextlib.suppress(OSError):
                digest.update(companion.read_bytes())
    return digest.hexdigest()


def unwrap_file(path: str, expected: str, options: Options, target: str | None) -> dict[str, Any]:
    """Return `uvs`, `metrics` and `warnings` of a file, as the rows of the Ray stage have them.

    Arguments:
    - `expected`: its hash, which must still be that when the result is there.
    - `target`: where to write it with its new UVs, if anywhere.

    Raises a `FlattenAnythingError`.

    """
    file = read(path)
    layout: Layout | PointLayout
    if file.faces is None:
        layout = unwrap_points(file.vertices, file.normals, **options)
        uvs, metrics = layout.uvs[:, np.newaxis], {}
    else:
        layout = unwrap(file, **options)
        uvs, metrics = np.asarray(layout.uvs), layout.metrics
    if target is not None:
        file.write(target, layout)
    if hash_of(path) != expected:
        raise FileError(f"{path}: it was changed while it was unwrapped")
    warnings = list(dict.fromkeys([*file.warnings, *layout.warnings]))
    return {"uvs": uvs, "metrics": json.dumps(metrics), "warnings": warnings}
