"""A camera with a 2D marker tracker: noisy points with gaps."""

from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.types import MARKERS

#: Height of the camera of a perspective view [m].
EYE_HEIGHT = 0.95

_NEAREST = 2.0  # [m] least distance, so that limbs stay away from the camera


@dataclass(frozen=True)
class MarkerSensor:
    """Settings of a marker sensor. Image lengths are metres at the walker's distance, and so is the noise.

    Attributes:
        noise: standard deviation [m] of each coordinate.
        dropout: fraction of markers missing independently in each frame.
        gaps: fraction of the time that a marker is in a longer gap.
        gap_seconds: mean gap duration [s]; durations are geometric (a Markov chain per marker; Gilbert 1960).
        distance: of the camera [m]; None is paper B's orthographic view.
        fps: frame rate [Hz].
    """

    noise: float
    dropout: float
    gaps: float
    gap_seconds: float
    distance: float | None
    fps: float

    def __post_init__(self) -> None:
        checked_number(self.noise, "noise", 0, 1, "metres")
        checked_number(self.dropout, "dropout", 0, 1)
        gap_chances(self.gaps, self.gap_seconds, self.fps)
        if self.distance is not None:  # an orthographic view
            checked_number(self.distance, "distance", _NEAREST, unit="metres")

    def view(self, n: int) -> "MarkerView":
        """A view of `n` bodies."""
        return MarkerView(self, n)


def gap_chances(gaps: float, gap_seconds: float, fps: float) -> tuple[float, float]:
    """Probabilities that what is visible is hidden in the next frame, and that what is hidden remains hidden.

    Args:
        gaps: fraction of the time that it is hidden, 0 to 0.9.
        gap_seconds: mean duration of a gap [s]; durations are geometric (Gilbert 1960).
        fps: frame rate [Hz].

    Raises:
        MotionError: an argument out of range, or gaps that are too short for their share.
    """
    checked_number(gaps, "gaps", 0, 0.9)
    ends = 1.0 / max(checked_number(gap_seconds, "gap_seconds", above=0, unit="seconds") * fps, 1.0)
    begins = ends * gaps / (1.0 - gaps)
    if begins > 1:
        raise MotionError(
            f"gaps={gaps!r} is impossible with gap_seconds={gap_seconds!r} at {fps:g} frames per second: increase "
            "gap_seconds or reduce gaps"
        )
    return begins, 1.0 - ends


class MarkerView:
    """Observations of n bodies by a `MarkerSensor`, frame by frame.

    Coordinates: the camera is at α = 0, the side view of a walker along x; x right, y away from the camera, z up.

    Attributes:
        joints: (n, 15, 3) [m], true marker positions.
        points: (n, 15, 2) float32 [m], right and up in the image; 0 if missing.
        seen: (n, 15) int8, 1 if visible.
    """

    def __init__(self, sensor: MarkerSensor, n: int) -> None:
        size = (n, len(MARKERS))
        self.joints = np.zeros((*size, 3))
        self.points = np.zeros((*size, 2), dtype=np.float32)
        self.seen = np.zeros(size, dtype=np.int8)
        self._hidden = np.zeros(size, dtype=bool)
        distance = np.inf if sensor.distance is None else float(sensor.distance)
        shares = float(sensor.noise), float(sensor.dropout), float(sensor.gaps)
        chances = gap_chances(sensor.gaps, sensor.gap_seconds, sensor.fps)
        self._setting = (*shares, *chances, distance, EYE_HEIGHT)

    def look(
        self, slots: np.ndarray, walkers: np.ndarray, alphas: np.ndarray, keys: np.ndarray, time: np.ndarray
    ) -> None:
        """Observe the bodies in `slots` (k,). The frame number of a body counts up from 0, which starts a new sequence.

        `walkers` (k, 15, 3) [m] are their markers, walking along x; of all bodies are `alphas` (n,), paper B's view
        angle [rad], `keys` (n,) uint64, random keys of noise and gaps, and `time` (n,), frame numbers.
        """
        from motionenv.render.sensors._sensor_kernel import look

        look(slots, walkers, alphas, keys, time, self._setting, self.joints, self._hidden, self.points, self.seen)
