"""Heels, toes and the pelvis of captures, and the filter of their paths."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.body.kinematics import forward
from motionenv.errors import GapError
from motionenv.gait import feet_of
from motionenv.gait.feet import bridged, smoothed
from motionenv.mocap import read
from motionenv.models.synthesis import synthesize
from motionenv.types import MARKERS, Markers, Motion


def test_markers_are_taken_where_they_are(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    feet = feet_of(markers)
    assert (feet.sides, feet.notes, feet.fps) == (("left", "right"), (), 100.0)
    for side, letter in (("left", "L"), ("right", "R")):
        for name, path in (("HEE", feet.heel), ("TOE", feet.toe)):
            own = next(i for i, n in enumerate(markers.names) if n.endswith(letter + name))
            np.testing.assert_array_equal(path[side], markers.positions[:, own])
    assert 0.7 < np.nanmedian(feet.pelvis[:, 2]) < 1.1


def test_missing_heels_are_told(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    without = [i for i, n in enumerate(markers.names) if not n.endswith("LHEE")]
    feet = feet_of(Markers(tuple(markers.names[i] for i in without), markers.positions[:, without], markers.fps))
    assert feet.notes == ("the ankle stands in for the left heel, where no marker is",)
    assert np.nanmedian(np.linalg.norm(feet.heel["left"] - feet.toe["left"], axis=-1)) > 0.05


def test_what_one_landmark_stands_in_for_is_told_at_once():
    motion = synthesize("walk/fpca", seconds=2, fps=50, seed=1)
    feet = feet_of(Markers(MARKERS, forward(motion.poses, motion.skeleton)[0][:, :15], 50))
    everything = "the left heel, the left toe, the right heel and the right toe"
    assert feet.notes == (f"the ankle stands in for {everything}, where no marker is",)


def test_motion_has_the_bodys_drawn_feet():
    motion = synthesize("walk/fpca", seconds=3, fps=50, seed=1, height=1.8)
    feet = feet_of(motion)
    for side in ("left", "right"):
        length = np.linalg.norm(feet.toe[side] - feet.heel[side], axis=-1)
        np.testing.assert_allclose(length, length[0])
        assert 0.2 < length[0] < 0.3
        assert -0.03 < feet.heel[side][:, 2].min() < 0.08


def test_one_leg_and_no_leg():
    motion = synthesize("walk/fpca", seconds=2, fps=50, seed=1)
    poses = motion.poses.copy()
    poses[:, 21:] = np.nan
    assert feet_of(Motion(poses, motion.skeleton, 50)).sides == ("left",)
    poses[:, 17:] = np.nan
    with pytest.raises(GapError, match="has no leg"):
        feet_of(Motion(poses, motion.skeleton, 50))
    with pytest.raises(GapError, match="one motion"):
        feet_of(Motion(np.zeros((2, 10, 25)), from_height(), 50))
    with pytest.raises(GapError):
        feet_of(Markers(("A", "B"), np.zeros((5, 2, 3)), 50))


@pytest.mark.parametrize("fps", [30.0, 100.0, 300.0])
def test_straight_paths_pass_from_end_to_end(fps):
    """A filter that hasn't settled at the ends would slow a walker down there."""
    path = np.arange(round(1.3 * fps))[:, None] / fps * [1.2, -0.3]
    for cutoff in (0.5, 0.8, 7.0):
        np.testing.assert_allclose(smoothed(path, fps, cutoff), path, atol=0.002)


def test_the_cutoff_halves_an_amplitude_and_delays_nothing():
    t = np.arange(1000) / 100
    wave = np.cos(2 * np.pi * 2 * t)[:, None]
    middle = slice(200, 800)
    np.testing.assert_allclose(smoothed(wave, 100.0, 2.0)[middle], 0.5 * wave[middle], atol=0.01)
    np.testing.assert_allclose(smoothed(wave, 100.0, 40.0)[middle], wave[middle], atol=0.01)
    np.testing.assert_array_equal(smoothed(wave, 4.0, 2.0), wave)


@pytest.mark.parametrize("frames", range(1, 12))
def test_short_paths_stay_finite(frames):
    path = np.random.default_rng(frames).standard_normal((frames, 3))
    assert np.isfinite(smoothed(path, 100.0, 7.0)).all()


def test_gaps_are_bridged_and_ends_are_held():
    path = np.array([[np.nan, 0], [1, 1], [np.nan, 7], [3, 3], [np.nan, np.nan]])
    np.testing.assert_allclose(bridged(path), [[1, 1], [1, 1], [2, 2], [3, 3], [3, 3]])
    assert np.isnan(bridged(np.full((4, 2), np.nan))).all()
