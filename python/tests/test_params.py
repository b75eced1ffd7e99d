"""All parameters as one value."""

from __future__ import annotations

import copy
import inspect
import pickle
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import apgstmd
from apgstmd import Params
from apgstmd.options import Parameters
from apgstmd.sections import SECTIONS

SIZE = (32, 48)


def test_the_types_are_the_cores() -> None:
    assert [(p.section, p.name) for p in apgstmd.parameters()] == [
        (section, name) for section, kind in SECTIONS.items() for name in kind.__annotations__
    ]
    for p in apgstmd.parameters():
        alias = {"Rejection": 'Literal["off", "contrast", "motion"]', "Localise": 'Literal["response", "target"]'}
        keyword = Parameters.__annotations__[p.keyword]
        text = str(getattr(keyword, "__forward_arg__", keyword)).replace("'", '"')
        own = SECTIONS[p.section].__annotations__[p.name].replace("'", '"')
        assert own == alias.get(text, text), p.keyword
    sections = {name: kind for name, kind in inspect.get_annotations(Params).items() if not name.startswith("_")}
    assert list(sections) == ["model", *SECTIONS]


@pytest.mark.parametrize("model", apgstmd.MODELS)
def test_every_value_is_there(model: Any) -> None:
    params = Params("practical", model=model)
    plain = tomllib.loads(apgstmd.params("practical", model=model))
    assert params.to_dict() == plain == params and dict(params) == plain
    assert params.to_toml() == apgstmd.params("practical", model=model)
    assert params.model == model == params["model"]
    for p in apgstmd.parameters():
        assert getattr(getattr(params, p.section), p.name) == params[p.section][p.name] == plain[p.section][p.name]
    assert len(params) == len(plain) and set(dir(params)) >= set(plain)


def test_ways_to_make_one(tmp_path: Path) -> None:
    params = Params.preset("practical").for_speed(2.0).replace(**{"attention.alpha": 0.5})
    assert params == Params("practical", speed=2.0, attention_alpha=0.5)
    assert params == params.replace() == Params(params=params)
    assert params == Params.from_toml(params.to_toml()) == Params.from_dict(params.to_dict())
    file = tmp_path / "params.toml"
    assert params.to_toml(file) == file.read_text(encoding="utf-8")
    assert Params.from_toml(file) == params == Params.from_toml(str(file))
    for twin in (copy.copy(params), copy.deepcopy(params), pickle.loads(pickle.dumps(params))):
        assert twin == params and twin.attention == params.attention
    assert params.replace(attention={"alpha": 2, "ramp": 3.0}) == params.replace(attention_alpha=2, attention_ramp=3.0)
    assert params != params.replace(retina_sigma=2.0) and params.replace(retina_sigma=np.float32(2)).retina.sigma == 2.0
    assert Params.preset("paper", model="dstmd") == Params(model="dstmd")
    assert Params.from_dict({"model": "dstmd"}) == Params(model="dstmd")


def test_everything_takes_it() -> None:
    params = Params("practical", speed=1.0, rejection="off")
    frames = [np.random.default_rng(t).random(SIZE) for t in range(5)]
    detector = apgstmd.Detector(SIZE, params=params)
    assert detector.params == params and Params.from_dict(detector.params) == params
    assert Params.from_dict(apgstmd.Bank(SIZE, params=params).params) == params
    assert apgstmd.run(frames, params=params).summary["params"] == params
    assert apgstmd.params(params=params) == params.to_toml()


def test_it_says_what_differs() -> None:
    assert repr(Params()) == "Params('practical')" and repr(Params("paper")) == "Params('paper')"
    assert repr(Params(model="dstmd")) == "Params('paper', model='dstmd')"
    changed = Params("practical", attention_scales=[2.0, 3.0], rejection="off")
    assert repr(changed) == "Params('practical', attention_scales=[2.0, 3.0], rejection_mode='off')"
    for params in (changed, Params(model="estmd", speed=4.0), Params("paper", speed=0.5)):
        assert eval(repr(params)) == params
    assert changed.difference(Params()) == {
        "attention.scales": ([2.0, 3.0], Params().attention.scales),
        "rejection.mode": ("off", "motion"),
    }
    assert repr(Params().retina) == "Retina(sigma=1.0)"


def test_it_is_read_only() -> None:
    params = Params()
    for of, name in ((params, "attention"), (params.attention, "alpha"), (params, "model")):
        with pytest.raises(AttributeError, match=r"read-only: params.replace"):
            setattr(of, name, 2.0)
    params.attention.scales.append(1.0)  # type: ignore[attr-defined]
    params.to_dict()["attention"]["scales"].append(1.0)
    assert params == Params()


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Params().atention, AttributeError, "no section 'atention' of parameters: did you mean 'attention'"),
        (lambda: Params().attention.alfa, AttributeError, "attention has no parameter 'alfa': did you mean 'alpha'"),
        (lambda: Params(attention_alfa=1.0), TypeError, "did you mean 'attention_alpha'"),  # type: ignore[call-arg]
        (lambda: Params().replace(**{"attention.alfa": 1.0}), TypeError, "did you mean 'attention_alpha'"),
        (lambda: Params().replace(atention={"alpha": 1.0}), TypeError, "did you mean 'attention'"),
        (lambda: Params().replace(attention={"alfa": 1.0}), TypeError, "'attention.alfa': did you mean 'attention.alpha'"),
        (lambda: Params().replace(lamina={"inhibition_radius": 3}), TypeError, "no parameter 'lamina.inhibition_radius'"),
        (lambda: Params.from_dict({"retina": {"sgma": 1.0}}), TypeError, "did you mean 'retina.sigma'"),
        (lambda: Params.from_dict({"retna": {"sigma": 1.0}}), TypeError, "did you mean 'retina'"),
        (lambda: Params.from_dict({"model": 3}), TypeError, "model must be a name, not int"),  # type: ignore[dict-item]
        (lambda: Params.from_toml("[retina]\nsgma = 1.0\n"), ValueError, "line 2, column 1"),
        (lambda: Params().replace(retina_sigma=99.0), ValueError, "retina.sigma is 99.0, but it must lie between 0.1 and 8"),
        (lambda: Params().for_speed(99.0), ValueError, "speed 99 px/frame is out of range"),
        (lambda: Params.preset("best"), ValueError, "preset is 'best'"),  # type: ignore[arg-type]
    ],
)
def test_what_is_wrong(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()
