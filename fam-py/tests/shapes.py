"""Small meshes that tests make themselves."""

import numpy as np
import numpy.typing as npt

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]


def grid(columns: int, rows: int) -> npt.NDArray[np.int64]:
    """Quads of a sheet of `columns` × `rows` quads."""
    first = np.arange(columns * rows).reshape(rows, columns)
    first = first + np.arange(rows)[:, None]
    corner = first.reshape(-1)
    return np.stack([corner, corner + 1, corner + columns + 2, corner + columns + 1], axis=1)


def triangles(quads: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def sheet(columns: int = 8, rows: int = 6) -> Mesh:
    """A wavy sheet of triangles."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1].astype(float)
    vertices = np.stack([x, y, np.sin(0.7 * x) * np.cos(0.5 * y)], axis=-1)
    return vertices.reshape(-1, 3), triangles(grid(columns, rows))


def torus(around: int = 24, across: int = 12) -> Mesh:
    """A closed torus of triangles."""
    u, v = np.meshgrid(
        np.linspace(0, 2 * np.pi, around, endpoint=False),
        np.linspace(0, 2 * np.pi, across, endpoint=False),
        indexing="ij",
    )
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=-1)
    index = np.arange(around * across).reshape(around, across)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    quads = np.stack([index, right, both, up], axis=-1).reshape(-1, 4)
    return vertices.reshape(-1, 3), triangles(quads)


def tube(around: int = 24, along: int = 6) -> Mesh:
    """The side of a cylinder of triangles, around the z axis."""
    u, z = np.meshgrid(
        np.linspace(0, 2 * np.pi, around, endpoint=False),
        np.linspace(0, 2, along + 1),
        indexing="ij",
    )
    vertices = np.stack([np.cos(u), np.sin(u), z], axis=-1)
    index = np.arange(u.size).reshape(u.shape)
    right = np.roll(index, -1, axis=0)
    quads = np.stack([index[:, :-1], right[:, :-1], right[:, 1:], index[:, 1:]], axis=-1)
    return vertices.reshape(-1, 3), triangles(quads.reshape(-1, 4))


def cube() -> tuple[npt.NDArray[np.float64], list[list[int]]]:
    """A cube of quads."""
    vertices = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ]
    return vertices, quads
