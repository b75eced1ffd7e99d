"""What a detector shows, on the timeline of the Rerun viewer (https://rerun.io): the extra `rerun`.

    import rerun as rr
    rr.init("apgstmd", spawn=True)
    for number, frame in enumerate(frames):
        apgstmd.rerun.log(number, frame, detector.process(frame))
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._optional import need
from .results import Output

if TYPE_CHECKING:
    import rerun

_RING = 8.0


def log(
    number: int,
    frame: NDArray[Any],
    out: Output,
    *,
    time: float | None = None,
    entity: str = "apgstmd",
    response: bool = False,
    recording: rerun.RecordingStream | None = None,
) -> None:
    """Logs a frame and what it showed: the picture, a ring and a heading for each detection, the number of detections, the
    strongest response, the background's shift.

    number : of the frame, the timeline `frame`. time : its seconds, the timeline `time`. entity : path under which all is
    logged. response : the response map as well, as floats: 4 bytes a pixel and frame. recording : where to, the
    current one by default.
    """
    rr = need("rerun", "rerun", "apgstmd.rerun.log()")
    rr.set_time("frame", sequence=number, recording=recording)
    if time is not None:
        rr.set_time("time", duration=time, recording=recording)
    found = out.detections
    places = np.column_stack([found.x, found.y]) + 0.5
    ahead = np.nan_to_num(np.column_stack([np.cos(found.direction), -np.sin(found.direction)]))
    labels = [f"{score:.3g}" for score in found.score]
    shift = np.hypot(*out.background_shift)
    logged = {
        "camera": rr.Image(frame),
        "camera/detections": rr.Points2D(places, radii=_RING, labels=labels, class_ids=found.trace % 65536),
        "camera/heading": rr.Arrows2D(origins=places, vectors=2 * _RING * ahead),
        "detections": rr.Scalars(len(found)),
        "strongest": rr.Scalars(float(out.response.max())),
        "background": rr.Scalars(float(shift)),
    }
    if response:
        logged["response"] = rr.DepthImage(out.response, colormap="inferno")
    for name, what in logged.items():
        rr.log(f"{entity}/{name}", what, recording=recording)
