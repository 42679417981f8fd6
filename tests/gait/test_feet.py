"""Heels, toes and the pelvis of captures."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import GapError
from motionenv.gait import feet_of
from motionenv.mocap import read
from motionenv.models.synthesis import synthesize
from motionenv.types import Markers, Motion


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
    assert feet.notes == ("the ankle stands in for the left heel, which has no marker",)
    assert np.nanmedian(np.linalg.norm(feet.heel["left"] - feet.toe["left"], axis=-1)) > 0.05


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
