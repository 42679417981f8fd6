r"""Errors of a reconstructed walk in the missing dimension of its view: paper B, eqs. 4.1 to 4.4.

With p(t) a joint's position in the missing dimension and p̃(t) its reconstruction, over a cycle of T frames:

    E_abs(j) = 1/T Σ_t (p(t) - p̃(t))²          (4.1)      E_a = 1/15 Σ_j E_abs(j)     (4.2)
    E_rel(j) = E_abs(j) / σ²                   (4.3)      E_r = 1/15 Σ_j E_rel(j)     (4.4)

They are squared (m²; × 10⁶ gives the paper's mm²): the square root of E_a is an rms error. A walk is given by the five
Fourier coefficients of each joint (`motionenv.models.eigenwalkers.fourier_series`), whose mean over a cycle has a
closed form by Parseval's theorem, the limit of many frames; or, with `frames=True`, by its frames.

Joints with unknown truth (NaN) are excluded from means; if the truth is known, an estimate with NaN gives NaN.

The paper calls σ² "the average overall variance of the 15 joints in the missing dimension". As it uses "overall
postural variance" for what the harmonics explain, we interpret σ² as the variance of each joint over time, averaged
over the joints of that walker. `posture=True` selects the other interpretation, the spread of all joints and times
about their common mean, which includes the distances between joints, such as those of arms and legs in depth. Figure 5
supports the first: there, variance is least in profile and relative errors are greatest, as for our walkers in the
first interpretation; in the second it is the other way round (benchmarks/RESULTS.md).
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.metrics.points import mpjpe
from motionenv.models.eigenwalkers.fourier_series import PARTS, positions_at
from motionenv.types import MARKERS


def joint_error(estimate, truth, *, frames: bool = False) -> np.ndarray:
    """E_abs(j) (..., 15) [m²] of each joint in the missing dimension (eq. 4.1).

    Args:
        estimate: (..., 5, 15) [m], coefficients of the reconstruction; or (..., frames, 15) positions.
        truth: in the same form, NaN where unknown; leading axes broadcast.
        frames: True if both are positions over time.

    Raises:
        MotionError: wrong or incompatible shapes.
    """
    return _mean_square(_difference(estimate, truth, frames), frames)


def walker_error(estimate, truth, *, frames: bool = False) -> np.ndarray:
    """E_a (...) [m²] of each walk: the mean of `joint_error` over the joints with known truth (eq. 4.2).

    Takes `estimate`, `truth` and `frames` as `joint_error` does, and raises its errors.
    """
    return _over_joints(joint_error(estimate, truth, frames=frames), truth)


def missing_variance(truth, *, posture: bool = False, frames: bool = False) -> np.ndarray:
    """σ² (...) [m²] of eq. 4.3 and fig. 5c: the variance of the joints in the missing dimension.

    Args:
        truth: (..., 5, 15) [m] coefficients, or (..., frames, 15) positions; NaN where unknown.
        posture: False for each joint's variance over time, averaged over the joints; True for the variance over joints
            and times together, which includes the mean posture.
        frames: True if `truth` is positions over time.

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
    """E_rel(j) (..., 15) of each joint: `joint_error` divided by the walk's `missing_variance` (eq. 4.3).

    Takes `estimate`, `truth` and `frames` as the first does and `posture` as the second; raises the errors of both.
    """
    variance = missing_variance(truth, posture=posture, frames=frames)
    return joint_error(estimate, truth, frames=frames) / variance[..., None]


def relative_walker_error(estimate, truth, *, posture: bool = False, frames: bool = False) -> np.ndarray:
    """E_r (...) of each walk: the mean of `relative_joint_error` over the joints with known truth (eq. 4.4).

    Takes `estimate`, `truth`, `posture` and `frames` as that does, and raises its errors.
    """
    return _over_joints(relative_joint_error(estimate, truth, posture=posture, frames=frames), truth)


def cycle_mpjpe(estimate, truth, *, samples: int = 32) -> np.ndarray:
    """`mpjpe` (...) [m] over a cycle: mean distance of the joints in three dimensions.

    A distance has no closed form in the coefficients, so it is averaged over equally spaced phases.

    Args:
        estimate: (..., 5, 15, 3) [m], coefficients of the reconstruction.
        truth: (..., 5, 15, 3) [m], NaN where unknown.
        samples: number of phases.

    Raises:
        MotionError: another shape, or no sample.
    """
    for name, w in (("estimate", estimate), ("truth", truth)):
        if np.shape(w)[-3:] != (len(PARTS), len(MARKERS), 3):
            raise MotionError(f"{name} must hold coefficients (..., 5, 15, 3), got {np.shape(w)}")
    if not isinstance(samples, int) or samples < 1:
        raise MotionError(f"samples must be a whole number of 1 or more phases, got {samples!r}")
    phases = np.arange(samples) * (2 * np.pi / samples)
    return mpjpe(positions_at(estimate, phases), positions_at(truth, phases)).mean(axis=-1)


def _mean_square(values: np.ndarray, frames: bool) -> np.ndarray:
    """Mean of the squares (..., 15) over time, of coefficients (..., 5, 15) by Parseval or of (..., frames, 15)."""
    if frames:
        return (values**2).mean(axis=-2)
    return values[..., 0, :] ** 2 + 0.5 * (values[..., 1:, :] ** 2).sum(axis=-2)


def _over_joints(values: np.ndarray, truth) -> np.ndarray:
    """Mean (...) of `values` (..., 15) over the joints with known `truth`; NaN if there is none."""
    known = np.isfinite(np.asarray(truth, dtype=np.float64)).all(axis=-2)
    known, values = np.broadcast_arrays(known, values)
    with np.errstate(invalid="ignore"):
        return np.where(known, values, 0.0).sum(axis=-1) / known.sum(axis=-1)


def _difference(estimate, truth, frames: bool) -> np.ndarray:
    estimate, truth = _walks(estimate, frames, "estimate"), _walks(truth, frames, "truth")
    if estimate.shape[-2] != truth.shape[-2]:
        raise MotionError(f"estimate and truth must have equal frames, got {estimate.shape[-2]} and {truth.shape[-2]}")
    try:
        return estimate - truth
    except ValueError:
        raise MotionError(f"estimate and truth must broadcast, got {estimate.shape} and {truth.shape}") from None


def _walks(values, frames: bool, name: str) -> np.ndarray:
    """`values` as float64."""
    values = np.asarray(values, dtype=np.float64)
    rows = values.shape[-2] if values.ndim > 1 else 0
    if rows == 0 or values.shape[-1] != len(MARKERS) or not (frames or rows == len(PARTS)):
        wanted = "positions (..., frames, 15)" if frames else "coefficients (..., 5, 15)"
        raise MotionError(f"{name} must hold {wanted} in the missing dimension, got {values.shape}")
    return values
