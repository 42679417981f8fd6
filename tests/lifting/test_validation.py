"""What lifting refuses, on real walks and on what is none."""

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.lifting.validation import check_points
from motionenv.types import MARKERS, Points


def noisy(points: Points, noise=0.02) -> Points:
    rng = np.random.default_rng(len(points.positions))
    return Points(points.positions + noise * rng.standard_normal(points.positions.shape), points.fps, points.unit)


def scaled(points: Points, by, unit="m") -> Points:
    return Points(points.positions * by, points.fps, unit, name="walk")


def test_real_walks_pass_at_every_view_with_and_without_noise(views):
    for points in views:
        for version in (points, noisy(points)):
            check_points(version)


@pytest.mark.parametrize(
    ("by", "unit", "says"),
    [
        (1000, "m", 'looks like millimetres: set unit="mm"'),
        (100, "m", 'looks like centimetres: set unit="cm"'),
        ([300, -300], "m", 'looks like pixels.*unit="px"'),
        (7, "m", "isn't the height of a person"),
        (0.01, "m", "isn't the height of a person"),
        (300, "px", r"stands on the head.*\(--up\)"),
        ([1, -1], "px", 'looks like metres: set unit="m"'),
    ],
)
def test_other_units_are_told_and_never_guessed(views, by, unit, says):
    for points in views[:5]:
        with pytest.raises(MotionError, match=says):
            check_points(scaled(points, by, unit))
        part = scaled(points, by, unit).positions.copy()
        part[:, [MARKERS.index(n) for n in ("head", "left_ankle", "sternum", "right_knee")]] = np.nan
        with pytest.raises(MotionError, match=says):
            check_points(Points(part, 30, unit))


def test_children_giants_and_pixels_pass(views):
    for points in views[:5]:
        for by, unit in ((0.6, "m"), (1.2, "m"), ([50, -50], "px"), ([700, -700], "px")):
            check_points(scaled(points, by, unit))


def test_too_little_is_refused(views):
    points = views[0]
    for kept in (0, 3):
        positions = points.positions.copy()
        positions[:, kept:] = np.nan
        with pytest.raises(GapError, match=f"{kept} of the 15 markers"):
            check_points(Points(positions, 30, "m"))
    with pytest.raises(GapError, match=r"0\.33 s; at least 0\.5 s"):
        check_points(Points(points.positions[:10], 30, "m"))
    with pytest.raises(MotionError, match="5 frames per second; at least 8"):
        check_points(Points(points.positions, 5, "m"))
