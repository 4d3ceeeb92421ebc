"""Options that calls share."""

from __future__ import annotations

import numbers
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, cast

from ._errors import InputError

Method = Literal["auto", "direct", "neural"]
Backend = Literal["auto", "flex", "wgpu"]
Preset = Literal["fast", "paper"]
Symmetry = Literal["off", "auto", "x", "y", "z"]
Stack = Literal["none", "identical", "mirrored"]


class Options(TypedDict, total=False):
    """What every call that lays out a surface takes.

    - `method`: `direct` cuts and flattens a mesh as it is; `neural` trains the networks of the
      paper first, whose map says where to cut; `auto`, the default, is direct for meshes and
      neural for clouds.
    - `distortion_bound`: the mean symmetric Dirichlet energy that a layout may have, above 4, the
      energy of an isometry; 4.1 by default.
    - `seam_weight`: how much a seam costs against distortion; 1 by default.
    - `hide_seams`: how much more a seam costs where the surface is seen than where it is hidden: at
      1 thirty-one times as much; 0, the same everywhere, by default.
    - `seen_from`: the direction from which the surface is seen, three numbers, for `hide_seams`; by
      default it is seen from all sides.
    - `hard_angle`: cut along all edges at which the surface turns by at least so many degrees; by
      default along none.
    - `paint_weight`: how much more a seam costs where `paint` says so: at 1, the default, eleven
      times as much at a paint of 1 as at 0.
    - `crease_weight`: how many tenths cheaper a seam is along a right-angled crease; 1 by default.
    - `tear_weight`: the same along the tears of a trained map; 1 by default.
    - `symmetry`: the plane in which layouts are mirrored: `off` by default; `auto` finds it; `x`,
      `y` and `z` are across that axis.
    - `stack`: parts that share their place in the square: `none` by default, `identical` ones, or
      `mirrored` ones too.
    - `straighten`: whether charts that are nearly rectangles or strips get straight sides.
    - `upright`: the direction, three numbers, that is up in the square too; none by default.
    - `coverage_weight`: how much it counts that the square is filled: charts are divided where that
      pays for the seam; 0, so that none is, by default.
    - `max_charts`: most charts of a connected part; by default as many as the bound takes.
    - `margin`: texels between charts, of a square of `resolution` texels; 4 of 2048 by default.
    - `texel_density`: texels per unit of length; by default charts are as large as they fit.
    - `tiles`: UDIM tiles that charts are spread over, at most so many with `texel_density`; 1 by
      default.
    - `whole_texels`: whether charts begin at corners of texels, as lightmaps like it.
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
    hide_seams: float
    seen_from: Sequence[float] | None
    hard_angle: float | None
    paint_weight: float
    crease_weight: float
    tear_weight: float
    symmetry: Symmetry
    stack: Stack
    straighten: bool
    upright: Sequence[float] | None
    coverage_weight: float
    max_charts: int | None
    margin: float
    resolution: int
    texel_density: float | None
    tiles: int
    whole_texels: bool
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
    "hide_seams": 0.0,
    "seen_from": None,
    "hard_angle": None,
    "paint_weight": 1.0,
    "crease_weight": 1.0,
    "tear_weight": 1.0,
    "symmetry": "off",
    "stack": "none",
    "straighten": False,
    "upright": None,
    "coverage_weight": 0.0,
    "max_charts": None,
    "margin": 4.0,
    "resolution": 2048,
    "texel_density": None,
    "tiles": 1,
    "whole_texels": False,
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


_TEXTS = {"method", "preset", "backend", "symmetry", "stack"}
_FLAGS = {"separate_duplicates", "straighten", "whole_texels"}
_DIRECTIONS = {"seen_from", "upright"}
_NUMBERS = {
    "coverage_weight",
    "crease_weight",
    "distortion_bound",
    "hard_angle",
    "hide_seams",
    "margin",
    "paint_weight",
    "seam_weight",
    "tear_weight",
    "texel_density",
    "time_budget",
}
_MAY_BE_NONE = {name for name, value in _DEFAULTS.items() if value is None}
_LARGEST = {"resolution": 2**32 - 1, "tiles": 2**32 - 1, "seed": 2**64 - 1}


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
    if name in _FLAGS:
        return bool(value)
    if name in _DIRECTIONS:
        return _direction(name, value)
    if name in _NUMBERS:
        return number(name, value)
    return whole(name, value, _LARGEST.get(name, 2**63 - 1))


def _direction(name: str, value: Any) -> list[float]:
    if isinstance(value, Sequence) and len(value) == 3:
        return [number(name, part) for part in value]
    raise InputError(f"{name} must be three numbers, not {value!r}")


def number(name: str, value: Any) -> float:
    """Return an option that is a number."""
    if isinstance(value, numbers.Real):
        return float(value)
    raise InputError(f"{name} must be a number, not {value!r}")


def by_name(option: str, value: Any) -> list[tuple[str, float]]:
    """Return the names of an option that is numbers by names, with their numbers."""
    if value is None:
        return []
    if isinstance(value, Mapping) and all(isinstance(name, str) for name in value):
        return [(name, number(f"{option} of {name!r}", of)) for name, of in value.items()]
    raise InputError(f"{option} must be numbers by names, not {value!r}")


def whole(name: str, value: Any, largest: int = 2**32 - 1) -> int:
    """Return an option that is a whole number from 0 on."""
    if isinstance(value, numbers.Integral) and 0 <= int(value) <= largest:
        return int(value)
    raise InputError(f"{name} must be a whole number from 0 on, not {value!r}")
