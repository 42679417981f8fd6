"""What lifting refuses, on real walks and on what is none."""

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.lifting.fourier_fit import fourier_points
from motionenv.lifting.validation import alternation, check_points, check_series, check_strides
from motionenv.lifting.view_geometry import project_markers
from motionenv.mocap import read, to_markers
from motionenv.types import MARKERS, Markers, Points


def noisy(points: Points, noise=0.02) -> Points:
    rng = np.random.default_rng(len(points.positions))
    return Points(points.positions + noise * rng.standard_normal(points.positions.shape), points.fps, points.unit)


def scaled(points: Points, by, unit="m") -> Points:
    return Points(points.positions * by, points.fps, unit, name="walk")


def test_real_walks_pass_at_every_view_with_and_without_noise(views):
    for points in views:
        for version in (points, noisy(points)):
            check_points(version)
            check_series(fourier_points(version))


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
    with pytest.raises(GapError, match="too short"):
        check_strides(Points(points.positions[:20], 30, "m"))
    with pytest.raises(GapError, match=r"0\.33 s; at least 0\.5 s"):
        check_points(Points(points.positions[:10], 30, "m"))
    with pytest.raises(MotionError, match="5 frames per second; at least 8"):
        check_points(Points(points.positions, 5, "m"))


def test_what_is_no_walk_is_refused(mocap, views):
    rng = np.random.default_rng(0)
    standing = np.nanmean(views[0].positions, axis=0) + 0.02 * rng.standard_normal((90, 15, 2))
    with pytest.raises(MotionError, match="isn't periodic"):
        check_series(fourier_points(Points(standing, 30, "m")))
    wandering = np.nanmean(views[0].positions, axis=0) + np.cumsum(0.02 * rng.standard_normal((90, 15, 2)), axis=0)
    with pytest.raises(MotionError, match="isn't periodic|isn't a walk"):
        check_series(fourier_points(Points(wandering, 30, "m")))
    clips = sorted((mocap / "bandai_namco").rglob("dataset-1_bow_*.bvh"))[:2]
    clips += sorted((mocap / "bandai_namco").rglob("dataset-1_punch_*.bvh"))[:1]
    clips += sorted((mocap / "bandai_namco").rglob("dataset-1_dance-short_*.bvh"))[:1]
    assert len(clips) == 4
    for clip in clips:
        markers = to_markers(read(clip))
        markers = Markers(MARKERS, markers.positions[:400], markers.fps, name=clip.stem)
        for alpha in (0.3, 1.4):
            with pytest.raises(MotionError, match="isn't periodic|isn't a walk|strides"):
                check_series(fourier_points(project_markers(markers, alpha, heading=0)))


def test_left_and_right_move_in_turn_by_definition():
    t = np.arange(120) / 30
    positions = np.zeros((120, 15, 2))
    for side, start in (("left", 0.0), ("right", np.pi)):
        positions[:, MARKERS.index(f"{side}_ankle"), 1] = np.sin(2 * np.pi * t + start) + np.cos(4 * np.pi * t)
    positions[:, 0] = np.random.default_rng(0).normal(0, 1e-3, (120, 2))
    assert alternation(fourier_points(Points(positions, 30, "m"))) == pytest.approx(1, abs=1e-3)
    positions[:, MARKERS.index("right_ankle")] = positions[:, MARKERS.index("left_ankle")]
    assert alternation(fourier_points(Points(positions, 30, "m"))) == pytest.approx(0.5, abs=1e-2)
    positions[:, MARKERS.index("right_ankle")] = np.nan
    positions[:, [MARKERS.index(f"left_{n}") for n in ("shoulder", "elbow", "wrist", "hip", "knee")]] = np.nan
    assert np.isnan(alternation(fourier_points(Points(positions, 30, "m"))))
