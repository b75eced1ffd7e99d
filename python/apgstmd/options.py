"""Parameters by name: keywords in, a full parameter file out."""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias, TypedDict, Unpack

from . import _core

Model: TypeAlias = Literal["apg-stmd", "stmd-plus", "dstmd", "cascaded", "estmd"]
Preset: TypeAlias = Literal["practical", "paper"]
Rejection: TypeAlias = Literal["off", "contrast", "motion"]
Localise: TypeAlias = Literal["response", "target"]
ParamFile: TypeAlias = str | os.PathLike[str] | Mapping[str, Mapping[str, object] | str]


class Parameters(TypedDict, total=False):
    """Every parameter as a keyword, `section_name`. `apgstmd.parameters()` says what each means and may be."""

    retina_sigma: float
    attention_enabled: bool
    attention_alpha: float
    attention_scales: Sequence[float]
    attention_threshold: float
    attention_threshold_floor: float
    attention_support: Literal["full", "masked"]
    attention_speckles: Literal["light", "both"]
    attention_gate: Literal["luminance", "change"]
    attention_ramp: float
    lamina_fast_order: int
    lamina_fast_tau: float
    lamina_slow_order: int
    lamina_slow_tau: float
    lamina_inhibition_center_sigma: float
    lamina_inhibition_surround_sigma: float
    lamina_inhibition_radius: int
    lamina_inhibition_excitation_tau: float
    lamina_inhibition_inhibition_tau: float
    medulla_mi1_order: int
    medulla_mi1_tau: float
    medulla_tm1_4_order: int
    medulla_tm1_4_tau: float
    medulla_tm1_5_order: int
    medulla_tm1_5_tau: float
    lobula_spacing: float
    lobula_excitation: float
    lobula_inhibition: float
    lobula_center_sigma: float
    lobula_surround_sigma: float
    lobula_surround_weight: float
    lobula_offset: float
    lobula_radius: int
    lobula_direction_center_sigma: float
    lobula_direction_surround_sigma: float
    lobula_response_floor: float
    estmd_off_order: int
    estmd_off_tau: float
    emd_spacing: float
    emd_tau: float
    rejection_mode: Rejection
    rejection_gate: float
    rejection_gate_frames: float
    rejection_max_missed: int
    rejection_keep_radius: int
    rejection_contrast_sigma: float
    rejection_contrast_offset: float
    rejection_contrast_window: int
    rejection_contrast_min_points: int
    rejection_contrast_deviation: float
    rejection_background: Literal["off", "translation", "similarity"]
    rejection_motion_min_points: int
    rejection_motion_path: float
    rejection_motion_distance: float
    rejection_motion_straightness: float
    prediction_enabled: bool
    prediction_v_opt: float
    prediction_horizon: int
    prediction_ring_width: float
    prediction_concentration: float
    prediction_mu: float
    prediction_beta: float
    prediction_kappa: float
    prediction_negligible: float
    detection_threshold: float
    detection_least_score: float
    detection_max_peaks: int
    detection_peak_radius: int
    detection_localise: Localise
    tracking_birth_hits: int
    tracking_birth_window: int
    tracking_birth_score: float
    tracking_coast: int
    tracking_gate: float
    tracking_gate_limit: float
    tracking_noise: float
    tracking_acceleration: float
    tracking_velocity_spread: float
    tracking_direction_weight: float
    tracking_trace_weight: float
    tracking_guide: bool
    tracking_guide_noise: float
    engine_temporal: Literal["cascade", "fir"]


class Parameter(NamedTuple):
    """One parameter: its keyword, where it stands in a parameter file, what it means and what it may be."""

    keyword: str
    section: str
    name: str
    meaning: str
    rule: str


def parameters() -> list[Parameter]:
    """Every parameter of the model, in the order of a parameter file.

    >>> import apgstmd
    >>> next(p for p in apgstmd.parameters() if p.keyword == "attention_alpha").rule
    'must lie between 0 and 10'
    """
    return [Parameter(f"{section}_{name}", section, name, *rest) for section, name, *rest in _core.fields()]


def params(
    preset: Preset | None = None,
    *,
    model: Model | None = None,
    speed: float | None = None,
    rejection: Rejection | None = None,
    localise: Localise | None = None,
    threshold: float | None = None,
    params: ParamFile | None = None,
    **parameters: Unpack[Parameters],
) -> str:
    """The full parameter file with comments, as `apgstmd params` prints it; keywords as in `Detector`.

    >>> import apgstmd, tomllib
    >>> tomllib.loads(apgstmd.params("paper", speed=1.0))["prediction"]["horizon"]
    6
    """
    return resolve(model, preset, speed, rejection, localise, threshold, params, dict(parameters), ())


def resolve(
    model: str | None,
    preset: str | None,
    speed: float | None,
    rejection: str | None,
    localise: str | None,
    threshold: float | None,
    params: ParamFile | None,
    keywords: dict[str, Any],
    options: tuple[str, ...],
) -> str:
    """The parameter file that the keywords stand for; `options` are the other names that the caller takes."""
    for short, value in (("rejection", rejection), ("localise", localise), ("threshold", threshold)):
        if value is not None:
            if _SHORT[short] in keywords:
                raise TypeError(f"{short} and {_SHORT[short]} are the same parameter: give one of them")
            keywords[_SHORT[short]] = value
    known = {parameter.keyword: parameter for parameter in parameters()}
    overrides: dict[str, dict[str, object]] = {}
    for keyword, value in keywords.items():
        if keyword not in known:
            raise TypeError(_unknown(keyword, known, options))
        overrides.setdefault(known[keyword].section, {})[known[keyword].name] = value
    for name, value in (("model", model), ("preset", preset)):
        if value is not None and params is not None:
            raise TypeError(f"{name} and params both name what to start from: give one of them")
    file, table = _read(params)
    return _core.resolve(model, preset, file, table, speed, overrides)


_SHORT = {"rejection": "rejection_mode", "localise": "detection_localise", "threshold": "detection_threshold"}
_MODEL = ("model", "preset", "speed", *_SHORT, "params")


def _unknown(keyword: str, known: Mapping[str, Parameter], options: tuple[str, ...]) -> str:
    import difflib

    bare = [full for full, parameter in known.items() if parameter.name == keyword]
    near = bare or difflib.get_close_matches(keyword, (*known, *_MODEL, *options), n=1, cutoff=0.0)
    return f"there is no parameter {keyword!r}: did you mean {near[0]!r}? apgstmd.parameters() lists all"


def whole(name: str, value: int | None, low: int, high: int) -> int | None:
    """`value` as an int in [low, high], or None."""
    if value is None:
        return None
    try:
        value = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {value!r}") from None
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}, but it must lie between {low} and {high}")
    return value


def _read(params: ParamFile | None) -> tuple[str | None, Mapping[str, Mapping[str, object] | str] | None]:
    """A parameter file as text or as a table, from whatever it was given as."""
    if params is None:
        return None, None
    if isinstance(params, Mapping):
        return None, {
            section: fields if isinstance(fields, str) else dict(fields) for section, fields in params.items()
        }
    if isinstance(params, str) and is_toml(params):
        return params, None
    if isinstance(params, (str, os.PathLike)):
        return Path(params).read_text(encoding="utf-8"), None
    raise TypeError(f"params must be a path, TOML text or a dict of sections, not {type(params).__name__}")


def is_toml(params: str | os.PathLike[str]) -> bool:
    """Whether it is the text of a parameter file, not its path."""
    return isinstance(params, str) and ("=" in params or "\n" in params)
