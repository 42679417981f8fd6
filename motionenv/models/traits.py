"""Directions in which a walk changes in ways that people name: flatter or bouncier, leaning back or forward.

Each feature of gait, measured on walkers drawn from the model at one pace, is regressed on their scores in standard
deviations. As these have variance 1, the regression's weights point in the direction of steepest change of the feature.
One step of a trait is one standard deviation in that direction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv.errors import MotionError
from motionenv.models.types import Components, Trait, Treadmill
from motionenv.types import MARKERS

_DRAWN = 100  # walkers; enough, as each model has about ten components
_SEED = 1


def traits(components: Components, treadmill: Treadmill) -> list[Trait]:
    """The traits of a model with these `components` and this `treadmill`; deterministic.

    Those of limbs that the model doesn't know are left out.
    """
    z = np.random.default_rng(_SEED).standard_normal((_DRAWN, len(components)))
    features = measured(components, treadmill, z)
    z = np.column_stack([np.ones(_DRAWN), z])
    found = []
    for (name, (low, high, unit, _)), values in zip(FEATURES.items(), features.T, strict=True):
        if not values.std() >= 1e-9:  # height doesn't vary in a model of one body; NaN of limbs that it lacks
            continue
        weights = np.linalg.lstsq(z, values)[0]
        gain = float(np.linalg.norm(weights[1:]))
        share = 1 - np.var(values - z @ weights) / np.var(values)
        found.append(Trait(name, low, high, weights[1:] / gain, float(values.mean()), gain, unit, float(share)))
    return found


def measured(components: Components, treadmill: Treadmill, deviations: ArrayLike) -> np.ndarray:
    """The `FEATURES` (n, features) of walkers, each in its unit.

    Args:
        components, treadmill: of their model.
        deviations: (n, q) from the average, in standard deviations along each component.

    Raises:
        MotionError: deviations of another shape.
    """
    deviations = np.asarray(deviations, dtype=np.float64)
    if deviations.ndim != 2 or deviations.shape[1] != len(components):
        raise MotionError(f"deviations must have shape (n, {len(components)}), got {deviations.shape}")
    walkers = _Walkers(*treadmill.crowd(components.means + deviations * components.deviations))
    return np.column_stack([feature(walkers) for _, _, _, feature in FEATURES.values()])


@dataclass(frozen=True, eq=False)
class _Walkers:
    """Markers (n, samples, 15, 3) [m] of a cycle in place, and body heights (n,) [m]."""

    markers: np.ndarray
    heights: np.ndarray

    def of(self, name: str) -> np.ndarray:
        """(n, samples, 3) of one marker, in body heights."""
        return self.markers[:, :, MARKERS.index(name)] / self.heights[:, None, None]


def _swing(w: _Walkers) -> np.ndarray:
    """Amplitude of the arms' swing against the legs; negative if they swing with the legs."""
    return _wave(w.of("right_wrist")[..., 0] - w.of("left_wrist")[..., 0], 1)


def _wave(values: np.ndarray, harmonic: int, delay: float = 0.0) -> np.ndarray:
    """Signed amplitude (n,) of the cosine in `values` (n, samples), which peaks `delay` [cycles] after phase 0.

    Unlike a range, it is signed: it keeps falling when a movement vanishes and then reverses.
    """
    phase = 2 * np.pi * harmonic * (np.arange(values.shape[1]) / values.shape[1] - delay)
    return 2 * (values * np.cos(phase)).mean(axis=1)


def _apart(w: _Walkers, joint: str) -> np.ndarray:
    """Mean lateral distance between the left and the right one of a joint."""
    return (w.of(f"left_{joint}") - w.of(f"right_{joint}"))[..., 1].mean(axis=1)


def _lean(w: _Walkers) -> np.ndarray:
    """Mean distance of the head ahead of the pelvis."""
    return (w.of("head") - w.of("pelvis"))[..., 0].mean(axis=1)


#: Features by name: words for little and much of it, unit, and the function that measures it.
FEATURES: dict[str, tuple[str, str, str, Callable[[_Walkers], np.ndarray]]] = {
    # The pelvis over the stance leg, above its height between two steps; the trunk's way from foot to foot, a quarter
    # of a cycle after steps are longest.
    "bounce": ("flat", "bouncy", "body heights", lambda w: 2 * _wave(-w.of("pelvis")[..., 2], 2)),
    "sway": ("steady", "swaying", "body heights", lambda w: _wave(w.of("sternum")[..., 1], 1, delay=0.25)),
    "arm swing": ("still arms", "swinging arms", "body heights", _swing),
    "arm spread": ("narrow arms", "wide arms", "body heights", lambda w: _apart(w, "wrist")),
    "step width": ("narrow steps", "wide steps", "body heights", lambda w: _apart(w, "ankle")),
    "lean": ("leaning back", "leaning forward", "body heights", _lean),
    "height": ("small", "tall", "m", lambda w: w.heights),
}
