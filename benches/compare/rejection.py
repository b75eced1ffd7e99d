"""Rejection by motion: peaks of E, their traces, and the background's shift by Gauss-Newton on the retina output."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np

from kernels import Array

MARGIN, SAMPLES, ITERATIONS = 12, 16384, 4
STRUCTURE, LEAST_SCALE, SETTLED = 1e-8, 1e-6, 1e-3


class Background:
    """(x, y) px that the picture as a whole moved since the last frame."""

    def __init__(self, height: int, width: int) -> None:
        least = min(height, width)
        self.margin = least // 4 if least < 2 * MARGIN + 8 else MARGIN
        inner = (height - 2 * self.margin) * (width - 2 * self.margin)
        self.step = max(1, math.ceil(math.sqrt(inner / SAMPLES)))
        self.size = height, width
        self.last = np.zeros((0, 0), np.float32)
        self.shift = np.zeros(2)

    def process(self, p: Array) -> np.ndarray:
        self.shift = self.estimate(p) if self.last.size else np.zeros(2)
        self.last = p
        return self.shift

    def sample(self, plane: Array, dy: int = 0, dx: int = 0) -> Array:
        """Every so many pixels within the margin, from (dx, dy) beside them: at most as far as the margin."""
        rows, columns = (
            slice(self.margin + d, n - self.margin + d, self.step)
            for n, d in zip(self.size, (dy, dx), strict=True)
        )
        return plane[rows, columns]

    def residual(self, p: Array, shift: np.ndarray) -> Array:
        whole = np.floor(shift).astype(int)
        fx, fy = (shift - whole).astype(np.float32)
        dx, dy = whole
        upper, lower = (
            a + fx * (b - a)
            for a, b in ((self.sample(p, dy + k, dx), self.sample(p, dy + k, dx + 1)) for k in (0, 1))
        )
        return upper + fy * (lower - upper) - self.sample(self.last, 0, 0)

    def estimate(self, p: Array) -> np.ndarray:
        def scale_of(residual: Array) -> float:
            return max(
                1.5 * float(np.partition(np.abs(residual), residual.size // 2, axis=None)[residual.size // 2]),
                LEAST_SCALE,
            )

        still = self.residual(p, np.zeros(2))
        unit = scale_of(still)

        def cost(residual: Array) -> float:
            return float(np.log1p((residual / unit) ** 2).sum(dtype=np.float64))

        gx = 0.5 * (self.sample(self.last, 0, 1) - self.sample(self.last, 0, -1))
        gy = 0.5 * (self.sample(self.last, 1, 0) - self.sample(self.last, -1, 0))
        shift = self.shift.copy()
        for _ in range(ITERATIONS):
            r = self.residual(p, shift)
            w = 1 / (1 + (r / scale_of(r)) ** 2)
            wx, wy = w * gx, w * gy
            xx, xy, yy, bx, by = (
                float((a * b).sum(dtype=np.float64)) for a, b in ((wx, gx), (wx, gy), (wy, gy), (wx, r), (wy, r))
            )
            weakest = (0.5 * (xx + yy) - math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)) / float(
                w.sum(dtype=np.float64)
            )
            if weakest < STRUCTURE:
                return np.zeros(2)
            step = np.array([yy * bx - xy * by, xx * by - xy * bx]) / (xx * yy - xy * xy)
            shift -= step
            if np.abs(shift).max() > self.margin - 1:
                return np.zeros(2)
            if math.hypot(*step) < SETTLED:
                break
        return shift if cost(self.residual(p, shift)) <= cost(still) else np.zeros(2)


@dataclass
class Peak:
    y: int
    x: int
    value: float
    place: np.ndarray


def vertex(before: float, middle: float, after: float) -> float:
    bend = before - 2 * middle + after
    return min(max((before - after) / (2 * bend), -0.5), 0.5) if bend < 0 else 0.0


def find_peaks(response: Array, p: dict[str, Any]) -> list[Peak]:
    """The strongest maxima of their neighbourhood; of equal ones the first in reading order."""
    radius = p["peak_radius"]
    window = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    highest = cv2.dilate(response, window, borderType=cv2.BORDER_CONSTANT, borderValue=0.0)
    rows, columns = np.nonzero((response == highest) & (response > p["threshold"]))
    order = np.argsort(-response[rows, columns], kind="stable")
    peaks: list[Peak] = []
    height, width = response.shape
    for y, x in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        value = float(response[y, x])
        if len(peaks) == p["max_peaks"]:
            break
        if any(q.value == value and abs(q.y - y) <= radius and abs(q.x - x) <= radius for q in peaks):
            continue
        dx = vertex(response[y, x - 1], value, response[y, x + 1]) if 0 < x < width - 1 else 0.0
        dy = vertex(response[y - 1, x], value, response[y + 1, x]) if 0 < y < height - 1 else 0.0
        peaks.append(Peak(y, x, value, np.array([x + dx, y + dy])))
    return peaks


@dataclass
class Trace:
    place: np.ndarray
    velocity: np.ndarray
    number: int
    missed: int = 0
    points: deque[np.ndarray] = field(default_factory=deque)


class Rejection:
    """Peaks whose trace moves, in a line, relative to the background."""

    def __init__(self, height: int, width: int, params: dict[str, Any]) -> None:
        self.detection, self.p = params["detection"], params["rejection"]
        window = max(math.ceil(self.p["motion_path"] / params["prediction"]["v_opt"]), 8)
        self.window = window
        self.gate = self.p["gate"] + self.p["gate_frames"] * params["prediction"]["v_opt"]
        self.background = Background(height, width)
        self.travelled = np.zeros(2)
        self.traces: list[Trace] = []
        self.count = 0

    def process(self, p: Array, e: Array) -> tuple[Array, list[tuple[Peak, int]]]:
        """E' and the confirmed peaks with their traces."""
        shift = self.background.process(p)
        self.travelled = self.travelled + shift
        peaks = find_peaks(e.max(axis=0), self.detection)
        kept = np.zeros_like(e)
        confirmed = []
        radius = self.p["keep_radius"]
        for peak, trace in zip(peaks, self.link(peaks, shift), strict=True):
            trace.points.append(peak.place - self.travelled)
            if len(trace.points) > self.window:
                trace.points.popleft()
            if self.confirms(trace):
                confirmed.append((peak, trace.number))
                near = np.s_[
                    :, max(peak.y - radius, 0) : peak.y + radius + 1, max(peak.x - radius, 0) : peak.x + radius + 1
                ]
                kept[near] = e[near]
        return kept, confirmed

    def confirms(self, trace: Trace) -> bool:
        if len(trace.points) < self.p["motion_min_points"]:
            return False
        points = np.array(trace.points)
        net = math.hypot(*(points[-1] - points[0]))
        path = float(np.hypot(*np.diff(points, axis=0).T).sum())
        return net >= self.p["motion_distance"] and net >= self.p["motion_straightness"] * path

    def link(self, peaks: list[Peak], shift: np.ndarray) -> list[Trace]:
        """The trace of each peak: closest pairs first, a new one for what is left."""
        owner: list[Trace | None] = [None] * len(peaks)
        found: set[int] = set()
        if peaks and self.traces:
            expected = np.array([t.place + t.velocity * (t.missed + 1) for t in self.traces])
            places = np.array([peak.place for peak in peaks])
            distance = np.hypot(*(places[None] - expected[:, None]).transpose(2, 0, 1))
            near = np.argwhere(distance <= self.gate)
            for t, k in near[np.argsort(distance[tuple(near.T)], kind="stable")].tolist():
                if owner[k] is None and t not in found:
                    owner[k] = self.traces[t]
                    found.add(t)
                    trace, place = self.traces[t], peaks[k].place
                    step = (place - trace.place) / (trace.missed + 1)
                    trace.velocity = 0.7 * trace.velocity + 0.3 * step
                    trace.place, trace.missed = place, 0
        for t, trace in enumerate(self.traces):
            if t not in found:
                trace.missed += 1
        self.traces = [trace for trace in self.traces if trace.missed <= self.p["max_missed"]]
        for k, peak in enumerate(peaks):
            if owner[k] is None:
                trace = owner[k] = Trace(peak.place, shift, self.count)
                self.count += 1
                self.traces.append(trace)
        return [trace for trace in owner if trace is not None]
