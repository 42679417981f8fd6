"""A camera that sees markers as a motion capture program's tracker gives them: in 2D, noisy, with gaps."""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.types import MARKERS

#: How high the camera of a perspective view stands [m].
EYE_HEIGHT = 0.95

_NEAREST = 2.0  # [m], so that no limb comes near the camera


@dataclass(frozen=True)
class MarkerSensor:
    """How markers are seen. Lengths in the picture are metres at the walker's distance, so noise means the same there.

    Attributes:
        noise: standard deviation [m] of each coordinate.
        dropout: share of markers not seen, in each frame by chance.
        gaps: share of the time in which a marker is hidden for longer.
        gap_seconds: mean duration of that [s]; durations are geometric (a Markov chain per marker; Gilbert 1960).
        distance: of the camera [m]; None is paper B's orthographic view.
        fps: frames per second.
    """

    noise: float
    dropout: float
    gaps: float
    gap_seconds: float
    distance: float | None
    fps: float

    def __post_init__(self):
        for name, most in (("noise", 1.0), ("dropout", 1.0), ("gaps", 0.9)):
            value = getattr(self, name)
            if not (_number(value) and 0 <= value <= most):
                raise MotionError(f"{name} must be from 0 to {most:g}{' m' * (name == 'noise')}, got {value!r}")
        if not (_number(self.gap_seconds) and 0 < self.gap_seconds < np.inf):
            raise MotionError(f"gap_seconds must be a number of seconds above 0, got {self.gap_seconds!r}")
        if self.distance is not None and not (_number(self.distance) and _NEAREST <= self.distance < np.inf):
            raise MotionError(
                f"distance must be None for an orthographic view, or at least {_NEAREST:g} m, got {self.distance!r}"
            )
        if self.chances[0] > 1:
            raise MotionError(
                f"gaps = {self.gaps!r} can't be had in gaps of {self.gap_seconds!r} s at {self.fps:g} frames per "
                "second: give a longer gap_seconds or fewer gaps"
            )

    @property
    def chances(self) -> tuple[float, float]:
        """Chances that a marker in sight is hidden in the next frame, and that a hidden one still is."""
        ends = 1.0 / max(self.gap_seconds * self.fps, 1.0)
        return ends * self.gaps / (1.0 - self.gaps), 1.0 - ends

    def view(self, n: int) -> "MarkerView":
        """A view of `n` bodies."""
        return MarkerView(self, n)


class MarkerView:
    """What a `MarkerSensor` sees of n bodies, frame by frame.

    Coordinates: the camera is at α = 0, the side view of who walks along x; x right, y away from the camera, z up.

    Args:
        sensor: how.
        n: number of bodies.

    Attributes:
        joints: (n, 15, 3) [m], where the markers are.
        points: (n, 15, 2) float32 [m], right and up in the picture; 0 where not seen.
        seen: (n, 15) int8, 1 where seen.
    """

    def __init__(self, sensor: MarkerSensor, n: int):
        size = (n, len(MARKERS))
        self.joints = np.zeros((*size, 3))
        self.points = np.zeros((*size, 2), dtype=np.float32)
        self.seen = np.zeros(size, dtype=np.int8)
        self._hidden = np.zeros(size, dtype=bool)
        distance = np.inf if sensor.distance is None else float(sensor.distance)
        shares = float(sensor.noise), float(sensor.dropout), float(sensor.gaps)
        self._setting = (*shares, *sensor.chances, distance, EYE_HEIGHT)

    def look(self, slots, walkers, alphas, keys, time) -> None:
        """Observe the bodies in `slots`; frames of a body go up by one from 0, where it begins anew.

        Args:
            slots: (k,) which.
            walkers: (k, 15, 3) [m] their markers; they walk along x.
            alphas: (n,) paper B's view angle [rad] of all.
            keys: (n,) uint64, from which noise and gaps of a body follow.
            time: (n,) number of the frame of all.
        """
        from motionenv.render._marker_kernel import look

        look(slots, walkers, alphas, keys, time, self._setting, self.joints, self._hidden, self.points, self.seen)


def _number(value) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
