r"""Errors of a reconstructed walk in the dimension that its picture lacks: paper B, eqs. 4.1 to 4.4.

With p(t) a joint's place in the missing dimension and p̃(t) its reconstruction, over a cycle of T frames:

    E_abs(j) = 1/T Σ_t (p(t) - p̃(t))²          (4.1)      E_a = 1/15 Σ_j E_abs(j)     (4.2)
    E_rel(j) = E_abs(j) / σ²                   (4.3)      E_r = 1/15 Σ_j E_rel(j)     (4.4)

They are squared (m²; × 10⁶ gives the paper's mm²): the square root of E_a is an rms error. A walk is given by the five
Fourier coefficients of each joint (`motionenv.models.harmonics`), whose mean over a cycle is a closed form by
Parseval's theorem, the limit of many frames; or, with `frames=True`, frame by frame.

Joints whose truth is unknown (NaN) are left out of means; where the truth is known, an estimate with NaN gives NaN.

The paper calls σ² "the average overall variance of the 15 joints in the missing dimension". It speaks of a walker's
"overall postural variance" where it says what the harmonics explain, so we read: the variance of each joint over time,
averaged over the joints of that walker. `posture=True` takes the other reading, the spread of all joints and times
about their common mean; it adds how far apart the joints stay, and legs and arms that stand side by side are far apart
in depth. Figure 5 settles it: seen in profile, variance is least there and relative errors are greatest. So they are
with our walkers in the first reading, while in the second it is the other way round (benchmarks/RESULTS.md).
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.metrics.points import mpjpe
from motionenv.models.harmonics import PARTS, positions_at
from motionenv.types import MARKERS


def joint_error(estimate, truth, *, frames: bool = False) -> np.ndarray:
    """E_abs(j) (..., 15) [m²] of each joint in the missing dimension (eq. 4.1).

    Args:
        estimate: (..., 5, 15) [m], coefficients of the reconstruction; or (..., frames, 15) positions.
        truth: of the same kind, NaN where unknown; leading axes broadcast.
        frames: True takes both for positions over time.

    Raises:
        MotionError: shapes that mean neither, or don't go together.
    """
    return _mean_square(_difference(estimate, truth, frames), frames)


def walker_error(estimate, truth, *, frames: bool = False) -> np.ndarray:
    """E_a (...) [m²] of each walk: the mean of `joint_error` over the joints whose truth is known (eq. 4.2).

    Args:
        estimate: (..., 5, 15) [m] coefficients, or (..., frames, 15) positions.
        truth: of the same kind.
        frames: True takes both for positions over time.

    Raises:
        MotionError: as `joint_error`.
    """
    return _over_joints(joint_error(estimate, truth, frames=frames), truth)


def missing_variance(truth, *, posture: bool = False, frames: bool = False) -> np.ndarray:
    """σ² (...) [m²] of eq. 4.3 and fig. 5c: the variance of the joints in the missing dimension.

    Args:
        truth: (..., 5, 15) [m] coefficients, or (..., frames, 15) positions; NaN where unknown.
        posture: False for each joint's variance over time, averaged over the joints; True for the variance over
            joints and times together, the mean posture included.
        frames: True takes `truth` for positions over time.

    Raises:
        MotionError: another shape.
    """
    truth = _walks(truth, frames, "truth")
    middle = truth.mean(axis=-2) if frames else truth[..., 0, :]
    moving = _mean_square(truth, frames) - middle**2
    variance = _over_joints(moving, truth)
    if not posture:
        return variance
    centre = _over_joints(middle, truth)
    return variance + _over_joints((middle - centre[..., None]) ** 2, truth)


def relative_joint_error(estimate, truth, *, posture: bool = False, frames: bool = False) -> np.ndarray:
    """E_rel(j) (..., 15) of each joint: its `joint_error` over the walk's `missing_variance` (eq. 4.3).

    Args:
        estimate: (..., 5, 15) [m] coefficients, or (..., frames, 15) positions.
        truth: of the same kind.
        posture: which variance, as in `missing_variance`.
        frames: True takes both for positions over time.

    Raises:
        MotionError: as `joint_error`.
    """
    variance = missing_variance(truth, posture=posture, frames=frames)
    return joint_error(estimate, truth, frames=frames) / variance[..., None]


def relative_walker_error(estimate, truth, *, posture: bool = False, frames: bool = False) -> np.ndarray:
    """E_r (...) of each walk: the mean of `relative_joint_error` over the joints whose truth is known (eq. 4.4).

    Args:
        estimate: (..., 5, 15) [m] coefficients, or (..., frames, 15) positions.
        truth: of the same kind.
        posture: which variance, as in `missing_variance`.
        frames: True takes both for positions over time.

    Raises:
        MotionError: as `joint_error`.
    """
    return _over_joints(relative_joint_error(estimate, truth, posture=posture, frames=frames), truth)


def cycle_mpjpe(estimate, truth, *, samples: int = 32) -> np.ndarray:
    """`mpjpe` (...) [m] over a cycle: distances of the joints in three dimensions, beside paper B's squares in one.

    A distance has no closed form in the coefficients, so it is averaged over equally spaced phases.

    Args:
        estimate: (..., 5, 15, 3) [m], coefficients of the reconstruction.
        truth: (..., 5, 15, 3) [m], NaN where unknown.
        samples: how many phases.

    Raises:
        MotionError: another shape, or no sample.
    """
    for name, w in (("estimate", estimate), ("truth", truth)):
        if np.shape(w)[-3:] != (len(PARTS), len(MARKERS), 3):
            raise MotionError(f"{name} must hold coefficients (..., 5, 15, 3), got {np.shape(w)}")
    if isinstance(samples, bool) or samples != int(samples) or samples < 1:
        raise MotionError(f"samples must be a whole number of phases from 1, got {samples!r}")
    phases = np.arange(samples) * (2 * np.pi / samples)
    return mpjpe(positions_at(estimate, phases), positions_at(truth, phases)).mean(axis=-1)


def _mean_square(values: np.ndarray, frames: bool) -> np.ndarray:
    """Mean of the squares (..., 15) over time, of coefficients (..., 5, 15) by Parseval or of (..., frames, 15)."""
    if frames:
        return (values**2).mean(axis=-2)
    return values[..., 0, :] ** 2 + 0.5 * (values[..., 1:, :] ** 2).sum(axis=-2)


def _over_joints(values: np.ndarray, truth) -> np.ndarray:
    """Mean (...) of `values` (..., 15) over the joints that `truth` knows; NaN if it knows none."""
    known = np.isfinite(np.asarray(truth, dtype=np.float64)).all(axis=-2)
    known, values = np.broadcast_arrays(known, values)
    with np.errstate(invalid="ignore"):
        return np.where(known, values, 0.0).sum(axis=-1) / known.sum(axis=-1)


def _difference(estimate, truth, frames: bool) -> np.ndarray:
    estimate, truth = _walks(estimate, frames, "estimate"), _walks(truth, frames, "truth")
    if estimate.shape[-2] != truth.shape[-2]:
        raise MotionError(f"estimate has {estimate.shape[-2]} frames, truth {truth.shape[-2]}: give the same ones")
    try:
        return estimate - truth
    except ValueError:
        raise MotionError(f"an estimate of shape {estimate.shape} doesn't go with a truth of {truth.shape}") from None


def _walks(values, frames: bool, name: str) -> np.ndarray:
    """`values` as float64.

    Raises:
        MotionError: they are not coefficients (..., 5, 15), or, with `frames`, positions (..., frames, 15).
    """
    values = np.asarray(values, dtype=np.float64)
    rows = values.shape[-2] if values.ndim > 1 else 0
    if rows == 0 or values.shape[-1] != len(MARKERS) or not (frames or rows == len(PARTS)):
        wanted = "positions (..., frames, 15)" if frames else "coefficients (..., 5, 15)"
        raise MotionError(f"{name} must hold {wanted} in the missing dimension, got {values.shape}")
    return values
