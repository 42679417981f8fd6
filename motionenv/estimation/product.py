"""Several likelihoods of the same picture as one: silhouettes and edges, colours and silhouettes."""

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.edges import EdgeModel, outline_sums
from motionenv.estimation.observation import ObservationModel


class Product:
    """Product of likelihoods, each to a power, and with one part that holds whatever the pose.

    With the models' log-likelihoods l_m and weights w_m, the product is exp(Σ w_m l_m), mixed with the share `outliers`
    of what the likeliest pose so scored has: a frame in which everything misleads then can't rule any pose out. Cues of
    one picture aren't independent; weights below 1 say so.

    An `ObservationModel` of masks or colours and an `EdgeModel` of the same skeleton and camera, next to each other in
    `models`, are scored in one pass over each body.

    Args:
        models: likelihoods; `observe` gives each of them what it takes.
        weights: (models,), from 0; None is 1 for each.
        outliers: 0 to 1, usually tiny.

    Raises:
        MotionError: no models, or numbers out of range.
    """

    def __init__(self, models: Sequence[Any], weights=None, *, outliers: float = 0.0):
        self.models = tuple(models)
        if not self.models:
            raise MotionError("a Product needs one likelihood at least, got none")
        self.weights = np.ones(len(self.models)) if weights is None else np.array(weights, dtype=np.float64)
        if self.weights.shape != (len(self.models),) or not ((self.weights >= 0) & np.isfinite(self.weights)).all():
            raise MotionError(f"weights must be {len(self.models)} finite numbers from 0, got {weights!r}")
        if not 0 <= outliers < 1:
            raise MotionError(f"outliers must be a share from 0 to below 1, got {outliers!r}")
        self.outliers = outliers
        self._takes = [_parameters(model.observe) for model in self.models]

    def forget(self) -> None:
        """Drop the observation in each model that has one to drop."""
        for model in self.models:
            if hasattr(model, "forget"):
                model.forget()

    def observe(self, **observation: Any) -> None:
        """Take in the current observation.

        Args:
            observation: by name; each model gets what its own `observe` takes.

        Raises:
            MotionError: something that no model takes, or that one of them refuses.
        """
        known = set().union(*self._takes)
        strange = sorted(set(observation) - known)
        if strange:
            raise MotionError(f"no model of the product takes {' or '.join(strange)}: they take {sorted(known)}")
        for model, takes in zip(self.models, self._takes, strict=True):
            model.observe(**{name: value for name, value in observation.items() if name in takes})

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25) [m, rad].

        Raises:
            MotionError: as the models raise it.
        """
        total, i = np.zeros(len(poses)), 0
        while i < len(self.models):
            pair = self.models[i : i + 2]
            if _together(pair):
                first, second = _one_pass(pair[0], pair[1], poses)
                total += self.weights[i] * first + self.weights[i + 1] * second
                i += 2
            else:
                total += self.weights[i] * pair[0].log_likelihood(poses)
                i += 1
        if self.outliers and len(total) and np.isfinite(total.max()):
            return np.logaddexp(np.log1p(-self.outliers) + total, np.log(self.outliers) + total.max())
        return total


def _parameters(observe) -> frozenset[str]:
    """Names that an `observe` takes."""
    return frozenset(inspect.signature(observe).parameters)


def _together(pair: Sequence[Any]) -> bool:
    """Whether these are silhouettes and edges of the same bodies in the same view."""
    if len(pair) < 2 or not isinstance(pair[0], ObservationModel) or not isinstance(pair[1], EdgeModel):
        return False
    a, b = pair[0].skeleton, pair[1].skeleton
    same = a.height == b.height and np.array_equal(a.offsets, b.offsets) and np.array_equal(a.radii, b.radii)
    seen = pair[0]._depth is None and pair[0]._foreground is not None and pair[1].odds is not None
    return same and seen and all(np.array_equal(x, y) for x, y in zip(pair[0]._view, pair[1].view, strict=True))


def _one_pass(silhouettes: ObservationModel, edges: EdgeModel, poses) -> tuple[np.ndarray, np.ndarray]:
    """Log-likelihoods (N,) and (N,) of both."""
    running, none = silhouettes.running_odds()
    assert edges.odds is not None
    inside, along = outline_sums(edges, running, edges.odds, poses, silhouettes._workers)
    return (inside + none) * silhouettes.temper, along * edges.temper
