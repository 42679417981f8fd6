"""What lifting refuses, on real walks and on what is none; and left and right mixed up in real walks."""

import numpy as np
import pytest

from motionenv.errors import GapError, MotionError
from motionenv.lifting.fourier_fit import fourier_points
from motionenv.lifting.projection import project_markers
from motionenv.lifting.validation import (
    GROUPS,
    alternation,
    check_points,
    check_series,
    check_strides,
    swapped_frames,
    unswapped,
)
from motionenv.mocap import read, to_markers
from motionenv.models.eigenwalkers.extraction import steady_stretch
from motionenv.types import MARKERS, Markers, Points

TRIALS = ("02/02_01", "07/07_08", "12/12_02", "35/35_10", "49/49_01")
VIEWS = np.radians([0, 30, 60, 90, 150])


@pytest.fixture(scope="module")
def views(mocap) -> list[Points]:
    """Real walks at 30 frames per second, from five directions each."""
    out = []
    for trial in TRIALS:
        markers = to_markers(read(mocap / "cmu_asfamc" / f"{trial}.amc", fps=120))
        for alpha in VIEWS:
            points = project_markers(markers, alpha).positions[steady_stretch(markers)][::4]
            out.append(Points(points, 30, "m", name=f"{trial} at {alpha:.2f}"))
    return out


def noisy(points: Points, noise=0.02) -> Points:
    rng = np.random.default_rng(len(points.positions))
    return Points(points.positions + noise * rng.standard_normal(points.positions.shape), points.fps, points.unit)


def scaled(points: Points, by, unit="m") -> Points:
    return Points(points.positions * by, points.fps, unit, name="walk")


def mixed_up(points: Points, labels) -> Points:
    """Left and right exchanged marker by marker where `labels` (frames, 2) of arms and legs say so."""
    positions = points.positions.copy()
    for g, pairs in enumerate(GROUPS.values()):
        for pair in pairs:
            left, right = (MARKERS.index(f"{side}_{pair}") for side in ("left", "right"))
            for i in np.flatnonzero(labels[:, g]):
                positions[i, [left, right]] = positions[i, [right, left]]
    return Points(positions, points.fps, points.unit)


def some_labels(frames: int, kind: str, rng) -> np.ndarray:
    labels = np.zeros((frames, 2), dtype=bool)
    if kind == "single frames":
        labels[:] = rng.random((frames, 2)) < 0.1
    elif kind == "whole side":
        labels[rng.random(frames) < 0.3] = True
    elif kind == "runs":
        for g in (0, 1, 1):
            start = rng.integers(0, frames - 12)
            labels[start : start + rng.integers(3, 12), g] = True
    elif kind == "from here on":
        labels[round(0.65 * frames) :] = True
    return labels


def test_real_walks_pass_at_every_view_with_and_without_noise(views):
    for points in views:
        for version in (points, noisy(points)):
            check_points(version)
            check_series(fourier_points(version))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("kind", ["none", "single frames", "whole side", "runs", "from here on"])
def test_mixed_up_frames_are_found(views, kind, noise):
    rng = np.random.default_rng(3)
    found = truly = wrong = fine = 0
    for points in views[::4]:
        labels = some_labels(len(points.positions), kind, rng)
        seen = swapped_frames(mixed_up(noisy(points, noise), labels))
        found, truly = found + (seen & labels).sum(), truly + labels.sum()
        wrong, fine = wrong + (seen & ~labels).sum(), fine + (~labels).sum()
    assert found >= 0.95 * truly
    assert wrong < 0.01 * fine


def test_unswapped_puts_left_and_right_back(views):
    points = views[1]
    labels = some_labels(len(points.positions), "runs", np.random.default_rng(0))
    assert labels.any()
    back, found = unswapped(mixed_up(points, labels))
    np.testing.assert_array_equal(found, labels)
    np.testing.assert_array_equal(back.positions, points.positions)


def test_gaps_don_t_look_mixed_up(views):
    rng = np.random.default_rng(0)
    for points in views[::6]:
        positions = points.positions.copy()
        positions[rng.random(positions.shape[:2]) < 0.2] = np.nan
        positions[:, [MARKERS.index(n) for n in ("left_wrist", "left_elbow")]] = np.nan
        labels = some_labels(len(positions), "runs", rng)
        found = swapped_frames(mixed_up(Points(positions, 30, "m"), labels))
        assert (found == labels)[:, 1].mean() > 0.97


@pytest.mark.parametrize(
    ("by", "unit", "says"),
    [
        (1000, "m", 'looks like millimetres: set unit="mm"'),
        (100, "m", 'looks like centimetres: set unit="cm"'),
        ([300, -300], "m", 'looks like pixels.*unit="px"'),
        (7, "m", "isn't the height of a person"),
        (0.01, "m", "isn't the height of a person"),
        (300, "px", "upside down"),
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
