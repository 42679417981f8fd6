r"""A Gaussian over joint angles at five times, learnt from a gait model: known angles predict the unknown ones.

Let a(t) be the 19 joint angles. Walkers drawn from a model, and their mirror images, give mean and covariance of
(a(t - 0.3 s), a(t - 0.15 s), a(t), a(t + 0.15 s), a(t + 0.3 s)). The conditional mean of the unknown angles at t, given
the known ones at the five times, is linear: arms swing against the legs, and as far as the legs do. The five times tell
the phase and the pace of a walk without estimating either, so that it also holds while people start, turn and stand.

Three things keep it from claiming too much. The neck turns to where people look, whatever their legs do: the few people
of a model suggest otherwise, and are wrong about others, so limbs tell nothing of the neck, and it nothing of them.
People differ from the model, and captures define the pelvis' angles in different ways, so each known angle has an error
of its own (`NOISE`) and one that it keeps over time (`OFFSET`). And where the known angles are farther from the model's
walks than walks are (`LIMIT`, in root mean square Mahalanobis distance), as of somebody who sits, their deviation from
the mean is shortened to that distance: of such motion the prior knows little more than the mean posture.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motionenv.body.gaps import PARTS, check_shown
from motionenv.body.skeleton import mirror
from motionenv.models.base import GaitModel
from motionenv.models.registry import gait_model

#: Times of the angles, relative to that of the unknown ones [s].
LAGS = (-0.3, -0.15, 0.0, 0.15, 0.3)
#: Standard deviations [rad] of what a known angle differs by from the model's walkers: at each time, and throughout.
NOISE, OFFSET = np.radians(7.0), np.radians(4.0)
#: Greatest root mean square Mahalanobis distance of known angles.
LIMIT = 1.5

_ANGLES, _NECK = 19, slice(0, 3)
_FPS, _SECONDS = 30.0, 3.0  # of the walks drawn
_SPEEDS = (0.6, 2.0)  # [m/s]
_WALKERS = 96
_KEPT = 4  # models whose prior is kept
_TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class AnglePrior:
    """A Gaussian over the 19 joint angles at the times `LAGS`."""

    mean: np.ndarray  # (19,) [rad]
    covariance: np.ndarray  # (5, 19, 5, 19) [rad²]

    def predict(self, angles: np.ndarray, fps: float, wanted: np.ndarray) -> np.ndarray:
        """The conditional mean (frames, k) [rad] of the angles `wanted` (k,) given all that no frame lacks.

        Those of `angles` (frames, 19) [rad] that are NaN in any frame are not used, and neither are the `wanted`.
        """
        known = np.setdiff1d(np.flatnonzero(np.isfinite(angles).all(axis=0)), wanted)
        mean = self.mean[wanted]
        if not known.size:
            return np.tile(mean, (len(angles), 1))
        seen = angles[:, known] - self.mean[known]
        seen = seen - _TURN * np.round(np.median(seen, axis=0) / _TURN)
        n = len(LAGS) * len(known)
        covariance = self.covariance[:, known][..., known].reshape(n, n)
        error = NOISE**2 * np.eye(n) + OFFSET**2 * np.kron(np.ones((len(LAGS), len(LAGS))), np.eye(len(known)))
        precision = np.linalg.inv(covariance + error)
        deviation = _at_lags(seen, fps).reshape(len(angles), n)
        distance = np.sqrt(np.einsum("ti,ij,tj->t", deviation, precision, deviation) / n)
        deviation *= np.minimum(1.0, LIMIT / np.maximum(distance, LIMIT / 2))[:, None]
        cross = self.covariance[:, known][:, :, len(LAGS) // 2, wanted].reshape(n, -1)
        return mean + deviation @ (precision @ cross)


def prior_of(model: str | GaitModel) -> AnglePrior:
    """The prior learnt from walkers of a gait model, which must make steady walks; that of the same model is kept.

    Raises:
        GapError: the model itself lacks parts of the body.
        MotionError: a model that makes no motion.
    """
    return _by_name(str(model)) if not isinstance(model, GaitModel) else _learnt(model)


@lru_cache(maxsize=_KEPT)
def _by_name(name: str) -> AnglePrior:
    return _learnt(gait_model(name))


def _learnt(model: GaitModel) -> AnglePrior:
    """Mean and covariance of walkers whose speeds are spread evenly over those of people."""
    rng = np.random.default_rng(0)
    slow, fast = np.clip(_SPEEDS, *model.learned_speeds())
    speeds = np.linspace(slow, fast, _WALKERS)
    walks = [model.synthesize(_SECONDS, _FPS, seed=rng, speed=float(speed)).poses for speed in speeds]
    poses = np.concatenate([walks, mirror(walks)])
    check_shown(poses, PARTS, f"filling by the {model.kind} model")
    angles = poses[..., 6:]
    inside = int(np.ceil(LAGS[-1] * _FPS))
    samples = np.stack([_at_lags(walk, _FPS)[inside:-inside] for walk in angles]).reshape(-1, len(LAGS), _ANGLES)
    mean = samples.mean(axis=(0, 1))
    flat = (samples - mean).reshape(len(samples), -1)
    covariance = (flat.T @ flat / len(flat)).reshape(2 * (len(LAGS), _ANGLES))
    covariance[:, _NECK, :, _NECK.stop :] = 0.0
    covariance[:, _NECK.stop :, :, _NECK] = 0.0
    return AnglePrior(mean, covariance)


def _at_lags(values: np.ndarray, fps: float) -> np.ndarray:
    """`values` (frames, k) at the times `LAGS` around each frame, (frames, 5, k); before and after, the ends."""
    frames = np.arange(len(values))
    at = np.clip(frames[:, None] + np.multiply(LAGS, fps), 0, len(values) - 1)
    low = np.minimum(at.astype(np.intp), max(len(values) - 2, 0))
    share = (at - low)[..., None]
    return (1 - share) * values[low] + share * values[np.minimum(low + 1, len(values) - 1)]
