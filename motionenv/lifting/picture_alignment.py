"""The turn of a camera between two pictures, by aligning their pixels.

A camera that turns by R changes pixels by the homography K R K⁻¹, wherever things are. Gauss-Newton on all pixels of
the background finds the three angles, with robust weights and from coarse to fine pictures: the inverse compositional
algorithm (Baker & Matthews 2004, Lucas-Kanade 20 years on). Contrast is equalised first: light and exposure change.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates, uniform_filter
from scipy.spatial.transform import Rotation

_COARSE, _STEPS = 2, 6  # pictures above the finest, each half as large; steps in each
_LOCAL, _CONTRAST = 17, 8.0  # [pixels] over which contrast is equalised, and [grey levels] of contrast that counts
_TAIL = 4.0  # residual, in deviations, at which a pixel has a quarter of its weight
_DONE = 0.03  # [pixels] of a last step
_EDGE, _FEWEST = 2, 100  # [pixels] at the sides that aren't used; pixels that must overlap
_BLOCK, _TEXTURE, _SURE = 16, 0.01, 0.15  # [pixels]; mean squared slope and [pixels] of error of blocks that can tell
_OFF = 1.0  # [pixels] by which a block that agrees may be off


class View:
    """A picture, uint8 (height, width, 3), ready to be aligned; `people` (n, 4) are boxes x0, y0, x1, y1 left out."""

    def __init__(self, picture: np.ndarray, people: Iterable = ()) -> None:
        grey = np.asarray(picture, dtype=np.float32).mean(axis=-1)
        off = grey - uniform_filter(grey, _LOCAL)
        free = np.ones(grey.shape, dtype=bool)
        for x0, y0, x1, y1 in people:
            free[max(0, int(y0)) : max(0, int(y1) + 1), max(0, int(x0)) : max(0, int(x1) + 1)] = False
        values = off / (np.sqrt(uniform_filter(off**2, _LOCAL)) + _CONTRAST)
        self.shape, self.levels = grey.shape, [(values, free)]  # the picture and where it shows no people, ever coarser
        for _ in range(_COARSE):
            values, free = gaussian_filter(values, 1.0)[::2, ::2], free[::2, ::2]
            self.levels.append((values, free))
        self._parts: dict[int, tuple] = {}

    def parts(self, level: int, inner: np.ndarray) -> tuple:
        """Of the free pixels: rows and columns, rays (n, 3), values, slopes (n, 2), and changes by a turn (n, 3)."""
        if level not in self._parts or self._parts[level][0] != inner[0, 0]:
            values, free = self.levels[level]
            inside = np.zeros_like(free)
            inside[_EDGE:-_EDGE, _EDGE:-_EDGE] = free[_EDGE:-_EDGE, _EDGE:-_EDGE]
            at = np.nonzero(inside)
            x, y = ((at[1 - i] - inner[i, 2] / 2**level) / (inner[i, i] / 2**level) for i in range(2))
            slopes = np.stack([slope[at] for slope in np.gradient(gaussian_filter(values, 0.7))[::-1]], axis=-1)
            gx, gy = (slopes * np.diag(inner)[:2] / 2**level).T
            turn = np.stack([-gx * x * y - gy * (1 + y * y), gx * (1 + x * x) + gy * x * y, gy * x - gx * y], axis=-1)
            rays = np.stack([x, y, np.ones_like(x)], axis=-1)
            self._parts[level] = inner[0, 0], (at, rays, values[at], slopes, turn)
        return self._parts[level][1]


def aligned(view: View, key: View, guess: Rotation, inner: np.ndarray) -> Rotation:
    """The turn from the camera's axes in `key` to those in `view`, near a `guess`; `inner` (3, 3) are intrinsics."""
    for level in range(_COARSE, -1, -1):
        for _ in range(_STEPS):
            guess, done = stepped(view, key, guess, inner, level)
            if done:
                break
    return guess


def stepped(view: View, key: View, turn: Rotation, inner: np.ndarray, level: int = 0) -> tuple[Rotation, bool]:
    """The turn after a Gauss-Newton step, and whether that was small: the turn was nearly right."""
    _, rays, values, _, changes = key.parts(level, inner)
    off, both = _residuals(view, turn, inner, level, rays, values)
    off, changes = off[both], changes[both]
    if len(off) < _FEWEST:
        return turn, True
    weighted = changes / (1 + (off / (_TAIL * _deviation(off))) ** 2)[:, None] ** 2
    step = np.linalg.lstsq(weighted.T @ changes, weighted.T @ off, rcond=1e-6)[0]
    return turn * Rotation.from_rotvec(-step), bool(np.abs(step).max() * inner[0, 0] / 2**level < _DONE)


def _deviation(off: np.ndarray) -> float:
    return 1.4826 * float(np.median(np.abs(off))) + 1e-6


def _residuals(view: View, turn: Rotation, inner: np.ndarray, level: int, rays, values) -> tuple[np.ndarray, ...]:
    """Differences of `view`, turned back, from a key's `values`, and where both show the background."""
    picture, free = view.levels[level]
    ways = rays @ turn.as_matrix().T
    ahead = ways[:, 2] > 0
    x, y = (inner[i, i] * ways[:, i] / np.where(ahead, ways[:, 2], 1) + inner[i, 2] for i in range(2))
    x, y = x / 2**level, y / 2**level
    both = ahead & (x > 1) & (y > 1) & (x < free.shape[1] - 2) & (y < free.shape[0] - 2)
    x, y = np.where(both, x, 0), np.where(both, y, 0)
    both &= free[(y + 0.5).astype(int), (x + 0.5).astype(int)]
    return map_coordinates(picture, [y, x], order=1) - values, both


@dataclass(frozen=True)
class Fit:
    """How well a turn aligns two pictures."""

    agree: float  # share of the blocks that are where the turn puts them, along their strongest slopes
    blocks: int  # that have structure enough to tell
    noise: float  # robust deviation of the pixels' residuals
    loss: float  # half the squared residuals in deviations, with robust weights: their mean times the key's pixels


def fit_of(view: View, key: View, turn: Rotation, inner: np.ndarray, noise: float = np.inf) -> Fit:
    """How well a `turn` aligns `view` with `key`; `noise` is what it is between pictures that fit."""
    at, rays, values, slopes, _ = key.parts(0, inner)
    off, both = _residuals(view, turn, inner, 0, rays, values)
    (gx, gy), r = slopes[both].T, off[both]
    noise = min(noise, _deviation(r)) if len(r) else noise
    columns = key.shape[1] // _BLOCK + 1
    block = (at[0] // _BLOCK * columns + at[1] // _BLOCK)[both]
    xx, xy, yy, xr, yr, n = (np.bincount(block, v) for v in (gx * gx, gx * gy, gy * gy, gx * r, gy * r, gx * 0 + 1))
    direction = 0.5 * np.arctan2(2 * xy, xx - yy)
    strongest = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
    tells = (strongest > _TEXTURE * n) & (strongest > (noise / _SURE) ** 2) & (n >= _BLOCK**2 / 2)
    shift = (np.cos(direction) * xr + np.sin(direction) * yr)[tells] / strongest[tells]
    agree = float((np.abs(shift) < _OFF).mean()) if len(shift) else 0.0
    square = (r / noise) ** 2
    loss = 0.5 * square / (1 + square / _TAIL**2)
    return Fit(agree, len(shift), noise, float(loss.mean() * len(rays)) if len(r) else np.inf)
