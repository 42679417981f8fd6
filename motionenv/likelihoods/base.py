"""What trackers ask of likelihoods p(J_t | φ_t) of an observation J given a pose φ."""

import inspect
from abc import ABC, abstractmethod
from collections.abc import Collection
from typing import Any

import numpy as np

from motionenv.types import Camera, Skeleton

_FAR = 1e6  # [m] distance at which a body isn't visible in any image


class Likelihood(ABC):
    """p(J_t | φ_t), up to a factor that doesn't depend on the pose.

    Trackers use the following; only the first two must be defined:

    - `observe(**observation)` sets the current observation.
    - `log_likelihood(poses)` scores poses for that observation.
    - `learn(poses, log_weights)` adapts to the posterior of that observation; by default nothing adapts.
    - `forget()` drops all that was observed and learned; by default there is nothing to drop.
    - `accepted(names)` chooses from the available observations; by default those that `observe` has arguments for.

    Attributes:
        skeleton: the body of the hypotheses; None accepts priors of any body.
        camera: of the current image; None if the observations have no camera. Priors of unknown body size need one.
        measures_depth: whether the current observation tells the distance of the body. If not, a small body looks like
            a larger one farther away, on which priors of unknown body size rely.
    """

    skeleton: Skeleton | None = None
    camera: Camera | None = None
    measures_depth: bool = False

    @abstractmethod
    def observe(self, *_: Any, **observation: Any) -> None:
        """Set the current `observation`, by name."""

    @abstractmethod
    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25).

        A body far outside of the image must get the likelihood of an image without a body.
        """

    def learn(self, poses: np.ndarray, log_weights: np.ndarray | None = None) -> None:  # noqa: B027 (optional)
        """Adapt to the posterior of the current observation: `poses` (N, 25) and `log_weights` (N,); None is equal."""

    def forget(self) -> None:  # noqa: B027 (optional)
        """Drop the observation and what was learned, for a new episode."""

    def accepted(self, names: Collection[str]) -> list[str]:
        """Which of the available observations `names` to pass to `observe` together, in the same order."""
        parameters = inspect.signature(self.observe).parameters
        anything = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values())
        return [name for name in names if anything or name in parameters]


class ImageLikelihood(Likelihood):
    """A likelihood of images in which a body can be found, as automatic initialisation needs.

    Attributes:
        skeleton: the body of the hypotheses.
        camera: of the current image.
    """

    skeleton: Skeleton
    camera: Camera

    @property
    @abstractmethod
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel of the current image shows the body."""


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
