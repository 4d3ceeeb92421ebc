"""Options that calls share."""

from __future__ import annotations

import numbers
from typing import Any, Literal, TypedDict, cast

from ._errors import InputError

Method = Literal["auto", "direct", "neural"]
Backend = Literal["auto", "flex", "wgpu"]
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
    - `backend`: where they are trained: `flex` is the CPU; `wgpu` is a graphics adapter, if the
      package was built with the feature of that name; `auto`, the default, is a real GPU if there
      is one for it, else the CPU.
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
    backend: Backend


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
    "backend": "auto",
}


class TrainingOptions(TypedDict, total=False):
    """How networks are trained: those of `Options` that `train` takes."""

    preset: Preset
    iterations: int | None
    seed: int | None
    backend: Backend


_TEXTS = {"method", "preset", "backend"}
_NUMBERS = {"distortion_bound", "seam_weight", "margin", "time_budget"}
_MAY_BE_NONE = {"max_charts", "time_budget", "iterations", "seed"}
_LARGEST = {"resolution": 2**32 - 1, "seed": 2**64 - 1}


def complete(options: Options | TrainingOptions) -> Options:
    """Return the options, checked, with the defaults of those that are not given."""
    given: dict[str, Any] = dict(options)
    unknown = set(given) - set(_DEFAULTS)
    if unknown:
        raise TypeError(f"there is no option {sorted(unknown)[0]!r}")
    return cast(Options, {**_DEFAULTS, **{name: _checked(name, given[name]) for name in given}})


def _checked(name: str, value: Any) -> Any:
    if value is None and name in _MAY_BE_NONE:
        return None
    if name in _TEXTS:
        if isinstance(value, str):
            return value
        raise InputError(f"{name} must be a text, not {value!r}")
    if name == "separate_duplicates":
        return bool(value)
    if name in _NUMBERS:
        return number(name, value)
    return whole(name, value, _LARGEST.get(name, 2**63 - 1))


def number(name: str, value: Any) -> float:
    """Return an option that is a number."""
    if isinstance(value, numbers.Real):
        return float(value)
    raise InputError(f"{name} must be a number, not {value!r}")


def whole(name: str, value: Any, largest: int = 2**32 - 1) -> int:
    """Return an option that is a whole number from 0 on."""
    if isinstance(value, numbers.Integral) and 0 <= int(value) <= largest:
        return int(value)
    raise InputError(f"{name} must be a whole number from 0 on, not {value!r}")
