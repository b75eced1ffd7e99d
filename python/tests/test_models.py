"""The models beside apg-STMD."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import apgstmd
from apgstmd.options import Model
from scenes import HEIGHT, WIDTH, textured_square

SIZE = (HEIGHT, WIDTH)
RELATIVES = apgstmd.MODELS[1:]


def test_names() -> None:
    assert get_args(Model) == apgstmd.MODELS
    assert apgstmd.Detector(SIZE, threads=1).model == "apg-stmd"


@pytest.mark.parametrize("model", apgstmd.MODELS)
def test_each_has_its_stages(model: Any) -> None:
    detector = apgstmd.Detector(SIZE, model=model, speed=1.0, rejection="off", threads=1)
    for frame in textured_square(30):
        out = detector.process(frame)
    assert detector.model == model and f"model={model!r}" in repr(detector)
    for name in apgstmd.STAGES:
        if name in detector.stages:
            assert detector.stage(name).shape[-2:] == SIZE
        else:
            with pytest.raises(ValueError, match=f"the model {model} has no stage `{name}`: its stages are P, C,"):
                detector.stage(name)
    assert out.response.max() > 0 and len(out.detections)
    assert np.isnan(out.direction[out.response > 0]).all() == (model == "estmd")
    assert np.isnan(out.detections.direction).all() == (model == "estmd")


def test_defaults() -> None:
    def rejection(**options: Any) -> str:
        return tomllib.loads(apgstmd.params(**options))["rejection"]["mode"]

    assert rejection(model="apg-stmd") == rejection() == "motion"
    assert rejection(model="stmd-plus") == "contrast"
    for model in ("dstmd", "cascaded", "estmd"):
        assert rejection(model=model) == rejection(model=model, preset="paper") == "off"
        assert rejection(model=model, preset="practical") == rejection(model=model, rejection="motion") == "motion"


@pytest.mark.parametrize("model", apgstmd.MODELS)
def test_a_file_names_its_model(model: Any) -> None:
    whole = apgstmd.params(model=model, speed=2.0)
    assert tomllib.loads(whole)["model"] == model
    for given in (whole, tomllib.loads(whole)):
        assert apgstmd.params(params=given) == whole
    assert apgstmd.params(params={"model": model}) == apgstmd.params("paper", model=model)
    assert apgstmd.params(params=f'model = "{model}"') == apgstmd.params("paper", model=model)
    assert apgstmd.Detector(SIZE, params=whole, threads=1).model == model


def test_wrong_models() -> None:
    with pytest.raises(ValueError, match="there is no model `stmd`: the models are apg-stmd, stmd-plus"):
        apgstmd.Detector(SIZE, model="stmd")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="stmd-plus"):
        apgstmd.Detector(SIZE, params={"model": "stmd"})
    with pytest.raises(TypeError, match="model and params both name what to start from"):
        apgstmd.Detector(SIZE, model="estmd", params={"model": "estmd"})


@pytest.mark.parametrize("options", [{}, {"lobula_inhibition": 3.0}])
def test_a_folder(tmp_path: Path, options: Any) -> None:
    for t, frame in enumerate(textured_square(30)):
        (tmp_path / f"{t}.pgm").write_bytes(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + frame.tobytes())
    found = apgstmd.run(tmp_path, model="estmd", speed=1.0, **options)
    assert found.summary["params"]["model"] == "estmd"
    assert len(found.detections) and np.isnan(found.detections.direction).all()
    assert np.isfinite(found.detections.x).all()
