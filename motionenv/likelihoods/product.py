"""Several likelihoods of the same picture as one, such as silhouettes and colours."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.likelihoods.protocols import AdaptiveLikelihood, accepted, log_nobody
from motionenv.types import Camera, Skeleton


class ProductLikelihood:
    """Product of likelihoods, each to a power, and with one part that holds whatever the pose.

    With the models' log-likelihoods l_m and weights w_m, the product is exp(Σ w_m l_m), mixed with the share `outliers`
    of what the same picture has without a body: (1 - outliers) p(J | φ) + outliers p(J | nobody). So a frame in which
    everything misleads can't rule any pose out, whatever others it is scored with; the level is that of the hidden
    frames of `motionenv.tracking.ParticleFilter`. Cues of one picture aren't independent; weights below 1 say so.

    Args:
        models: likelihoods; `observe` gives each of them what it takes.
        weights: (models,), from 0; None is 1 for each.
        outliers: 0 to 1, usually tiny.

    Raises:
        MotionError: no models, or numbers out of range.
    """

    def __init__(self, models: Sequence[Any], weights: ArrayLike | None = None, *, outliers: float = 0.0) -> None:
        self.models = tuple(models)
        if not self.models:
            raise MotionError("a ProductLikelihood needs one likelihood at least, got none")
        self.weights = np.ones(len(self.models)) if weights is None else np.array(weights, dtype=np.float64)
        if self.weights.shape != (len(self.models),) or not ((self.weights >= 0) & np.isfinite(self.weights)).all():
            raise MotionError(f"weights must be {len(self.models)} finite numbers from 0, got {weights!r}")
        checked_number(outliers, "outliers", 0, below=1)
        self.outliers = outliers

    @property
    def takes(self) -> frozenset[str]:
        """Names of the observations that one of the models takes."""
        return frozenset().union(*(inspect.signature(model.observe).parameters for model in self.models))

    @property
    def camera(self) -> Camera:
        """Of the current picture, as the first model that knows it says."""
        return self._first("camera")

    @property
    def skeleton(self) -> Skeleton:
        """The body of the hypotheses, as the first model that knows it says."""
        return self._first("skeleton")

    @property
    def foreground(self) -> np.ndarray:
        """Probability (height, width) that a pixel shows the body, as the first model that knows it says."""
        return self._first("foreground")

    def _first(self, name: str) -> Any:
        for model in self.models:
            if hasattr(type(model), name) or name in vars(model):
                return getattr(model, name)
        raise MotionError(f"none of the product's models knows the {name}")

    def forget(self) -> None:
        """Drop the observation in each model that has one to drop."""
        for model in self.models:
            if hasattr(model, "forget"):
                model.forget()

    def observe(self, **observation: Any) -> None:
        """Take in the current observation.

        Args:
            observation: by name; each model gets what its own `observe` takes, and of several forms of the same
                picture (mask, depth, rgb) that which says most to it.

        Raises:
            MotionError: something that no model takes, or that one of them refuses.
        """
        strange = sorted(set(observation) - self.takes)
        if strange:
            raise MotionError(f"no model of the product takes {' or '.join(strange)}: they take {sorted(self.takes)}")
        for model in self.models:
            model.observe(**{name: observation[name] for name in accepted(model, observation)})

    def learn(self, poses: np.ndarray, log_weights: np.ndarray | None = None) -> None:
        """Hand on to the models that learn what the current picture shows.

        Args:
            poses: (N, 25) [m, rad] of a belief about the current picture.
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: as the models raise it.
        """
        for model in self.models:
            if isinstance(model, AdaptiveLikelihood):
                model.learn(poses, log_weights)

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25) [m, rad].

        Raises:
            MotionError: as the models raise it.
        """
        pairs = list(zip(self.weights, self.models, strict=True))
        total = sum((weight * model.log_likelihood(poses) for weight, model in pairs), np.zeros(len(poses)))
        if self.outliers and len(total):
            # The pictures without a body are as likely for any pose.
            nobody = sum(weight * log_nobody(model, poses[0]) for weight, model in pairs if weight)
            total = np.logaddexp(np.log1p(-self.outliers) + total, np.log(self.outliers) + nobody)
        return total
