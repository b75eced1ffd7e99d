"""Kernels of apg-STMD in float64, rounded once to float32: what the NumPy model is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


def gaussian(sigma: float, radius: int) -> NDArray[np.float64]:
    """exp(-t^2 / 2 sigma^2) at -radius..radius."""
    t = np.arange(-radius, radius + 1)
    return np.exp(-(t**2) / (2 * sigma**2))


def gamma_taps(order: int, tau: float, count: int) -> tuple[NDArray[np.float64], float]:
    """First taps of Gamma(n, tau) under first-order hold, unit sum over all taps; and the pole a = exp(-n / tau).

    Tap i is the integral of Gamma(s) max(0, 1 - |s - i|) ds; Gauss-Legendre over unit intervals is exact to rounding.
    """
    rate = order / tau
    nodes, weights = np.polynomial.legendre.leggauss(40)
    nodes, weights = (nodes + 1) / 2, weights / 2

    def density(s: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.exp(order * np.log(s * rate) - s * rate - math.lgamma(order + 1)) * rate

    starts = np.arange(count)[:, None]
    values = density(starts + nodes) * weights
    rising, falling = values @ nodes, values @ (1 - nodes)
    taps = falling.copy()
    taps[1:] += rising[:-1]
    return taps, math.exp(-rate)


@dataclass(frozen=True)
class Gamma:
    """y(t) = h0 x(t) + sum over j of b[j] c_j(t - 1), with c_0(t) = a c_0(t-1) + x(t), c_j(t) = a (c_j + c_{j-1})(t-1)."""

    pole: float
    h0: float
    b: NDArray[np.float64]

    @classmethod
    def of(cls, order: int, tau: float) -> Gamma:
        taps, pole = gamma_taps(order, tau, order + 3)
        q = taps[1 : order + 2] / pole ** np.arange(order + 1)
        b = []
        for _ in range(order + 1):
            b.append(q[0])
            q = np.diff(q)
        gamma = cls(pole, taps[0], np.array(b))
        # c_j has the impulse response C(t, j) a^t, which sums to a^j / (1 - a)^(j + 1).
        j = np.arange(order + 1)
        total = gamma.h0 + float((gamma.b * pole**j / (1 - pole) ** (j + 1)).sum())
        return cls(pole, gamma.h0 / total, gamma.b / total)


def attention(sigma: float, orientation: float) -> Array:
    """W_a of a scale and orientation; the constant makes the sampled kernel sum to zero."""
    radius = math.ceil(4 * sigma)
    g = gaussian(sigma, radius)
    t = np.arange(-radius, radius + 1)
    c = (t**2 * g).sum() / g.sum()
    u = t[None, :] * math.cos(orientation) - t[:, None] * math.sin(orientation)
    return (2 * (c - u**2) / (math.pi * sigma**4) * np.outer(g, g)).astype(np.float32)


def lateral_profile(p: dict[str, Any]) -> NDArray[np.float64]:
    """g = G(sigma2) - e G(sigma3) - rho."""
    radius = p["radius"]

    def plane(sigma: float) -> NDArray[np.float64]:
        g = gaussian(sigma, radius)
        return np.outer(g, g) / (2 * math.pi * sigma**2)

    return plane(p["center_sigma"]) - p["surround_weight"] * plane(p["surround_sigma"]) - p["offset"]


def lateral(p: dict[str, Any]) -> Array:
    """W_s = A [g]+ + B [g]-."""
    g = lateral_profile(p)
    return np.where(g > 0, p["excitation"] * g, p["inhibition"] * g).astype(np.float32)


def between_directions(p: dict[str, Any]) -> Array:
    """W_d over the circle of 8 directions, as a matrix."""
    k = np.arange(8)
    distance = np.abs(k[:, None] - k)
    distance = np.minimum(distance, 8 - distance)

    def normal(sigma: float) -> NDArray[np.float64]:
        return np.exp(-(distance**2) / (2 * sigma**2)) / (math.sqrt(2 * math.pi) * sigma)

    return (normal(p["direction_center_sigma"]) - normal(p["direction_surround_sigma"])).astype(np.float32)


def prediction(p: dict[str, Any], theta: float) -> Array:
    """W_p of a direction, turned by 180 degrees: `filter2D` correlates."""
    reach, zeta, eta = p["v_opt"] * p["horizon"], p["ring_width"], p["concentration"]
    radius = math.ceil(reach + 3 * zeta)
    t = np.arange(-radius, radius + 1)
    x, y = np.meshgrid(t, -t)
    r = np.hypot(x, y)
    angular = np.exp(eta * np.cos(np.arctan2(y, x) - theta))
    angular[radius, radius] = np.i0(eta)
    w = np.exp(-((r - reach) ** 2) / (2 * zeta**2)) * angular
    return np.ascontiguousarray((w / w.sum())[::-1, ::-1]).astype(np.float32)
