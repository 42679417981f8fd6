"""Which parts of a body are known, by forward kinematics: NaN in a pose reaches exactly what depends on it."""

import numpy as np
import pytest

from motionenv.body import LIMBS, NODES, from_height, limb_segments, markers
from motionenv.body.gaps import PARTS, check_shown, known_limbs, known_markers, listed, missing_parts
from motionenv.errors import GapError
from motionenv.types import MARKERS, POSE

BODY = from_height()
UPPER = ("left_trunk", "right_trunk", "left_shoulder", "right_shoulder"), ("sternum", "left_shoulder", "right_shoulder")


@pytest.mark.parametrize("entry", range(25))
def test_an_unknown_entry_hides_what_kinematics_makes_nan(entry):
    pose = np.full(25, 0.1)
    pose[entry] = np.nan
    np.testing.assert_array_equal(known_limbs(pose), np.isfinite(limb_segments(pose, BODY)).all(axis=(1, 2)))
    np.testing.assert_array_equal(known_markers(pose), np.isfinite(markers(pose, BODY)).all(axis=1))


def test_a_torso_with_nothing_above_it_is_unknown():
    """A capture of the lower body says nothing of the trunk, though the root places it."""
    poses = np.full((2, 25), 0.1)
    poses[0, 6:17] = np.nan
    limbs, points = known_limbs(poses), known_markers(poses)
    assert {LIMBS[i] for i in np.flatnonzero(limbs[0])} == {
        "pelvis", *(f"{side}_{limb}" for side in ("left", "right") for limb in ("thigh", "shin", "foot"))
    }  # fmt: skip
    assert [MARKERS[i] for i in np.flatnonzero(points[0])] == ["pelvis", *NODES[9:15]]
    assert limbs[1].all()
    assert points[1].all()
    assert not limbs[0, [LIMBS.index(name) for name in UPPER[0]]].any()
    assert not points[0, [MARKERS.index(name) for name in UPPER[1]]].any()


def test_parts_cover_the_pose_once_and_are_missing_only_throughout():
    assert sorted(i for entries in PARTS.values() for i in entries) == list(range(len(POSE)))
    poses = np.zeros((3, 25))
    poses[:, 6:13], poses[:2, 20] = np.nan, np.nan
    assert missing_parts(poses) == ("neck", "left arm")
    assert missing_parts(np.zeros((0, 25))) == tuple(PARTS)
    assert listed(["neck", "left arm", "right arm"]) == "the neck, the left arm and the right arm"
    check_shown(poses, ["left leg"], "walking")
    with pytest.raises(GapError, match=r"the tree needs the neck and the left arm, never shown.*motionenv\.fill"):
        check_shown(poses, PARTS, "the tree")
