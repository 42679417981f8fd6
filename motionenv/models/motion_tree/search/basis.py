"""The low-dimensional basis of windows (paper C, section 4, eq. 4 and 5), computed without storing the windows.

A window is ten frames of p parameters. The covariance of all windows consists of lag covariances: the block of the
frames i and i + k before the last is the sum of f(t - i) f(t - i - k)ᵀ over the windows' last frames t. From i - 1 to i
this sum changes only at the ends of the sequences. So ten products of the frames with shifted copies of themselves give
all 100 blocks.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv._core.principal_axes import signs
from motionenv.models.motion_tree.database import Database
from motionenv.models.motion_tree.feature_kernels import parameters_of
from motionenv.models.motion_tree.features import FPS, WINDOW

_CHUNK = 16384
_NEGLIGIBLE = 1e-6  # variances below this share of the largest tell windows apart no more


@dataclass(frozen=True, eq=False)
class Basis:
    """Principal components of standardised windows.

    Attributes:
        channels: (p,) indices of the parameters used, of the 50 of a frame.
        mean, scale: (p,) mean and standard deviation of each parameter, in its unit, which standardise frames.
        components: (b, 10, p) orthonormal axes Ũ; the last frame of the window first.
        centre: (10, p) mean Ψ̄ of the standardised windows.
        deviation: (b,) standard deviation σ_l of the coefficients along each axis.
        share: share of the windows' variance explained by the axes.
    """

    channels: np.ndarray
    mean: np.ndarray
    scale: np.ndarray
    components: np.ndarray
    centre: np.ndarray
    deviation: np.ndarray
    share: float

    @cached_property
    def filter(self) -> tuple[np.ndarray, np.ndarray]:
        """Weights (10, p, b) and offsets (b,) that map ten frames of parameters to standardised coefficients c / σ."""
        weights = np.moveaxis(self.components, 0, -1) / self.scale[:, None] / self.deviation
        offset = np.einsum("bdp,dp->b", self.components, self.centre + self.mean / self.scale) / self.deviation
        return np.ascontiguousarray(weights), offset

    def coefficients(self, parameters: np.ndarray) -> np.ndarray:
        """Standardised coefficients c / σ (..., b) of the last ten frames of `parameters` (..., frames, 50)."""
        weights, offset = self.filter
        last = parameters[..., : -WINDOW - 1 : -1, self.channels]
        return last.reshape(*last.shape[:-2], -1) @ weights.reshape(-1, len(offset)) - offset


def fit_basis(database: Database, channels: np.ndarray) -> Basis:
    """The basis of the n windows of a `database`: b = ⌊log₂ n⌋ components (paper C) of `channels` (p,) of a frame's 50.

    Parameters are divided by their standard deviations first, as by Σ in paper C's eq. 3. Otherwise the approximation
    of its Observation 1 doesn't hold.
    """
    n = len(database.windows)
    sums, products = _window_moments(database, channels)
    mean = sums[0] / n
    scale = _positive(np.sqrt(np.maximum(np.diag(products[0, :, 0]) / n - mean**2, 0.0)))
    average = sums / n
    covariance = (products / n - average[:, :, None, None] * average) / (scale[:, None, None] * scale)
    size = WINDOW * len(channels)
    values, axes = np.linalg.eigh(covariance.reshape(size, size))
    values, axes = values[::-1], axes[:, ::-1].T
    b = max(1, min(int(np.log2(n)), int((values > _NEGLIGIBLE * values[0]).sum())))
    kept = axes[:b] * signs(axes[:b])[:, None]
    return Basis(
        channels=channels, mean=mean, scale=scale,
        components=np.ascontiguousarray(kept).reshape(b, WINDOW, -1), centre=(average - mean) / scale,
        deviation=_positive(np.sqrt(np.maximum(values[:b], 0.0))),
        share=float(values[:b].sum() / values[values > 0].sum()) if values[0] > 0 else 1.0,
    )  # fmt: skip


def project(database: Database, basis: Basis, out: np.ndarray) -> None:
    """Write the standardised coefficients c / σ of all n windows to slices of `out` (n, b), float32.

    Computed in double precision: then they are the same on every processor, and so is the tree.
    """
    weights, offset = basis.filter
    weights = np.ascontiguousarray(weights.transpose(1, 0, 2).reshape(len(basis.channels), -1))
    b, done = len(basis.deviation), 0
    for first, now, frames in _chunks(database, basis.channels):
        parts = (frames @ weights).reshape(len(frames), WINDOW, b)
        ends = now - first + WINDOW - 1
        out[done : done + len(ends)] = sum(parts[ends - lag, lag] for lag in range(WINDOW)) - offset
        done += len(ends)


def _window_moments(database, channels) -> tuple[np.ndarray, np.ndarray]:
    """Sum (10, p) and sum of outer products (10, p, 10, p) of all windows."""
    p = len(channels)
    sums, products = np.zeros((WINDOW, p)), np.zeros((WINDOW, p, WINDOW, p))
    for first, now, frames in _chunks(database, channels):
        ends = now - first + WINDOW - 1
        current = np.zeros((len(frames), p))
        current[ends] = frames[ends]
        sums[0] += current.sum(0)
        for lag in range(WINDOW):
            products[0, :, lag] += current[WINDOW - 1 :].T @ frames[WINDOW - 1 - lag : len(frames) - lag]
    heads = _edges(database, channels, database.starts[:-1])
    tails = _edges(database, channels, database.starts[1:] - WINDOW)
    for i in range(1, WINDOW):
        entering, leaving = heads[:, WINDOW - 1 - i], tails[:, WINDOW - 1 - i]
        sums[i] = sums[i - 1] + entering.sum(0) - leaving.sum(0)
        for j in range(i, WINDOW):
            change = entering.T @ heads[:, WINDOW - 1 - j] - leaving.T @ tails[:, WINDOW - 1 - j]
            products[i, :, j] = products[i - 1, :, j - 1] + change
    for i in range(WINDOW):
        for j in range(i):
            products[i, :, j] = products[j, :, i].T
    return sums, products


def _chunks(database, channels) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield chunks: the first new frame, the windows that end in the chunk, and its parameters.

    The parameters (9 + frames, p) begin nine frames earlier, padded with zeros at the start of the database.
    """
    bounds = np.searchsorted(database.windows, np.arange(0, len(database.poses) + _CHUNK, _CHUNK))
    for i, first in enumerate(range(0, len(database.poses), _CHUNK)):
        lead = min(first, WINDOW - 1)
        last = min(first + _CHUNK, len(database.poses))
        frames = np.zeros((WINDOW - 1 + last - first, len(channels)))
        frames[WINDOW - 1 - lead :] = _parameters(database, channels, first - lead, last)
        yield first, database.windows[bounds[i] : bounds[i + 1]], frames


def _edges(database, channels, firsts) -> np.ndarray:
    """Parameters (sequences, 10, p) of the ten frames that begin at each of `firsts`."""
    return np.stack([_parameters(database, channels, f, f + WINDOW) for f in firsts])


def _parameters(database, channels, first, last) -> np.ndarray:
    """Parameters (last - first, p) of frames."""
    raw = np.empty((last - first, 50))
    parameters_of(database.poses, database.starts[:-1], first, last, FPS, raw)
    return raw[:, channels]


def _positive(scale: np.ndarray) -> np.ndarray:
    return np.where(scale > 1e-6, scale, 1.0)
