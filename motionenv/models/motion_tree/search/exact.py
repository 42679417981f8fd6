r"""Exact draws from p(i | t) ∝ exp(-|z_i - z_t|² / 2β) (paper C, eq. 3 with Observation 1), by brute force.

In the dimensions of windows, a kd-tree with branch and bound was no faster. Points lie in blocks of 32, coordinate by
coordinate, so that vector instructions compute several distances at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.compilation import kernel
from motionenv._core.random import restart, uniform
from motionenv._core.threads import in_chunks
from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import MotionError

BLOCK = 32  # points
_CHUNK = 2**16  # points that are rearranged at a time
_PROBES = 4  # least number per thread
_FARTHEST = 1e15  # squares of greater numbers overflow in single precision
_STEEPEST = 1e300  # greatest 1/2β; greater values have the same effect
_NEGLIGIBLE = 50.0  # exponent from which kernels are rounded off a sum that has a kernel of 1
_SLACK = 1.0 + 3e-5  # for the rounding of distances in single precision

_simd = kernel(fastmath={"contract", "nnan", "nsz", "reassoc"})


@dataclass(frozen=True, eq=False)
class ExactSampler:
    """Points, and draws of them.

    Attributes:
        blocks: (⌈n / 32⌉, b, 32) float32 coordinates; position i is `blocks[i // 32, :, i % 32]`. The last block is
            padded with +inf.
        n: number of points.
    """

    blocks: np.ndarray
    n: int

    @classmethod
    def build(cls, rows: np.ndarray, n: int) -> ExactSampler:
        """A sampler of the first `n` of `rows`, one at least.

        `rows` (⌈n / 32⌉ · 32, b) are float32 and contiguous; they are rearranged in place, as a copy may not fit in
        memory, so don't use them afterwards.
        """
        rows[n:] = np.inf
        for i in range(0, len(rows), _CHUNK):
            part = rows[i : i + _CHUNK]
            part[:] = part.reshape(-1, BLOCK, rows.shape[1]).swapaxes(1, 2).reshape(part.shape)
        return cls(rows.reshape(-1, rows.shape[1], BLOCK), n)

    def coefficients(self, positions: ArrayLike) -> np.ndarray:
        """Coordinates (..., b) float32 of the points at `positions` (...)."""
        positions = np.asarray(positions)
        return self.blocks[positions // BLOCK, :, positions % BLOCK]

    def draw(self, probes: np.ndarray, count: int, beta: float, key: int) -> tuple[np.ndarray, np.ndarray]:
        """Positions drawn with probabilities proportional to exp(-|z - probe|² / 2β), and logarithms of these.

        Args:
            probes: (probes, b).
            count: draws for each probe.
            beta: temperature β.
            key: key of the random streams, from 0 to 2⁶⁴ - 1; probe i uses stream i.

        Returns:
            Positions (probes, count) int32 and their log-probabilities (probes, count).

        Raises:
            MotionError: probes of another width or not finite, a count below 1, or β not above 0.
        """
        probes, beta = self.checked(probes, beta)
        out = np.empty((len(probes), checked_whole(count, "count", 1)), np.int32)
        log_probability = np.empty(out.shape)
        stream = np.uint64(key)

        def work(start, stop):
            draw_all(self.blocks, probes[start:stop], beta, stream, start, out[start:stop], log_probability[start:stop])

        in_chunks(work, len(probes), _PROBES)
        return out, log_probability

    def checked(self, probes: ArrayLike, beta: float) -> tuple[np.ndarray, float]:
        """`probes` as contiguous float32 and `beta` as a float; a MotionError as of `draw`."""
        b = self.blocks.shape[1]
        probes = np.ascontiguousarray(probes, dtype=np.float32)
        if probes.ndim != 2 or probes.shape[1] != b:
            raise MotionError(f"probes must have shape (probes, {b}), got {probes.shape}")
        if not (np.abs(probes) <= _FARTHEST).all():
            worst = np.argwhere(~(np.abs(probes) <= _FARTHEST))[0]
            raise MotionError(
                f"probes must be finite numbers below {_FARTHEST:g}, got {probes[tuple(worst)]} in probe {worst[0]}: "
                "leave out or fill missing values"
            )
        return probes, checked_number(beta, "beta (temperature)", above=0)


@_simd
def squared_distances(block, probe, out):
    """Write the squared distances (32,) of a probe (b,) to the points of a block (b, 32); return the least.

    They are as precise as the probe.
    """
    out[:] = 0.0
    for d in range(len(probe)):
        here = probe[d]
        for i in range(len(out)):  # with a constant length it isn't vectorised
            away = block[d, i] - here
            out[i] += away * away
    least = out[0]
    for i in range(len(out)):
        least = min(least, out[i])
    return least


@kernel
def draw(blocks, probe, beta, state, weights, sums, out, log_probability):
    """Draw positions `out` (count,) int32 for a probe (b,) float32, and write their `log_probability` (count,).

    `state` is a stream of `motionenv._core.random`, which is advanced. `weights` (blocks, 32) and `sums` (blocks,) are
    scratch: kernels relative to that of the nearest point, and their running sum.
    """
    last = _weigh(blocks, probe, min(0.5 / beta, _STEEPEST), weights, sums)
    for k in range(len(out)):
        u = uniform(state) * sums[last]
        j = min(np.searchsorted(sums, u, side="right"), last)
        u -= sums[j - 1] if j else 0.0
        for i in range(BLOCK):
            if weights[j, i] > 0.0:
                out[k], log_probability[k] = BLOCK * j + i, np.log(weights[j, i] / sums[last])
            if u < weights[j, i]:
                break
            u -= weights[j, i]


@kernel
def _weigh(blocks, probe, steepness, weights, sums):
    """Fill `weights` of blocks that aren't far, and `sums` of all; return the last block that isn't far.

    Double precision is for the blocks that single precision finds near.
    """
    row, precise, nearest, whole, last = np.empty(BLOCK, np.float32), probe.astype(np.float64), np.inf, 0.0, 0
    for j in range(len(blocks)):
        sums[j] = squared_distances(blocks[j], probe, row)
    far = (sums.min() + _NEGLIGIBLE / steepness) * _SLACK
    for j in range(len(blocks)):
        if sums[j] <= far:
            nearest, last = min(nearest, squared_distances(blocks[j], precise, weights[j])), j
    for j in range(len(blocks)):
        if sums[j] <= far:
            for i in range(BLOCK):
                exponent = (weights[j, i] - nearest) * steepness
                weights[j, i] = np.exp(-exponent) if exponent < _NEGLIGIBLE else 0.0
                whole += weights[j, i]
        sums[j] = whole
    return last


@kernel
def draw_all(blocks, probes, beta, key, start, out, log_probability):
    """Fill `out`, `log_probability` (probes, count) for probes (probes, b), of which the first uses stream `start`."""
    weights, sums = np.empty((len(blocks), BLOCK)), np.empty(len(blocks))
    state = np.empty(1, np.uint64)
    for i in range(len(probes)):
        restart(state, key, start + i)
        draw(blocks, probes[i], beta, state, weights, sums, out[i], log_probability[i])
