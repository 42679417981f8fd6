"""Several likelihoods of the same picture as one, such as silhouettes and colours."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.likelihoods.base import ImageLikelihood, Likelihood, log_nobody
from motionenv.types import Camera, Skeleton


class ProductLikelihood(ImageLikelihood):
    """Product of likelihoods, each to a power, and with one part that holds whatever the pose.

    With the models' log-likelihoods l_m and weights w_m, the product is exp(Σ w_m l_m), mixed with the share `outliers`
    of what the same picture has without a body: (1 - outliers) p(J | φ) + outliers p(J | nobody). So a frame in which
    everything misleads can't rule any pose out, whatever others it is scored with; the level is that of the hidden
    frames of `motionenv.tracking.ParticleFilter`. Cues of one picture aren't independent; weights below 1 say so.

    Body, camera and foreground are those of the first model that has them.

    Args:
        models: likelihoods; `observe` gives each of them what it takes.
        weights: (models,), from 0; None is 1 for each.
        outliers: 0 to 1, usually tiny.

    Raises:
        MotionError: no models, or numbers out of range.
    """

    def __init__(
        self, models: Sequence[Likelihood], weights: ArrayLike | None = None, *, outliers: float = 0.0
    ) -> None:
        self.models = tuple(models)
        if not self.models:
            raise MotionError("a ProductLikelihood needs one likelihood at least, got none")
        self.weights = np.ones(len(self.models)) if weights is None else np.array(weights, dtype=np.float64)
        if self.weights.shape != (len(self.models),) or not ((self.weights >= 0) & np.isfinite(self.weights)).all():
            raise MotionError(f"weights must be {len(self.models)} finite numbers from 0, got {weights!r}")
        checked_number(outliers, "outliers", 0, below=1)
        self.outliers = outliers

    def __repr__(self) -> str:
        return f"ProductLikelihood({', '.join(map(repr, self.models))})"

    @property
    def skeleton(self) -> Skeleton | None:  # type: ignore[override]
        """Body of the first model that has one."""
        return next((model.skeleton for model in self.models if model.skeleton is not None), None)

    @property
    def camera(self) -> Camera | None:  # type: ignore[override]
        """Camera of the first model that has one."""
        return next((model.camera for model in self.models if model.camera is not None), None)

    @property
    def foreground(self) -> np.ndarray:
        """Foreground (height, width) of the first model of images; MotionError without one."""
        for model in self.models:
            if isinstance(model, ImageLikelihood):
                return model.foreground
        raise MotionError("none of the product's models has a foreground")

    @property
    def measures_depth(self) -> bool:  # type: ignore[override]
        """Whether any of the models measures depth."""
        return any(model.measures_depth for model in self.models)

    def forget(self) -> None:
        for model in self.models:
            model.forget()

    def accepted(self, names: Collection[str]) -> list[str]:
        """Which of the available observations `names` some of the models take."""
        taken = {name for model in self.models for name in model.accepted(names)}
        return [name for name in names if name in taken]

    def observe(self, **observation: Any) -> None:
        """Set the current observation.

        Args:
            observation: by name; each model gets what it accepts, of several forms of the same picture (mask, depth,
                rgb) the most informative one.

        Raises:
            MotionError: something that no model takes, or that one of them refuses.
        """
        for name in observation:
            if not self.accepted([name]):
                raise MotionError(f"none of the product's models takes {name!r}: they are {self!r}")
        for model in self.models:
            if not (names := model.accepted(observation)):
                raise MotionError(f"{model!r} needs another observation than {' and '.join(observation)}")
            model.observe(**{name: observation[name] for name in names})

    def learn(self, poses: np.ndarray, log_weights: np.ndarray | None = None) -> None:
        """Let each model learn from the current picture.

        Args:
            poses: (N, 25) [m, rad] of a belief about the current picture.
            log_weights: (N,), up to a constant; None is equal weights.

        Raises:
            MotionError: as the models raise it.
        """
        for model in self.models:
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
