"""Very many walkers of paper B at once, each in place as on a treadmill, without bodies: markers by the million."""

from dataclasses import dataclass

import numpy as np

from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.harmonics import LEFT_ANKLE, PELVIS, RIGHT_ANKLE, grounded, positions_at
from motionenv.types import MARKERS

_PHASES = np.arange(48) * (2 * np.pi / 48)
_HEIGHT = 0.245 + 0.246 + 0.300  # hip to ankle, and hips to shoulders, as shares of the standing height (Winter 2009)
# What the foot gains by rolling over its ball: stride lengths of `overground.gait` over those of the ankle, 1 % spread.
_ROLL = 1.086
_LEG = [[MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")]
_SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]


@dataclass(frozen=True, eq=False)
class Treadmill:
    """Walkers as Fourier series, standing on z = 0, the pelvis on average at x = y = 0.

    Attributes:
        coefficients: (n, 5, 15, 3) [m].
        frequencies: (n,) strides per second [Hz].
        heights: (n,) body height [m], by the lengths of legs and trunk.
        strides: (n,) how far a stride goes [m], by how fast the standing foot moves back.
    """

    coefficients: np.ndarray
    frequencies: np.ndarray
    heights: np.ndarray
    strides: np.ndarray

    def positions(self, which, phases, sizes) -> np.ndarray:
        """Marker positions (k, 15, 3) [m].

        Args:
            which: (k,) index of each walker.
            phases: (k,) ωt [rad], each walker's own.
            sizes: (k,) factor on all lengths, 1 for the walker as drawn.
        """
        from motionenv.models._treadmill_kernel import place

        out = np.empty((len(which), len(MARKERS), 3))
        place(self.coefficients, which, phases, sizes, out)
        return out


def draw_walkers(model: Eigenwalkers, n: int, seed=None) -> Treadmill:
    """`n` walkers with scores from N(0, diag λ) and frequencies that suit them.

    Other than `Eigenwalkers.sample` it builds no bodies, so none is turned down because its joints bend too far.

    Args:
        model: fitted.
        n: how many.
        seed: int or Generator.

    Raises:
        ModelError: not fitted.
    """
    rng = np.random.default_rng(seed)
    scores = rng.standard_normal((n, len(model.components_))) * np.sqrt(model.explained_variance_)
    frequencies = model.frequency(scores) * np.exp(model.log_frequency_deviation_ * rng.standard_normal(n))
    w = grounded(model.inverse_transform(scores))
    return Treadmill(w, frequencies, body_heights(w), _stride_lengths(w))


def body_heights(w: np.ndarray) -> np.ndarray:
    """Body heights (n,) [m] of coefficients (n, 5, 15, 3), from lengths averaged over the cycle."""
    cycle = positions_at(w, _PHASES[::4])
    length = lambda a, b: np.linalg.norm(a - b, axis=-1).mean(axis=1)
    legs = sum(
        length(cycle[..., a, :], cycle[..., b, :]) for hip, knee, ankle in _LEG for a, b in ((hip, knee), (knee, ankle))
    )
    trunk = length(cycle[..., _SHOULDERS, :].mean(axis=-2), cycle[..., PELVIS, :])
    return (0.5 * legs + trunk) / _HEIGHT


def _stride_lengths(w: np.ndarray) -> np.ndarray:
    """How far (n,) [m] the foot whose ankle goes back fastest goes back in a cycle."""
    ankles = positions_at(w[..., [LEFT_ANKLE, RIGHT_ANKLE], :1], _PHASES, derivative=1)[..., 0]
    return _ROLL * 2 * np.pi * -ankles.min(axis=-1).mean(axis=-1)
