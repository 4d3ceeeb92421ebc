"""UV layouts of any mesh or point cloud, in seconds.

>>> import flatten_anything as fa
>>> layout = fa.unwrap(vertices, faces)  # doctest: +SKIP
>>> layout.vertex_uvs, layout.faces, layout.vertex_map  # doctest: +SKIP

Meshes are cut, flattened and packed from their geometry: few charts, no flipped triangles, no
overlaps, distortion within a bound. Point clouds, and maps that give UVs to any point, come from
the networks of *Flatten Anything: Unsupervised Neural Surface Parameterization*.
"""

from ._errors import (
    Cancelled,
    FileError,
    FlattenAnythingError,
    InputError,
    InternalError,
    TrainingError,
)
from ._files import File, read, write
from ._job import Job, Progress, submit
from ._layout import Layout, PointLayout
from ._maps import Map, train
from ._measure import Packed, measure, pack
from ._native import __version__
from ._options import Options
from ._unwrap import unwrap, unwrap_meshes, unwrap_points
from .interop import from_trimesh, to_trimesh

__all__ = [
    "Cancelled",
    "File",
    "FileError",
    "FlattenAnythingError",
    "InputError",
    "InternalError",
    "Job",
    "Layout",
    "Map",
    "Options",
    "Packed",
    "PointLayout",
    "Progress",
    "TrainingError",
    "__version__",
    "from_trimesh",
    "measure",
    "pack",
    "read",
    "submit",
    "to_trimesh",
    "train",
    "unwrap",
    "unwrap_meshes",
    "unwrap_points",
    "write",
]
