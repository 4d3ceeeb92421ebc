"""Triangle meshes in OBJ files, with vertices and triangles kept in the order of the file."""

from pathlib import Path
from typing import NamedTuple, Optional

import numpy as np


class Refused(Exception):
    """Why there is no layout, in one line."""


class Surface(NamedTuple):
    vertices: np.ndarray  # [V, 3] positions
    faces: np.ndarray  # [T, 3] vertices of each triangle
    uvs: Optional[np.ndarray]  # [T, 3, 2] UV of each corner, if every corner has one


def index(text, count):
    """A number from 0 for one of the file, which counts from 1, or backwards from -1."""
    number = int(text)
    number = number - 1 if number > 0 else count + number
    if not 0 <= number < count:
        raise ValueError(f"there is no vertex {text}")
    return number


def read(path):
    """The surface in a file; `Refused` where it is no mesh of triangles."""
    vertices, uvs, faces, corner_uvs = [], [], [], []
    for number, line in enumerate(Path(path).read_text(errors="replace").splitlines(), 1):
        key, *words = line.split() or [""]
        try:
            if key == "v":
                x, y, z = map(float, words[:3])
                vertices.append((x, y, z))
            elif key == "vt":
                u, v = map(float, words[:2])
                uvs.append((u, v))
            elif key == "f":
                corners = [word.split("/") for word in words]
                if len(corners) != 3:
                    raise ValueError("the face is no triangle")
                faces.append([index(corner[0], len(vertices)) for corner in corners])
                if all(len(corner) > 1 and corner[1] for corner in corners):
                    corner_uvs.append([index(corner[1], len(uvs)) for corner in corners])
        except ValueError as error:
            raise Refused(f"line {number} cannot be read: {error}") from None
    if not faces:
        raise Refused("it has no triangles")
    vertices, uvs = np.array(vertices), np.array(uvs)
    if not (np.isfinite(vertices).all() and np.isfinite(uvs).all()):
        raise Refused("a number is not finite")
    has_uvs = len(corner_uvs) == len(faces)
    return Surface(vertices, np.array(faces), uvs[np.array(corner_uvs)] if has_uvs else None)


def write(path, vertices, faces, uvs, corners):
    """Vertices [V, 3], triangles [T, 3], UVs [N, 2] and triangles [T, 3] into the UVs."""
    with open(path, "w") as file:
        for row in vertices:
            file.write("v {!r} {!r} {!r}\n".format(*map(float, row)))
        for row in uvs:
            file.write("vt {!r} {!r}\n".format(*map(float, row)))
        for face, into in zip(faces + 1, corners + 1):
            pairs = (f"{v}/{t}" for v, t in zip(face, into))
            file.write("f " + " ".join(pairs) + "\n")
