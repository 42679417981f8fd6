"""What a likelihood is to those who follow a person: p(J_t | φ_t) of a picture J given a pose φ."""

import inspect
from collections.abc import Collection
from typing import Any, Protocol, runtime_checkable

import numpy as np

from motionenv.types import Camera, Skeleton

_FAR = 1e6  # [m] from where a body can't be seen in any picture


class Likelihood(Protocol):
    """p(J_t | φ_t), up to a factor that doesn't hang on the pose."""

    def observe(self, *_: Any, **observation: Any) -> None:
        """Take in the current observation."""

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25).

        That of a body far out of the picture is that of a picture without one.
        """


class Looking(Likelihood, Protocol):
    """A likelihood that knows the camera, and what in the picture is a body: what an automatic start needs."""

    @property
    def camera(self) -> Camera:
        """Of the current picture."""

    @property
    def skeleton(self) -> Skeleton:
        """The body of the hypotheses."""

    @property
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel shows the body."""


@runtime_checkable
class Learning(Protocol):
    """A likelihood that learns of the current picture, once somebody knows where in it the person is."""

    def learn(self, poses: np.ndarray, log_weights: np.ndarray | None = None) -> None:
        """Take in what the current picture shows, given a belief: `poses` (N, 25) and their `log_weights` (N,)."""


def log_nobody(likelihood: Likelihood, pose: np.ndarray) -> float:
    """Log-likelihood of the current picture without a body, or minus infinity where it can't be said.

    Args:
        likelihood: that has observed.
        pose: any (25,), that is moved out of all pictures.
    """
    away = np.array(pose, dtype=np.float64)[None]
    away[:, :3] += _FAR
    score = float(likelihood.log_likelihood(away)[0])
    return score if np.isfinite(score) else -np.inf


def accepted(likelihood: Likelihood, names: Collection[str]) -> list[str]:
    """Which parts of an observation a likelihood takes: those that its `observe` names.

    A likelihood may say so itself, in `takes`. Of those in its `one_of`, if it has that, only the first: they say the
    same, and that one says most.

    Args:
        likelihood: to be shown the observation.
        names: of the parts.
    """
    parameters = inspect.signature(likelihood.observe).parameters
    anything = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values())
    takes = getattr(likelihood, "takes", names if anything else parameters)
    taken = [name for name in names if name in takes]
    spare = [name for name in getattr(likelihood, "one_of", ()) if name in taken][1:]
    return [name for name in taken if name not in spare]
