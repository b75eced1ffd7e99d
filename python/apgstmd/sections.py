"""The sections of a parameter file as types: one class a section, as the core declares it; a test holds them together."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal


class Section(Mapping[str, Any]):
    """The parameters of one section, by attribute or by name; read-only."""

    __slots__ = ("_name", "_values")
    _name: str
    _values: dict[str, Any]

    def __init__(self, name: str, values: Mapping[str, Any]) -> None:
        # The attributes are not assignable.
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_values", dict(values))

    def __getattr__(self, name: str) -> Any:
        values: dict[str, Any] = object.__getattribute__(self, "_values")
        if name in values:
            return self[name]
        near = difflib.get_close_matches(name, values, n=1, cutoff=0.0)
        raise AttributeError(f"{self._name} has no parameter {name!r}: did you mean {near[0]!r}?")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"parameters are read-only: params.replace(**{{'{self._name}.{name}': ...}}) makes others")

    def __getitem__(self, name: str) -> Any:
        value = self._values[name]
        # A list would not be read-only.
        return list(value) if isinstance(value, list) else value

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __reduce__(self) -> Any:
        return type(self), (self._name, self._values)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self.items())})"


class Retina(Section):
    """Optical blur."""

    __slots__ = ()

    sigma: float


class Attention(Section):
    """Attention to what is predicted."""

    __slots__ = ()

    enabled: bool
    alpha: float
    scales: Sequence[float]
    threshold: float
    threshold_floor: float
    support: Literal["full", "masked"]
    speckles: Literal["light", "both"]
    gate: Literal["luminance", "change"]
    ramp: float


class Lamina(Section):
    """Band-pass over time."""

    __slots__ = ()

    fast_order: int
    fast_tau: float
    slow_order: int
    slow_tau: float


class LaminaInhibition(Section):
    """Lateral inhibition in the lamina, of the models that have it."""

    __slots__ = ()

    center_sigma: float
    surround_sigma: float
    radius: int
    excitation_tau: float
    inhibition_tau: float


class Medulla(Section):
    """Delays of the medulla."""

    __slots__ = ()

    mi1_order: int
    mi1_tau: float
    tm1_4_order: int
    tm1_4_tau: float
    tm1_5_order: int
    tm1_5_tau: float


class Lobula(Section):
    """Correlation and lateral inhibition in the lobula."""

    __slots__ = ()

    spacing: float
    excitation: float
    inhibition: float
    center_sigma: float
    surround_sigma: float
    surround_weight: float
    offset: float
    radius: int
    direction_center_sigma: float
    direction_surround_sigma: float
    response_floor: float


class Estmd(Section):
    """ESTMD: ON times delayed OFF."""

    __slots__ = ()

    off_order: int
    off_tau: float


class Emd(Section):
    """Motion detectors of the cascaded model."""

    __slots__ = ()

    spacing: float
    tau: float


class Rejection(Section):
    """How false positives are told from targets."""

    __slots__ = ()

    mode: Literal["off", "contrast", "motion"]
    gate: float
    gate_frames: float
    max_missed: int
    keep_radius: int
    contrast_sigma: float
    contrast_offset: float
    contrast_window: int
    contrast_min_points: int
    contrast_deviation: float
    background: Literal["off", "translation", "similarity"]
    motion_min_points: int
    motion_path: float
    motion_distance: float
    motion_straightness: float


class Prediction(Section):
    """Prediction and facilitation."""

    __slots__ = ()

    enabled: bool
    v_opt: float
    horizon: int
    ring_width: float
    concentration: float
    mu: float
    beta: float
    kappa: float
    negligible: float


class Detection(Section):
    """From response to detections."""

    __slots__ = ()

    threshold: float
    least_score: float
    max_peaks: int
    peak_radius: int
    localise: Literal["response", "target"]


class Tracking(Section):
    """From detections to tracks."""

    __slots__ = ()

    birth_hits: int
    birth_window: int
    birth_score: float
    coast: int
    gate: float
    gate_limit: float
    noise: float
    acceleration: float
    velocity_spread: float
    direction_weight: float
    trace_weight: float
    guide: bool
    guide_noise: float


class Engine(Section):
    """How the temporal filters are computed."""

    __slots__ = ()

    temporal: Literal["cascade", "fir"]


SECTIONS: dict[str, type[Section]] = {
    "retina": Retina,
    "attention": Attention,
    "lamina": Lamina,
    "lamina_inhibition": LaminaInhibition,
    "medulla": Medulla,
    "lobula": Lobula,
    "estmd": Estmd,
    "emd": Emd,
    "rejection": Rejection,
    "prediction": Prediction,
    "detection": Detection,
    "tracking": Tracking,
    "engine": Engine,
}
