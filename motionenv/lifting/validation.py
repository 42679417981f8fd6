"""Input checks of lifting: amount of data, and unit."""

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.body.limbs import from_height
from motionenv.errors import GapError, MotionError
from motionenv.types import MARKERS, Points

_MARKERS, _FRAMES = 4, 8  # least number of markers, each in at least so many frames
LEAST_SECONDS, LEAST_RATE = 0.5, 8.0  # [s], [Hz] of any motion
_SMALLEST = 8  # [pixels]
_UPRIGHT = 0.3  # [m] vertical extent of the markers on a standing body that is needed to estimate the unit
#: Apparent size relative to a body of 1.75 m: from a child seen steeply from above to a tall adult.
_SIZES = (0.3, 1.6)
_LYING = 0.5  # correlation with a standing body's heights below which somebody isn't upright
_UNITS = {"metres": 1.0, "centimetres": 100.0, "millimetres": 1000.0}


def check_points(points: Points) -> None:
    """Reject image `points` that can't be lifted, before any expensive work.

    The unit is checked by regressing the markers' mean heights on those of a standing body. A GapError means too little
    data, a MotionError a wrong rate, unit or axis.
    """
    who = points.name or "this sequence"
    if points.fps < LEAST_RATE:
        raise MotionError(f"{who} has {points.fps:g} frames per second; at least {LEAST_RATE:g} are needed")
    seen = np.isfinite(points.positions).all(axis=-1)
    enough = seen.sum(axis=0) >= _FRAMES
    if enough.sum() < _MARKERS:
        names = ", ".join(name for name, some in zip(MARKERS, enough, strict=True) if some) or "none"
        raise GapError(
            f"{who} shows {enough.sum()} of the 15 markers in {_FRAMES} frames or more ({names}); {_MARKERS} are "
            "needed: lower the confidence threshold, or use another sequence"
        )
    if (seconds := float(np.ptp(np.flatnonzero(seen.any(axis=1))) + 1) / points.fps) < LEAST_SECONDS:
        raise GapError(
            f"{who} shows {seconds:.2f} s; at least {LEAST_SECONDS:g} s are needed: use a longer sequence, or correct "
            f"fps={points.fps:g}"
        )
    _check_unit(points, enough, who)
    rows = points.positions[seen.any(axis=1), :, 1]
    tall = float(np.median(np.nanmax(rows, axis=1) - np.nanmin(rows, axis=1)))
    if points.unit == "px" and tall < _SMALLEST:
        raise MotionError(f"{who} is {tall:.2g} pixels tall; at least {_SMALLEST} are needed: use a larger picture")


def _check_unit(points: Points, enough: np.ndarray, who: str) -> None:
    """Compare the markers' mean heights with those of a standing body."""
    scale = _apparent_scale(points, enough)
    if scale is None:
        return
    like = [unit for unit, n in _UNITS.items() if _SIZES[0] * n <= abs(scale) < _SIZES[1] * n]
    if points.unit == "px":
        if scale < 0:
            raise MotionError(
                f"{who} stands on the head, but rows of pixels count downwards: if y counts upwards, read it with "
                'up=True (--up), or without it if that was given; if these are metres, set unit="m" (--unit m)'
            )
        if like == ["metres"]:
            raise MotionError(f'{who} is {1.75 * scale:.2g} pixels tall, which looks like metres: set unit="m"')
    elif scale < 0:
        raise MotionError(f'{who} is upside down, which looks like pixels: set unit="px"')
    elif like != ["metres"]:
        short = {"centimetres": '"cm"', "millimetres": '"mm"'}.get(like[0] if like else "", '"px" or the actual unit')
        looks = f"looks like {like[0]}" if like else "isn't the height of a person"
        raise MotionError(f"{who} is {1.75 * scale:.3g} m tall, which {looks}: set unit={short}")


def _apparent_scale(points: Points, enough: np.ndarray) -> float | None:
    """Image units per metre of the markers' mean heights; None where these aren't like somebody's who is upright."""
    standing = markers(np.zeros(25), from_height(1.75))[enough, 2]
    heights = np.nanmean(points.upward[:, enough, 1], axis=0)
    about, heights = standing - standing.mean(), heights - heights.mean()
    like = abs(heights @ about) >= _LYING * np.linalg.norm(about) * np.linalg.norm(heights)
    return float(heights @ about / (about @ about)) if like and np.ptp(standing) >= _UPRIGHT else None
