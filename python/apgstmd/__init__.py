"""apg-STMD: detection of tiny, low-contrast moving targets, after the insect visual system.

    detector = apgstmd.Detector((height, width), speed=1.0)   # px/frame; one detector for each stream
    out = detector.process(frame)                             # uint8, uint16, float32, float64; grey or RGB
    out.detections                                            # x, y, score, direction, trace as NumPy columns
    bank = apgstmd.Bank((height, width))                      # for targets of unknown speed and size
    apgstmd.run("frames/")                                    # a whole folder, like the command line; .tracks has tracks
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
from .evaluation import Curve, Evaluation, HotaCurve, OperatingPoint, TrackEvaluation, evaluate
from .folder import Run, run, tune
from .many import Clip, batch
from .options import Parameter, parameters, params
from .reproduction import Check, Reproduction, reproduce
from .results import (
    BankDetection,
    BankDetections,
    Detection,
    Detections,
    EgoMotion,
    Output,
    RunDetection,
    RunDetections,
    TrackPoint,
    Tracks,
)
from .scene import Scene, Truth, TruthRow, synth

if _TYPE_CHECKING:
    from . import plot, rerun

__all__ = [
    "MODELS",
    "STAGES",
    "Bank",
    "BankDetection",
    "BankDetections",
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
    "Reproduction",
    "Run",
    "RunDetection",
    "RunDetections",
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
]


def __getattr__(name: str) -> _Any:
    # These import packages that not everybody has, and take their time.
    if name in ("plot", "rerun"):
        return _importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
