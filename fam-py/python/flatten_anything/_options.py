"""Options that calls share."""

from __future__ import annotations

from typing import Literal, TypedDict

Method = Literal["auto", "direct", "neural"]
Preset = Literal["fast", "paper"]


class Options(TypedDict, total=False):
    """What every call that lays out a surface takes.

    - `method`: `direct` cuts and flattens a mesh as it is; `neural` trains the networks of the
      paper first, whose map says where to cut; `auto`, the default, is direct for meshes and
      neural for clouds.
    - `distortion_bound`: the mean symmetric Dirichlet energy that a layout may have, above 4, the
      energy of an isometry; 4.1 by default.
    - `seam_weight`: how much a seam costs against distortion; 1 by default.
    - `max_charts`: most charts of a connected part; by default as many as the bound takes.
    - `margin`: texels between charts, of a square of `resolution` texels; 4 of 2048 by default.
    - `separate_duplicates`: triangles that lie on others get UVs of their own, as lightmaps need.
    - `time_budget`: about how many seconds it may take.
    - `preset`, `iterations`, `seed`: how networks are trained, where any are. `fast` takes half a
      minute on a CPU, `paper` hours.
    """

    method: Method
    distortion_bound: float
    seam_weight: float
    max_charts: int | None
    margin: float
    resolution: int
    separate_duplicates: bool
    time_budget: float | None
    preset: Preset
    iterations: int | None
    seed: int | None


_DEFAULTS: Options = {
    "method": "auto",
    "distortion_bound": 4.1,
    "seam_weight": 1.0,
    "max_charts": None,
    "margin": 4.0,
    "resolution": 2048,
    "separate_duplicates": False,
    "time_budget": None,
    "preset": "fast",
    "iterations": None,
    "seed": None,
}


def complete(options: Options) -> Options:
    """Return the options with the defaults of those that are not given."""
    unknown = set(options) - set(_DEFAULTS)
    if unknown:
        raise TypeError(f"there is no option {sorted(unknown)[0]!r}")
    return {**_DEFAULTS, **options}
