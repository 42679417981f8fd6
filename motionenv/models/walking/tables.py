"""Tables that the synthesis of walks needs and that depend on the model alone."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from motionenv.body.limbs import limb_radii
from motionenv.types import ANGLES, Skeleton

if TYPE_CHECKING:
    from motionenv.models.fpca import FunctionalPCA
    from motionenv.models.walking.model import WalkingModel

#: Channels of the cycles: the 19 angles and the root's rotations [rad], the ankles' heights [body heights].
CHANNELS = (*ANGLES, "root_tilt", "root_obliquity", "root_heading", "left_ankle_height", "right_ankle_height")
_NO_VARIANCE = 1e-9  # eigenvalues below this share of the largest are rounding errors


@dataclass(frozen=True)
class Tables:
    """Tables for the synthesis of walks.

    Attributes:
        body: the mean body.
        people: (q + 1, q + 1) square root of the covariance of scores and log stride times.
        pace: (q,) regression weights of the log stride time on the scores.
        cycles: (q, q) square root of the covariance of the control points of score splines.
        terms: argument of `motionenv.models.walking._walk_kernels.walk`.
        heights: (2, 1 + q, P) of the ankles over a cycle, of mean and components [body heights].
    """

    body: Skeleton
    people: np.ndarray
    pace: np.ndarray
    cycles: np.ndarray
    terms: np.ndarray
    heights: np.ndarray


def tables_of(model: "WalkingModel") -> Tables:
    """The tables of a fitted `model`."""
    from motionenv.models.walking._walk_kernels import ORDER

    fpca, height = model.fpca_, model.height_
    samples, harmonics = len(fpca.mean_), fpca.n_harmonics
    series = np.concatenate([fpca.mean_coefficients_[None], fpca.component_coefficients_])
    series[:, 0] *= np.sqrt(1 / samples)
    series[:, 1:] *= np.sqrt(2 / samples)
    # The constant, then sine and cosine of each harmonic in turn.
    columns = [0, *np.column_stack([np.arange(harmonics, 2 * harmonics - 1), np.arange(1, harmonics)]).ravel()]
    ankles = np.concatenate([fpca.mean_[None], fpca.components_])[..., -2:]
    series = in_order(series, fpca.channels_, 0.0)
    return Tables(
        Skeleton(model.proportions_ * height, limb_radii(height), height),
        root_of(model.person_covariance_[:-1, :-1]),
        # Singular if fitted to few walks: the pseudo-inverse leaves the undetermined part at the mean.
        np.linalg.pinv(model.person_covariance_[:-2, :-2], _NO_VARIANCE, hermitian=True)
        @ model.person_covariance_[:-2, -2],
        # A uniform cubic B-spline of unit-variance control points has a variance of 0.46 to 0.5.
        root_of(model.cycle_covariance_) / np.sqrt(0.48),
        np.ascontiguousarray(series[:, columns][..., ORDER]).reshape(len(series), -1),
        np.ascontiguousarray(np.moveaxis(ankles, -1, 0)),
    )


def series_of(fpca: "FunctionalPCA") -> dict[str, np.ndarray]:
    """Fourier series of all channels: `mean` (columns, 24) and `components` (q, columns, 24), a constant, then waves.

    Columns of the basis have amplitude 1: all cosines, then all sines. Of channels that `fpca` lacks, the mean is NaN.
    """
    scale = np.full((2 * fpca.n_harmonics - 1, 1), np.sqrt(2 / len(fpca.mean_)))
    scale[0] = np.sqrt(1 / len(fpca.mean_))
    return {
        "mean": in_order(scale * fpca.mean_coefficients_, fpca.channels_, np.nan),
        "components": in_order(scale * fpca.component_coefficients_, fpca.channels_, 0.0),
    }


def in_order(values: np.ndarray, channels: tuple[str, ...], lacking: float) -> np.ndarray:
    """Values (..., m) of some `channels` as (..., 24) in the order of `CHANNELS`, `lacking` for the others."""
    out = np.full((*values.shape[:-1], len(CHANNELS)), lacking)
    out[..., [CHANNELS.index(name) for name in channels]] = values
    return out


def lacking_angles(model: "WalkingModel") -> list[int]:
    """Entries of the pose vector that a fitted `model` doesn't know: of limbs that none of its walks shows."""
    return [6 + i for i, name in enumerate(ANGLES) if name not in model.fpca_.channels_]


def floors_of(tables: Tables, scores: np.ndarray) -> np.ndarray:
    """The 10th percentiles (n, 2) of the heights of both ankles over the cycles of walkers with `scores` (n, q)."""
    cycles = tables.heights[:, 0] + np.swapaxes(scores @ tables.heights[:, 1:], 0, 1)
    at = 0.1 * (cycles.shape[-1] - 1)
    low = int(at)
    cycles.partition((low, low + 1), axis=-1)  # np.percentile takes several times as long for one walker
    return cycles[..., low] + (at - low) * (cycles[..., low + 1] - cycles[..., low])


def root_of(covariance: np.ndarray) -> np.ndarray:
    """The symmetric square root (k, k) of a `covariance` that may be singular.

    Unlike eigenvectors, whose signs differ between CPUs and libraries, it is unique: a seed gives the same walk on
    every machine. Eigenvalues that are rounding errors count as 0: their roots would be 1e-8 of the largest.
    """
    values, vectors = np.linalg.eigh(covariance)
    values[values < _NO_VARIANCE * values[-1]] = 0.0
    return vectors * np.sqrt(values) @ vectors.T
