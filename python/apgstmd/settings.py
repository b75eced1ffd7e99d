"""All parameters of a model as one value."""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self, Unpack

from . import _core
from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection, parameters, resolve
from .sections import (
    SECTIONS,
    Attention,
    Detection,
    Emd,
    Engine,
    Estmd,
    Lamina,
    LaminaInhibition,
    Lobula,
    Medulla,
    Prediction,
    Rejection as RejectionSection,
    Retina,
    Section,
    Tracking,
)

_PRESETS: tuple[Preset, ...] = ("practical", "paper")


class Params(Mapping[str, Any]):
    """Every parameter of a model: read-only, by section and name; what changes it makes another one.

    The arguments are those of `Detector`. `Detector`, `Bank` and `run` take it as `params=`. It is equal to another, and to a
    dict, with the same values, and is a mapping of sections, `dict(params)`.

    Raises TypeError for an unknown name (the nearest is suggested), ValueError for a value out of range.

    >>> import apgstmd
    >>> params = apgstmd.Params.preset("practical").replace(attention_alpha=2)
    >>> params.attention.alpha, params["attention"]["alpha"], params.model
    (2.0, 2.0, 'apg-stmd')
    >>> params
    Params('practical', attention_alpha=2.0)
    >>> apgstmd.Detector((48, 96), params=params.for_speed(1.0)).params["prediction"]["horizon"]
    6
    """

    __slots__ = ("_file", "_model", "_sections")
    _file: str
    _model: Model
    _sections: dict[str, Section]

    model: Model
    retina: Retina
    attention: Attention
    lamina: Lamina
    lamina_inhibition: LaminaInhibition
    medulla: Medulla
    lobula: Lobula
    estmd: Estmd
    emd: Emd
    rejection: RejectionSection
    prediction: Prediction
    detection: Detection
    tracking: Tracking
    engine: Engine

    def __init__(
        self,
        preset: Preset | None = None,
        *,
        model: Model | None = None,
        speed: float | None = None,
        rejection: Rejection | None = None,
        localise: Localise | None = None,
        threshold: float | None = None,
        params: ParamFile | None = None,
        **parameters: Unpack[Parameters],
    ) -> None:
        file = resolve(model, preset, speed, rejection, localise, threshold, params, dict(parameters), ())
        values = tomllib.loads(file)
        # The attributes are not assignable.
        object.__setattr__(self, "_file", file)
        object.__setattr__(self, "_model", values.pop("model"))
        object.__setattr__(self, "_sections", {name: SECTIONS[name](name, values[name]) for name in values})

    @classmethod
    def preset(cls, name: Preset, *, model: Model | None = None) -> Self:
        """"practical" or "paper", of apg-STMD or of another model. ValueError for another name."""
        return cls(name, model=model)

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Self:
        """From a parameter file: a path or TOML text. What it leaves out is as the model that it names has it.

        ValueError, with line and column, for an unknown key or a value out of range; FileNotFoundError for a missing file.
        """
        return cls(params=source)

    @classmethod
    def from_dict(cls, values: Mapping[str, Mapping[str, object] | str]) -> Self:
        """From sections as dicts, as `to_dict` gives them; what is left out is as the model has it.

        TypeError for an unknown section or name, ValueError for a value out of range.

        >>> import apgstmd
        >>> apgstmd.Params.from_dict({"attention": {"alpha": 0.5}})
        Params('paper', attention_alpha=0.5)
        """
        model = values.get("model")
        if model is not None and not isinstance(model, str):
            raise TypeError(f"model must be a name, not {type(model).__name__}")
        _keywords({name: fields for name, fields in values.items() if name != "model"})
        return cls(params=values)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """The full parameter file, every value with what it means and may be.

        path : a file to write it to as well. OSError where it cannot be written.
        """
        if path is not None:
            Path(path).write_text(self._file, encoding="utf-8")
        return self._file

    def to_dict(self) -> dict[str, Any]:
        """`model` and a dict for each section: a copy."""
        return {"model": self._model} | {name: dict(section) for name, section in self._sections.items()}

    def for_speed(self, speed: float) -> Self:
        """The same tuned to targets of `speed` px/frame, 0.01 to 32: times shrink as speed grows.

        tau' = tau / k for every time constant and horizon' = horizon / k, with k = speed / v_opt. ValueError out of range.
        """
        return type(self)(params=self, speed=speed)

    def replace(self, **changes: Any) -> Self:
        """The same with other values: `section_name=value`, `section={"name": value}` or `**{"section.name": value}`.

        TypeError for an unknown name (the nearest is suggested), ValueError for a value out of range.

        >>> import apgstmd
        >>> params = apgstmd.Params.preset("paper")
        >>> params.replace(attention={"alpha": 2}) == params.replace(**{"attention.alpha": 2})
        True
        """
        return type(self)(params=self, **_keywords(changes))

    def difference(self, other: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
        """Where two sets of parameters differ: values of this one and of the other by "section.name".

        >>> import apgstmd
        >>> practical = apgstmd.Params.preset("practical")
        >>> practical.replace(retina_sigma=2).difference(practical)
        {'retina.sigma': (2.0, 1.0)}
        """
        found = {} if self._model == other["model"] else {"model": (self._model, other["model"])}
        for section, fields in self._sections.items():
            for name, value in fields.items():
                if value != other[section][name]:
                    found[f"{section}.{name}"] = (value, other[section][name])
        return found

    def __getattr__(self, name: str) -> Any:
        sections: dict[str, Section] = object.__getattribute__(self, "_sections")
        if name in sections:
            return sections[name]
        if name == "model":
            return self._model
        near = difflib.get_close_matches(name, ("model", *sections), n=1, cutoff=0.0)
        raise AttributeError(f"there is no section {name!r} of parameters: did you mean {near[0]!r}?")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("parameters are read-only: params.replace(...) makes others")

    def __getitem__(self, name: str) -> Any:
        return self._model if name == "model" else self._sections[name]

    def __iter__(self) -> Iterator[str]:
        return iter(("model", *self._sections))

    def __len__(self) -> int:
        return 1 + len(self._sections)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __reduce__(self) -> Any:
        return type(self).from_toml, (self._file,)

    def __repr__(self) -> str:
        nearest: tuple[Preset, dict[str, tuple[Any, Any]]] | None = None
        for preset in _PRESETS:
            differs = self.difference(tomllib.loads(_core.resolve(self._model, preset, None, None, None, {})))
            if nearest is None or len(differs) < len(nearest[1]):
                nearest = preset, differs
        assert nearest is not None
        model = "" if self._model == "apg-stmd" else f", model={self._model!r}"
        changes = "".join(f", {name.replace('.', '_')}={value!r}" for name, (value, _) in nearest[1].items())
        return f"{type(self).__name__}({nearest[0]!r}{model}{changes})"


def _keywords(changes: Mapping[str, Any]) -> dict[str, Any]:
    """`section_name` of what may also be nested or dotted. Unknown names are refused by `resolve`, but for those of sections."""
    known = {parameter.section for parameter in parameters()}
    keywords: dict[str, Any] = {}
    for name, value in changes.items():
        if isinstance(value, Mapping):
            if name not in known:
                near = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
                raise TypeError(f"there is no section {name!r} of parameters: did you mean {near[0]!r}?")
            _same(name, value)
            keywords |= {f"{name}_{field}": inner for field, inner in value.items()}
        else:
            keywords[name.replace(".", "_", 1)] = value
    return keywords


def _same(section: str, fields: Mapping[str, Any]) -> None:
    """Refuses a name that its section has not: joined up it might be one of another section."""
    known = [parameter.name for parameter in parameters() if parameter.section == section]
    for name in fields:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
            raise TypeError(f"there is no parameter {f'{section}.{name}'!r}: did you mean {f'{section}.{near[0]}'!r}?")
