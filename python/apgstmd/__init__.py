"""apg-STMD: detection of tiny, low-contrast moving targets, after the insect visual system.

    detector = apgstmd.Detector((height, width), speed=1.0)   # px/frame; one detector for each stream
    out = detector.process(frame)                             # uint8, uint16, float32, float64; grey or RGB
    out.detections                                            # x, y, score, direction, trace as NumPy columns
    bank = apgstmd.Bank((height, width))                      # for targets of unknown speed and size
    apgstmd.run("frames/")                                    # a whole folder, like the command line; .tracks has tracks
    apgstmd.run(array, speed=1.0)                             # (frames, rows, columns), any iterable, PyAV, OpenCV
    for seen in apgstmd.watch("rtsp://camera"): ...           # the same frame by frame, as it comes
    apgstmd.Params.preset("practical").replace(attention_alpha=2)  # all parameters as one value, for params=
    apgstmd.batch("clips/*.mp4", "all")                       # many videos, a process each, here or by a Dask client
    apgstmd.tune("empty.mp4", "quiet.toml")                   # a threshold by a clip without targets
    scene = apgstmd.synth("demo")                             # made-up frames with ground truth
    apgstmd.evaluate(apgstmd.run(scene, speed=1.0), scene)    # detections against truth: rates, curves, errors
    apgstmd.reproduce(quick=True)                             # the paper's experiments, computed and judged
    apgstmd.plot.overlay(frame, out.detections)               # pictures, with matplotlib (the extra `plot`)
    apgstmd.rerun.log(0, frame, out)                          # the timeline of the Rerun viewer (the extra `rerun`)

Positions are in pixels (x = column, y = row downward), times in frames, directions in radians counter-clockwise on the
screen (0 = right, pi/2 = up), luminance in [0, 1].
"""

import importlib as _importlib
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from ._core import MODELS, STAGES, __version__
from .bank import Bank
from .detector import Detector
from .options import Parameter, parameters, params
from .results import (
    BankDetection,
    BankDetections,
    Camera,
    CameraMotion,
    Detection,
    Detections,
    EgoMotion,
    Output,
    RunDetection,
    RunDetections,
    RunFrame,
    TrackPoint,
    Tracks,
)

if _TYPE_CHECKING:
    from . import plot, rerun
    from .evaluation import Curve, Evaluation, HotaCurve, OperatingPoint, TrackEvaluation, evaluate
    from .folder import Run, run, tune, watch
    from .many import Clip, batch
    from .reproduction import Check, Reproduction, reproduce
    from .scene import Scene, Truth, TruthRow, synth
    from .settings import Params

__all__ = [
    "MODELS",
    "STAGES",
    "Bank",
    "BankDetection",
    "BankDetections",
    "Camera",
    "CameraMotion",
    "Check",
    "Clip",
    "Curve",
    "Detection",
    "Detections",
    "EgoMotion",
    "Detector",
    "Evaluation",
    "HotaCurve",
    "OperatingPoint",
    "Output",
    "Parameter",
    "Params",
    "Reproduction",
    "Run",
    "RunDetection",
    "RunDetections",
    "RunFrame",
    "Scene",
    "TrackEvaluation",
    "TrackPoint",
    "Tracks",
    "Truth",
    "TruthRow",
    "__version__",
    "batch",
    "evaluate",
    "parameters",
    "params",
    "plot",
    "reproduce",
    "rerun",
    "run",
    "synth",
    "tune",
    "watch",
]


# Imported when they are asked for: a detector needs none of them, and they take their time.
_LATER = {
    "evaluation": ("Curve", "Evaluation", "HotaCurve", "OperatingPoint", "TrackEvaluation", "evaluate"),
    "folder": ("Run", "run", "tune", "watch"),
    "many": ("Clip", "batch"),
    "plot": (),
    "reproduction": ("Check", "Reproduction", "reproduce"),
    "rerun": (),
    "scene": ("Scene", "Truth", "TruthRow", "synth"),
    "settings": ("Params",),
}


def __getattr__(name: str) -> _Any:
    for module, names in _LATER.items():
        if name == module or name in names:
            found = _importlib.import_module(f".{module}", __name__)
            return found if name == module else getattr(found, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
