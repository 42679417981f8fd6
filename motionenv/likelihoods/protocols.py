"""Protocols of likelihoods p(J_t | φ_t) of an observation J given a pose φ, as trackers use them."""

import inspect
from collections.abc import Collection
from typing import Any, Protocol, runtime_checkable

import numpy as np

from motionenv.types import Camera, Skeleton

_FAR = 1e6  # [m] distance at which a body isn't visible in any image


class Likelihood(Protocol):
    """p(J_t | φ_t), up to a factor that doesn't depend on the pose."""

    def observe(self, *_: Any, **observation: Any) -> None:
        """Set the current observation."""

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25).

        A body far outside of the image must get the likelihood of an image without a body.
        """


class CameraLikelihood(Likelihood, Protocol):
    """A likelihood with a camera and a foreground, as automatic initialisation needs."""

    @property
    def camera(self) -> Camera:
        """Camera of the current image."""

    @property
    def skeleton(self) -> Skeleton:
        """The body of the hypotheses."""

    @property
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel shows the body."""


@runtime_checkable
class AdaptiveLikelihood(Protocol):
    """A likelihood that adapts to the posterior of the current image."""

    def learn(self, poses: np.ndarray, log_weights: np.ndarray | None = None) -> None:
        """Update from the current image, given its posterior: `poses` (N, 25) and their `log_weights` (N,)."""


def log_nobody(likelihood: Likelihood, pose: np.ndarray) -> float:
    """Log-likelihood of the current image without a body, or minus infinity if it isn't defined.

    Args:
        likelihood: with an observation.
        pose: any (25,); it is moved out of the image.
    """
    away = np.array(pose, dtype=np.float64)[None]
    away[:, :3] += _FAR
    score = float(likelihood.log_likelihood(away)[0])
    return score if np.isfinite(score) else -np.inf


def apparent(poses: np.ndarray, sizes: np.ndarray, camera: Camera) -> np.ndarray:
    """Poses (N, 25) in which bodies of the likelihood's size look like bodies of other `sizes` in `poses`.

    Scaling a body and its distance from the camera alike changes no picture, except of depths.

    Args:
        poses: (N, 25) [m, rad].
        sizes: (N,) relative to the skeleton.
        camera: of the picture.
    """
    seen = poses.copy()
    seen[:, :3] = camera.centre + (poses[:, :3] - camera.centre) / sizes[:, None]
    return seen


def accepted(likelihood: Likelihood, names: Collection[str]) -> list[str]:
    """Names of the observations that a likelihood accepts: the arguments of its `observe`.

    Its attribute `takes`, if present, overrides them. Of the alternatives in its attribute `one_of`, only the first
    that is present is returned, the most informative one.

    Args:
        likelihood: the model.
        names: available observations.
    """
    parameters = inspect.signature(likelihood.observe).parameters
    anything = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values())
    takes = getattr(likelihood, "takes", names if anything else parameters)
    taken = [name for name in names if name in takes]
    spare = [name for name in getattr(likelihood, "one_of", ()) if name in taken][1:]
    return [name for name in taken if name not in spare]
