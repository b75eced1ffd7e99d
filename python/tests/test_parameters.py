"""Every parameter by name."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

import apgstmd
from apgstmd.options import Parameters

SIZE = (16, 16)
ALL = apgstmd.parameters()


def params(**options: Any) -> dict[str, dict[str, Any]]:
    return tomllib.loads(apgstmd.params(**options))


def test_the_keywords_are_the_parameters() -> None:
    assert list(Parameters.__annotations__) == [p.keyword for p in ALL]
    full = tomllib.loads(apgstmd.params())
    assert full.pop("model") == "apg-stmd"
    assert [(p.section, p.name) for p in ALL] == [(section, name) for section in full for name in full[section]]
    kinds: dict[type, tuple[str, ...]] = {
        float: ("float",), int: ("int",), bool: ("bool",), list: ("Sequence[float]",), str: ("Literal", "Rejection", "Localise")
    }
    for p in ALL:
        annotation = Parameters.__annotations__[p.keyword]
        text = getattr(annotation, "__forward_arg__", str(annotation))
        assert text.startswith(kinds[type(full[p.section][p.name])]), p.keyword
    assert get_type_hints(Parameters)


def test_every_parameter_is_documented() -> None:
    for p in ALL:
        assert p.meaning and p.rule.startswith("must ")


@pytest.mark.parametrize("p", ALL, ids=lambda p: p.keyword)
def test_every_parameter_is_taken_by_name(p: apgstmd.Parameter) -> None:
    before = params(preset="paper")
    old = before[p.section][p.name]
    other = {"full": "masked", "contrast": "off", "target": "response", "cascade": "fir", True: False}
    other |= {"light": "both", "luminance": "change", "translation": "similarity"}
    if isinstance(old, (str, bool)):
        new: Any = other[old]
    elif isinstance(old, list):
        new = [1.5, 2.5]
    elif isinstance(old, int):
        # Fewer hits, for they must fit into their window.
        new = old - 1 if p.keyword == "tracking_birth_hits" else old + 1
    else:
        new = old / 2 or 0.5
        if p.keyword == "attention_ramp":
            new = 2.0
    after = params(preset="paper", **{p.keyword: new})
    before[p.section][p.name] = new
    assert after == before


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"preset": "paper", "speed": 2.0},
        {"speed": 1.0, "rejection": "off", "localise": "response", "threshold": 1e-6, "attention_alpha": 0.5},
        {"params": {"retina": {"sigma": 2.0}}, "speed": 4.0},
    ],
)
def test_a_detector_has_the_parameters_of_the_file(options: dict[str, Any]) -> None:
    detector = apgstmd.Detector(SIZE, threads=1, **options)
    assert detector.params == params(**options)
    assert detector.params_toml() == apgstmd.params(**options)


def test_presets_and_speed() -> None:
    assert params() == params(preset="practical")
    assert params()["rejection"]["mode"] == "motion"
    assert params(preset="paper")["rejection"]["mode"] == "contrast"
    fast = params(preset="paper", speed=1.0)
    assert fast["lamina"]["fast_tau"] == 0.75
    assert fast["prediction"]["horizon"] == 6
    assert params(speed=2) == params(speed=2.0) == params(speed=np.float32(2))


def test_what_is_named_is_put_in_last() -> None:
    assert params(speed=1.0, prediction_horizon=9)["prediction"]["horizon"] == 9
    assert params(preset="paper", rejection="off")["rejection"]["mode"] == "off"
    assert params(localise="response", threshold=1e-6)["detection"]["localise"] == "response"
    assert params(threshold=1e-6)["detection"]["threshold"] == 1e-6


@pytest.mark.parametrize(
    ("keyword", "value", "plain"),
    [
        ("attention_alpha", np.float32(0.5), 0.5),
        ("attention_alpha", 2, 2.0),
        ("lamina_fast_order", np.int64(3), 3),
        ("attention_enabled", np.bool_(False), False),
        ("attention_scales", (2, 3.5), [2.0, 3.5]),
        ("attention_scales", np.array([2, 3.5]), [2.0, 3.5]),
        ("rejection_mode", np.str_("off"), "off"),
    ],
)
def test_numpy_and_whole_numbers_are_values_too(keyword: str, value: Any, plain: Any) -> None:
    section, name = next((p.section, p.name) for p in ALL if p.keyword == keyword)
    found = params(**{keyword: value})[section][name]
    assert found == plain and type(found) is type(plain)


@pytest.mark.parametrize(
    ("unknown", "nearest"),
    [
        ("atention_alpha", "attention_alpha"),
        ("alpha", "attention_alpha"),
        ("sped", "speed"),
        ("rejection_mod", "rejection_mode"),
        ("treshold", "threshold"),
        ("localize", "localise"),
    ],
)
def test_an_unknown_name_suggests_the_nearest(unknown: str, nearest: str) -> None:
    with pytest.raises(TypeError, match=f"there is no parameter '{unknown}': did you mean '{nearest}'?"):
        params(**{unknown: 1})
    with pytest.raises(TypeError, match=f"did you mean '{nearest}'?"):
        apgstmd.Detector(SIZE, **{unknown: 1})  # type: ignore[arg-type]


def test_an_unknown_option_of_the_detector() -> None:
    for unknown, nearest in (("thread", "threads"), ("bits_depth", "bit_depth")):
        with pytest.raises(TypeError, match=f"there is no parameter '{unknown}': did you mean '{nearest}'?"):
            apgstmd.Detector(SIZE, **{unknown: 1})  # type: ignore[arg-type]


def test_a_parameter_given_twice() -> None:
    with pytest.raises(TypeError, match="rejection and rejection_mode are the same parameter"):
        params(rejection="off", rejection_mode="motion")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"retina_sigma": -1.0}, "retina.sigma is -1.0, but it must lie between 0.1 and 8"),
        ({"attention_alpha": float("nan")}, "attention.alpha is NaN, but it must lie between 0 and 10"),
        ({"attention_scales": []}, "attention.scales is [], but it must be a list of 1 to 8 numbers"),
        ({"attention_alpha": "high"}, "expected f64"),
        ({"lamina_fast_order": 2.5}, "expected u32"),
        ({"lamina_fast_order": True}, "expected u32"),
        ({"lamina_fast_order": 1 << 70}, "expected u32"),
        ({"rejection": "none"}, "expected one of `off`, `contrast`, `motion`"),
        ({"localise": "middle"}, "expected `response` or `target`"),
        ({"preset": "best"}, "preset is 'best', but it must be 'practical' or 'paper'"),
        ({"speed": 100.0}, "speed 100 px/frame is out of range: it must lie between 0.01 and 32"),
        ({"speed": float("nan")}, "out of range"),
        ({"threshold": -1.0}, "detection.threshold is -1.0, but it must lie between 0 and"),
        ({"threads": 0}, "threads is 0, but it must lie between 1 and 256"),
        ({"threads": 1000}, "threads is 1000, but it must lie between 1 and 256"),
        ({"params": "[retina]\nsigma = 99.0\n"}, "retina.sigma is 99.0"),
        ({"params": "[retina]\nsgma = 1.0\n"}, "line 2, column 1"),
        ({"params": {"retna": {"sigma": 1.0}}}, "there is no section `retna`"),
        ({"params": {"retina": {"sgma": 1.0}}}, "unknown field `sgma`, expected `sigma`"),
    ],
)
def test_wrong_values(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        apgstmd.Detector(SIZE, **{"threads": 1, **options})


@pytest.mark.parametrize(
    "options",
    [
        {"attention_alpha": None},
        {"attention_alpha": object()},
        {"attention_scales": {"a": 1}},
        {"params": 3},
        {"params": {"retina": 3}},
        {"speed": "fast"},
        {"preset": 3},
        {"threads": 1.5},
    ],
)
def test_wrong_kinds(options: dict[str, Any]) -> None:
    with pytest.raises(TypeError):
        apgstmd.Detector(SIZE, **{"threads": 1, **options})


def test_a_parameter_file_in_every_form(tmp_path: Path) -> None:
    wanted = apgstmd.params(speed=2.0, attention_alpha=0.25)
    file = tmp_path / "mine.toml"
    file.write_text(wanted, encoding="utf-8")
    for given in (file, str(file), wanted, tomllib.loads(wanted)):
        assert apgstmd.params(params=given) == wanted
    assert params(params=file, speed=1.0)["prediction"]["horizon"] == 6
    with pytest.raises(FileNotFoundError, match="absent.toml"):
        params(params="absent.toml")


def test_what_a_file_leaves_out() -> None:
    text = "[attention]\nalpha = 0.5\n"
    for given in (text, {"attention": {"alpha": 0.5}}):
        assert params(params=given) == params(preset="paper", attention_alpha=0.5)
        with pytest.raises(TypeError, match="preset and params both name what to start from"):
            params(params=given, preset="paper")
    assert params(params={}) == params(params="\n") == params(preset="paper")


def test_params_is_a_copy() -> None:
    detector = apgstmd.Detector(SIZE, threads=1)
    detector.params["retina"]["sigma"] = 99.0
    assert detector.params["retina"]["sigma"] == 1.0
