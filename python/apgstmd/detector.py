"""The streaming detector."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from . import _core
from .options import Localise, Model, ParamFile, Parameters, Preset, Rejection, resolve, whole
from .results import Detections, EgoMotion, Maps, Output
from .stream import Stream, check_size


class Detector(Stream):
    """Finds small moving targets in a stream of frames of one size.

    Parameters
    ----------
    size : (height, width), at least 16 x 16.
    model : "apg-stmd", or one to compare it with: "stmd-plus", "dstmd", "cascaded", "estmd". These have no attention
        and no prediction and ignore their parameters; "estmd" has no directions either: they are NaN.
    preset : "practical" (a start for real footage) or "paper" (the constants of the publication). By default apg-STMD
        is practical and the other models are as published.
    speed : px/frame that the model is tuned to, 0.01 to 32. It responds well from about half to twice this speed, and
        the untuned model (None) prefers 0.25 px/frame: this is the first thing to set for a new camera.
    rejection : "off", "contrast" or "motion": how false positives are told from targets.
    localise : "target" (moved forward onto the target) or "response" (the peak, a few pixels behind).
    threshold : least response E of a detection, >= 0.
    threads : 1 to 256, all cores by default. The numbers do not depend on it.
    bit_depth : significant bits of integer frames, 1 to 16, when they are fewer than the type holds (10, 12, 14).
    params : a parameter file to start from instead of `preset`: a path, TOML text or a dict of sections.
    **parameters : any other parameter as `section_name`, for example `attention_alpha=0.5`. They are put in last:
        after `preset` or `params`, after `speed`. `apgstmd.parameters()` lists all with meanings and ranges.

    Raises
    ------
    TypeError : an unknown name (the nearest is suggested), or one given twice.
    ValueError : a value out of range; the message names the parameter, the value and the rule.
    MemoryError : it would take more memory than the system gives; the message has the number of bytes.

    One detector holds the state of one stream; it can be copied and pickled, and goes on to the bit. Used from two threads at once it raises RuntimeError; the interpreter
    is free for other threads while a frame is computed, so several detectors do run side by side.

    >>> import apgstmd, numpy as np
    >>> detector = apgstmd.Detector((48, 96), speed=1.0)
    >>> for t in range(48):
    ...     frame = np.full((48, 96), 255, np.uint8)
    ...     frame[22:27, 10 + t : 15 + t] = 0  # a dark square of 5 x 5 px, one pixel to the right each frame
    ...     out = detector.process(frame)
    >>> target = out.detections[0]
    >>> abs(target.x - 59) < 2, abs(target.y - 24) < 1, abs(target.direction) < 0.2
    (True, True, True)
    """

    __slots__ = ()

    _core: _core.Detector

    def __init__(
        self,
        size: tuple[int, int],
        *,
        model: Model | None = None,
        preset: Preset | None = None,
        speed: float | None = None,
        rejection: Rejection | None = None,
        localise: Localise | None = None,
        threshold: float | None = None,
        threads: int | None = None,
        bit_depth: int | None = None,
        params: ParamFile | None = None,
        **parameters: Unpack[Parameters],
    ) -> None:
        self._shape = check_size(size)
        self._region = None
        text = resolve(
            model, preset, speed, rejection, localise, threshold, params, dict(parameters), ("threads", "bit_depth")
        )
        self._core = _core.Detector(
            *self._shape, text, whole("threads", threads, 1, 256), whole("bit_depth", bit_depth, 1, 16)
        )

    def process(self, frame: NDArray[Any], *, out: Maps | None = None) -> Output:
        """Takes the next frame and returns what it shows; nothing is delayed.

        frame : (H, W) grey, (H, W, 3) RGB or (H, W, 4) RGBA of uint8, uint16, float32, float64 or bool, any strides.
            Integers are divided by their full scale, floats must be luminance in [0, 1], colour becomes
            0.299 R + 0.587 G + 0.114 B. The array is read in place: leave it alone until this call returns.
        out : arrays (response, direction) for the maps, each (H, W) float32, C-contiguous, apart from the frame and from each
            other; None in place of one asks for a new array. The maps of the output are then these very arrays.

        Raises TypeError for another type of array, ValueError for another size, NaN, infinity or floats outside [0, 1], and
        for arrays of `out` that cannot be written, RuntimeError when another thread is inside. The detector is unchanged
        after each of them.

        >>> import apgstmd, numpy as np
        >>> detector = apgstmd.Detector((32, 48))
        >>> maps = np.empty((32, 48), np.float32), np.empty((32, 48), np.float32)
        >>> detector.process(np.zeros((32, 48), np.uint8), out=maps).response is maps[0]
        True
        """
        response, direction, (x, y, score, angle, trace), shift, ego, cut = self._core.process(frame, out)
        detections = Detections(x=x, y=y, score=score, direction=angle, trace=trace)
        return Output(detections, response, direction, shift, EgoMotion(*ego), cut)

    def stage(self, name: str) -> NDArray[np.float32]:
        """A copy of an inner stage of the last frame; zeros before the first. `stages` lists those that the model has.

        (H, W) for P, A, Pe, L, L1, Tm3, Tm2, Mi1, Tm1_4, Tm1_5, ON, OFF, OFFd, Y, Yd, M; (4, H, W) for C, orientations
        k pi/4; (8, H, W) for D, E, Ep (E after rejection), F, Q, directions k pi/4. ValueError for another name.
        """
        return self._core.stage(name)

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the inner stages that the model has, in the order of the data flow; `apgstmd.STAGES` has all."""
        return self._core.stages

    @property
    def model(self) -> str:
        """Name of its model."""
        return self._core.model

    def params_toml(self) -> str:
        """The full parameter file with comments, for `params=` or the command line's `--params`."""
        return self._core.params

    @property
    def lag(self) -> float:
        """How far the response trails the target, px: what `localise="target"` adds along the direction."""
        return self._core.lag

    def _arguments(self) -> tuple[Any, ...]:
        return self._core.params, self._core.threads, self._core.bit_depth

    def __repr__(self) -> str:
        params = self.params
        height, width = self._shape
        return (
            f"Detector(({height}, {width}), model={self.model!r}, v_opt={params['prediction']['v_opt']:g} px/frame, "
            f"rejection={params['rejection']['mode']!r}, threads={self.threads})"
        )
