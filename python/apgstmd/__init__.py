"""apg-STMD: detection of tiny, low-contrast moving targets, after the insect visual system.

    detector = apgstmd.Detector((height, width), speed=1.0)   # px/frame; one detector for each stream
    out = detector.process(frame)                             # uint8, uint16, float32, float64; grey or RGB
    out.detections                                            # x, y, score, direction, trace as NumPy columns
    apgstmd.run("frames/", speed=1.0)                         # a whole folder, like the command line

Positions are in pixels (x = column, y = row downward), times in frames, directions in radians counter-clockwise on the
screen (0 = right, pi/2 = up), luminance in [0, 1].
"""

from ._core import MODELS, STAGES, __version__
from .detector import Detector
from .folder import Run, run
from .options import Parameter, parameters, params
from .results import Detection, Detections, Output, RunDetection, RunDetections

__all__ = [
    "MODELS",
    "STAGES",
    "Detection",
    "Detections",
    "Detector",
    "Output",
    "Parameter",
    "Run",
    "RunDetection",
    "RunDetections",
    "__version__",
    "parameters",
    "params",
    "run",
]
