"""apg-STMD in NumPy and OpenCV, float32: what a user would write from the equations, with care for speed.

Gamma filters are cascades that share their poles, spatial kernels go through OpenCV. With `separable` Gaussians are
passed along rows and columns, and attention and lateral inhibition are built from those; without, `filter2D` takes each
kernel as the equations give it. Rejection is `motion`, attention has full support.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import cv2
import numpy as np

import kernels
from kernels import Array, Gamma, gaussian
from rejection import Rejection

ORIENTATIONS = [j * math.pi / 4 for j in range(4)]
DIRECTIONS = np.arange(8) * math.pi / 4
ZERO, REPLICATE = cv2.BORDER_CONSTANT, cv2.BORDER_REPLICATE


class Cascade:
    """Gamma filters of one pole, over one input."""

    def __init__(self, shape: tuple[int, int], filters: list[Gamma]) -> None:
        order = max(len(gamma.b) for gamma in filters)
        self.a = np.float32(filters[0].pole)
        assert all(math.isclose(gamma.pole, filters[0].pole, rel_tol=1e-12) for gamma in filters), (
            "poles are shared"
        )
        self.b = np.array([np.pad(gamma.b, (0, order - len(gamma.b))) for gamma in filters], np.float32)
        self.h0 = np.array([gamma.h0 for gamma in filters], np.float32)
        self.c = np.zeros((order, *shape), np.float32)

    def prime(self, x: Array) -> None:
        """As if x had stood for ever."""
        np.divide(x, 1 - self.a, out=self.c[0])
        for before, after in zip(self.c, self.c[1:], strict=False):
            np.multiply(before, self.a / (1 - self.a), out=after)

    def process(self, x: Array) -> Array:
        c = self.c
        y = (self.b @ c.reshape(len(c), -1)).reshape(-1, *x.shape)
        for row, h0 in zip(y, self.h0, strict=True):
            row += h0 * x
        for j in range(len(c) - 1, 0, -1):
            np.add(c[j], c[j - 1], out=c[j])
        c *= self.a
        c[0] += x
        return y


class Output(NamedTuple):
    response: Array
    direction: Array
    detections: list[tuple[float, float, float, float, int]]
    """x, y, score, direction, trace: at the peak of the response, strongest first."""


class ApgStmd:
    """One stream. `params` is the dict that the parameter file holds."""

    def __init__(self, height: int, width: int, params: dict[str, Any], *, separable: bool = False) -> None:
        assert params["model"] == "apg-stmd" and params["rejection"]["mode"] == "motion"
        assert params["attention"]["support"] == "full" and params["lobula"]["offset"] == 0
        self.params, self.separable = params, separable
        shape = (height, width)
        lamina, medulla, self.lobula = params["lamina"], params["medulla"], params["lobula"]
        self.predict = params["prediction"]

        sigma = params["retina"]["sigma"]
        self.blur = unit_gaussian(sigma, math.ceil(4 * sigma))
        fast, slow = (Gamma.of(lamina[f"{k}_order"], lamina[f"{k}_tau"]) for k in ("fast", "slow"))
        difference = np.array(slow.b) * -1
        difference[: len(fast.b)] += fast.b
        self.lmc = Cascade(shape, [Gamma(fast.pole, fast.h0 - slow.h0, difference)])
        on, *off = (Gamma.of(medulla[f"{k}_order"], medulla[f"{k}_tau"]) for k in ("mi1", "tm1_4", "tm1_5"))
        self.mi1, self.tm1 = Cascade(shape, [on]), Cascade(shape, off)

        self.scales = params["attention"]["scales"]
        self.attention = [[kernels.attention(s, phi) for phi in ORIENTATIONS] for s in self.scales]
        self.w_s = kernels.lateral(self.lobula)
        self.w_d = kernels.between_directions(self.lobula)
        self.w_p = [kernels.prediction(self.predict, theta) for theta in DIRECTIONS]
        spacing = self.lobula["spacing"]
        self.upstream = [(round(-spacing * math.cos(t)), round(spacing * math.sin(t))) for t in DIRECTIONS]
        self.rejection = Rejection(height, width, params)

        self.horizon = self.predict["horizon"]
        self.memory_f = np.zeros((self.horizon + 1, 8, height, width), np.float32)
        self.memory_m = np.zeros((self.horizon + 1, height, width), np.float32)
        self.region: Array | None = None
        self.before: Array | None = None
        self.whole: Array | None = None
        self.seen: Array | None = None
        self.frames = 0
        self.stages: dict[str, Array] = {}

    def process(self, frame: np.ndarray) -> Output:
        """The next frame, uint8 or luminance in [0, 1]."""
        luminance = frame * np.float32(1 / 255) if frame.dtype == np.uint8 else frame
        p = cv2.sepFilter2D(luminance, -1, self.blur, self.blur, borderType=REPLICATE)
        a, pe, seen = self.attend(p)
        if self.frames == 0:
            self.lmc.prime(seen)
        l = self.lmc.process(seen)[0]
        self.before, self.seen = p, seen
        tm3, tm2 = np.maximum(l, 0), np.maximum(-l, 0)
        mi1 = self.mi1.process(tm3)[0]
        tm1_4, tm1_5 = self.tm1.process(tm2)
        d, e = self.detect(tm3, mi1, tm1_4, tm1_5)
        kept, confirmed = self.rejection.process(p, e)
        f, m = self.gain(kept)
        q = self.facilitate(kept)
        self.frames += 1
        self.stages = dict(
            P=p,
            A=a,
            Pe=pe,
            L=l,
            Tm3=tm3,
            Tm2=tm2,
            Mi1=mi1,
            Tm1_4=tm1_4,
            Tm1_5=tm1_5,
            D=d,
            E=e,
            Ep=kept,
            F=f,
            M=m,
            Q=q,
        )
        return self.read_out(q, confirmed)

    def attend(self, p: Array) -> tuple[Array, Array, Array]:
        """A, P_e and what the lamina sees."""
        p_attention = self.params["attention"]
        if self.frames >= self.horizon:
            # The slot that this frame will overwrite next is dt + 1 frames old; the one after it dt.
            m = self.memory_m[(self.frames + 1) % (self.horizon + 1)]
            inside = m > max(p_attention["threshold"] * float(m.max()), p_attention["threshold_floor"])
            if self.region is None:
                self.region = inside.astype(np.float32)
            else:
                self.region += (inside - self.region) * np.float32(1 / p_attention["ramp"])
        change = p_attention["gate"] == "change"
        step = p if self.seen is None or not change else self.seen + (p - self.before)
        if self.region is None or not self.region.any():
            self.whole = None
            return np.zeros_like(p), p, step
        now = self.speckles(p)
        alpha = np.float32(p_attention["alpha"])
        a = now * self.region
        if not change:
            return a, p + alpha * a, p + alpha * a
        assert self.before is not None
        before = self.speckles(self.before) if self.whole is None else self.whole
        self.whole = now
        return a, p + alpha * a, step + alpha * self.region * (now - before)

    def speckles(self, p: Array) -> Array:
        """What all orientations agree on at some scale, or for "light" the paper's choice."""
        both = self.params["attention"]["speckles"] == "both"
        light = np.full_like(p, 0 if both else -np.inf)
        dark = np.zeros_like(p)
        for scale, oriented in zip(self.scales, self.attention, strict=True):
            maps = (
                self.steered(p, scale)
                if self.separable
                else (cv2.filter2D(p, -1, w, borderType=REPLICATE) for w in oriented)
            )
            least = next(maps)
            greatest = least.copy()
            for other in maps:
                np.minimum(least, other, out=least)
                np.maximum(greatest, other, out=greatest)
            np.maximum(light, least, out=light)
            np.minimum(dark, greatest, out=dark)
        return light + dark if both else light

    def steered(self, p: Array, sigma: float) -> Iterator[Array]:
        """P * W_a for the four orientations, from the moments t^j exp(-t^2 / 2 sigma^2)."""
        radius = math.ceil(4 * sigma)
        t = np.arange(-radius, radius + 1)
        g = gaussian(sigma, radius) * math.sqrt(2 / (math.pi * sigma**4))
        g0, g1, g2 = ((t**j * g).astype(np.float32) for j in range(3))
        c = float((t**2 * g).sum() / g.sum())
        along = {
            (j, k): cv2.sepFilter2D(p, -1, x, y, borderType=REPLICATE)
            for (j, x), (k, y) in [((0, g0), (0, g0)), ((2, g2), (0, g0)), ((0, g0), (2, g2)), ((1, g1), (1, g1))]
        }
        flat, xx, yy, xy = along[0, 0] * np.float32(c), along[2, 0], along[0, 2], along[1, 1]
        half = flat - np.float32(0.5) * (xx + yy)
        yield flat - xx
        yield half + xy
        yield flat - yy
        yield half - xy

    def detect(self, tm3: Array, mi1: Array, tm1_4: Array, tm1_5: Array) -> tuple[Array, Array]:
        d = np.zeros((8, *tm3.shape), np.float32)
        s = np.empty_like(d)
        for k, (dx, dy) in enumerate(self.upstream):
            here, there = overlap(tm3.shape, dy, dx)
            product = tm1_4[here] + mi1[there]
            product *= tm3[here]
            product *= tm1_5[there]
            d[k][here] = product
            if self.separable:
                s[k] = self.inhibit(d[k])
            else:
                cv2.filter2D(d[k], -1, self.w_s, dst=s[k], borderType=ZERO)
        np.maximum(s, 0, out=s)
        e = (self.w_d @ s.reshape(8, -1)).reshape(s.shape)
        e[e <= self.lobula["response_floor"]] = 0
        return d, e

    def inhibit(self, d: Array) -> Array:
        """D * W_s = B (D * g) + (A - B) (D * [g]+): two Gaussians and a small core."""
        p = self.lobula
        profile = kernels.lateral_profile(p)
        radius = p["radius"]
        reach = max(i for i in range(radius + 1) if (profile[radius + i] > 0).any())
        core = np.maximum(profile[radius - reach : radius + reach + 1, radius - reach : radius + reach + 1], 0)
        out = cv2.filter2D(d, -1, ((p["excitation"] - p["inhibition"]) * core).astype(np.float32), borderType=ZERO)
        for sigma, weight in ((p["center_sigma"], 1.0), (p["surround_sigma"], -p["surround_weight"])):
            g = (gaussian(sigma, radius) / (math.sqrt(2 * math.pi) * sigma)).astype(np.float32)
            out += np.float32(p["inhibition"] * weight) * cv2.sepFilter2D(d, -1, g, g, borderType=ZERO)
        return out

    def gain(self, kept: Array) -> tuple[Array, Array]:
        mu = np.float32(self.predict["mu"])
        slots = self.horizon + 1
        old = self.memory_f[(self.frames + 1) % slots]
        f, m = self.memory_f[self.frames % slots], self.memory_m[self.frames % slots]
        for k, w in enumerate(self.w_p):
            if kept[k].any() or old[k].any():
                mixed = mu * kept[k] + (1 - mu) * old[k]
                cv2.filter2D(mixed, -1, w, dst=f[k], borderType=ZERO)
            else:
                f[k] = 0
        f.sum(axis=0, out=m)
        return f, m

    def facilitate(self, kept: Array) -> Array:
        slots = self.horizon + 1
        age = (self.frames - np.arange(slots)) % slots
        weights = (self.predict["beta"] * np.exp(self.predict["kappa"] * (age - self.horizon))).astype(np.float32)
        q = (weights @ self.memory_f.reshape(slots, -1)).reshape(kept.shape)
        q += kept
        return q

    def read_out(self, q: Array, confirmed: list[Any]) -> Output:
        response = q.max(axis=0)
        cosines, sines = (np.tensordot(f(DIRECTIONS).astype(np.float32), q, 1) for f in (np.cos, np.sin))
        direction = np.arctan2(sines, cosines)
        direction[response == 0] = np.nan
        found = [
            (*peak.place.tolist(), float(response[peak.y, peak.x]), float(direction[peak.y, peak.x]), trace)
            for peak, trace in confirmed
        ]
        return Output(response, direction, sorted(found, key=lambda row: -row[2]))


def unit_gaussian(sigma: float, radius: int) -> Array:
    g = gaussian(sigma, radius)
    return (g / g.sum()).astype(np.float32)


def overlap(shape: tuple[int, ...], dy: int, dx: int) -> tuple[Any, Any]:
    """Where both x and x + (dx, dy) are in the picture, and the latter."""
    here, there = [], []
    for size, d in zip(shape, (dy, dx), strict=True):
        here.append(slice(max(0, -d), min(size, size - d)))
        there.append(slice(max(0, d), min(size, size + d)))
    return tuple(here), tuple(there)
