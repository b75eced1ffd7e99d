"""What a region saves: a tenth of the picture in its middle beside all of it, before moving clutter.

    python benches/region.py 480 270           a detector for 1 px/frame
    python benches/region.py 480 270 --bank

Processor time of one thread a frame, the median; the two take turns, frame by frame, so that whatever else the machine does
hits both.
"""

import argparse
import math
import time

import numpy as np

import apgstmd

WARM = 30

parser = argparse.ArgumentParser()
parser.add_argument("width", type=int)
parser.add_argument("height", type=int)
parser.add_argument("--bank", action="store_true")
parser.add_argument("--frames", type=int, default=100)
asked = parser.parse_args()

background = {"kind": "natural", "velocity": [-25.0, 10.0]}
scene = apgstmd.synth({
    "width": asked.width, "height": asked.height, "rate": 25.0, "frames": asked.frames, "seed": 7, "background": background,
})
made = (lambda: apgstmd.Bank(scene.shape, threads=1)) if asked.bank else (lambda: apgstmd.Detector(scene.shape, speed=1.0, threads=1))
everywhere, region = made(), made()
width, height = (round(side * math.sqrt(0.1)) for side in (asked.width, asked.height))
region.look_in(((asked.width - width) // 2, (asked.height - height) // 2, width, height))

spent: dict[str, list[float]] = {"everywhere": [], "a tenth": []}
for frame in scene:
    for times, stream in zip(spent.values(), (everywhere, region), strict=True):
        begin = time.thread_time()
        stream.process(frame)
        times.append(1e3 * (time.thread_time() - begin))
whole, part = (float(np.median(times[WARM:])) for times in spent.values())
print(f"everywhere {whole:.1f} ms, a tenth {part:.1f} ms a frame: {100 * part / whole:.0f} %")
