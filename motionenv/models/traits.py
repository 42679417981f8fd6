"""Directions in which a walk changes as people would say it: slower or faster, flatter or bouncier, arms in or out.

Walkers are drawn from a model, features of their gait are measured, and each feature is regressed on the walkers'
scores in standard deviations. Where all scores have variance 1, the regression's weights point where the feature
changes most for a given change of the walker: one step of a trait is one standard deviation that way.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.inplace import InPlace, markers_in_place, walk_in_place
from motionenv.models.synthesis import components
from motionenv.models.treadmill import body_heights
from motionenv.models.walking import WalkingModel
from motionenv.types import MARKERS

_DRAWN = 100  # walkers: each model has about ten components
_SEED = 1


@dataclass(frozen=True, eq=False)
class Trait:
    """A direction in the space of a model's walkers.

    Attributes:
        name: of what is measured.
        low, high: what a walker is called that has less, or more, of it.
        direction: (q,) of length 1, standard deviations along each component.
        mean: of the feature over walkers, in `unit`.
        gain: change of the feature for one step along `direction`, in `unit`, where the regression is straight.
        unit: of the feature.
        share: of the feature's variance over walkers that the regression explains.
    """

    name: str
    low: str
    high: str
    direction: np.ndarray
    mean: float
    gain: float
    unit: str
    share: float


def traits(model) -> list[Trait]:
    """The traits of a model of walks, the same on every call.

    Args:
        model: a fitted `WalkingModel` or `Eigenwalkers`.

    Raises:
        MotionError: a model whose walkers have no components.
    """
    z = np.random.default_rng(_SEED).standard_normal((_DRAWN, len(components(model)[0])))
    features = measured(model, z)
    z = np.column_stack([np.ones(_DRAWN), z])
    found = []
    for (name, (low, high, unit, _)), values in zip(FEATURES.items(), features.T, strict=True):
        if values.std() < 1e-9:  # a model of one body says nothing about height
            continue
        weights = np.linalg.lstsq(z, values)[0]
        gain = float(np.linalg.norm(weights[1:]))
        share = 1 - np.var(values - z @ weights) / np.var(values)
        found.append(Trait(name, low, high, weights[1:] / gain, float(values.mean()), gain, unit, float(share)))
    return found


def measured(model, deviations) -> np.ndarray:
    """The `FEATURES` (n, features) of walkers with `deviations` (n, q) from the average, each in its unit.

    Args:
        model: a fitted `WalkingModel` or `Eigenwalkers`.
        deviations: (n, q) standard deviations along each component.

    Raises:
        MotionError: deviations of another shape, or a model whose walkers have no components.
    """
    mean, deviation = components(model)
    deviations = np.asarray(deviations, dtype=np.float64)
    if deviations.ndim != 2 or deviations.shape[1] != len(mean):
        raise MotionError(f"deviations must have shape (n, {len(mean)}), got {deviations.shape}")
    walkers = _walkers(model, mean + deviations * deviation)
    return np.column_stack([feature(walkers) for _, _, _, feature in FEATURES.values()])


@dataclass(frozen=True, eq=False)
class _Walkers:
    """Markers (n, samples, 15, 3) [m] of a cycle on the spot, body heights (n,) [m], and the cycle."""

    markers: np.ndarray
    heights: np.ndarray
    cycle: InPlace

    def of(self, name: str) -> np.ndarray:
        """(n, samples, 3) of one marker, in body heights."""
        return self.markers[:, :, MARKERS.index(name)] / self.heights[:, None, None]

    def both(self, name: str) -> np.ndarray:
        """(n, samples, 2, 3) of the markers on the left and the right, in body heights."""
        return np.stack([self.of(f"left_{name}"), self.of(f"right_{name}")], axis=2)


def _walkers(model: WalkingModel | Eigenwalkers, scores: np.ndarray) -> _Walkers:
    """Walkers with `scores` (n, q)."""
    if isinstance(model, Eigenwalkers):
        cycle = markers_in_place(model, scores)
        return _Walkers(cycle.frames, body_heights(model.inverse_transform(scores)), cycle)
    from motionenv.body.kinematics import markers

    cycle, body = walk_in_place(model, scores), model.skeleton()
    return _Walkers(markers(cycle.frames, body), np.full(len(scores), body.height), cycle)


def _swing(w: _Walkers) -> np.ndarray:
    """How far the arms go to and fro against the legs, from furthest back to furthest ahead; less than 0: with them."""
    return _wave(w.of("right_wrist")[..., 0] - w.of("left_wrist")[..., 0], 1)


def _bounce(w: _Walkers) -> np.ndarray:
    """How far the pelvis is higher over the standing leg than between two steps."""
    return 2 * _wave(-w.of("pelvis")[..., 2], 2)


def _wave(values: np.ndarray, harmonic: int) -> np.ndarray:
    """Amplitude (n,) of the cosine in `values` (n, samples).

    Other than a range it has a sign, so that it goes on falling where a movement has vanished and turns round.
    """
    phase = 2 * np.pi * harmonic * np.arange(values.shape[1]) / values.shape[1]
    return 2 * (values * np.cos(phase)).mean(axis=1)


def _spread(w: _Walkers) -> np.ndarray:
    """How far the wrists are out to the sides of the hips."""
    return (w.of("left_wrist") - w.of("right_wrist"))[..., 1].mean(axis=1)


def _lean(w: _Walkers) -> np.ndarray:
    """How far the head is ahead of the pelvis."""
    return (w.of("head") - w.of("pelvis"))[..., 0].mean(axis=1)


def _steps(w: _Walkers) -> np.ndarray:
    """How far the ankles are apart sideways."""
    return (w.of("left_ankle") - w.of("right_ankle"))[..., 1].mean(axis=1)


#: What is measured: words for little and much of it, its unit, and how.
FEATURES: dict[str, tuple[str, str, str, Callable[[_Walkers], np.ndarray]]] = {
    "pace": ("slow", "fast", "m/s", lambda w: w.cycle.speeds),
    "bounce": ("flat", "bouncy", "body heights", _bounce),
    "arm swing": ("still arms", "swinging arms", "body heights", _swing),
    "arm spread": ("narrow arms", "wide arms", "body heights", _spread),
    "step width": ("narrow steps", "wide steps", "body heights", _steps),
    "lean": ("leaning back", "leaning forward", "body heights", _lean),
    "height": ("small", "tall", "m", lambda w: w.heights),
}
