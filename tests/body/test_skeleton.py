"""The body's tables: proportions, limits, mirrors, and that indices hang together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv import body
from motionenv.body.limbs import CLOTHES, COLOURS, LIMB_NODES, LIMB_SEGMENT, LIMBS, limb_radii
from motionenv.body.skeleton import EDGES, LIMITS, NODES, SEGMENT_ORIGIN, SEGMENT_PARENT, SEGMENTS, symmetric
from motionenv.errors import MotionError
from motionenv.types import MARKERS, POSE

SWAP = [NODES.index(n.replace("left", "?").replace("right", "left").replace("?", "right")) for n in NODES]
angles = st.lists(st.floats(-2.5, 2.5), min_size=25, max_size=25).map(np.array)


@given(angles)
def test_mirrored_pose_is_the_mirror_image(pose):
    skeleton = body.from_height(1.7)
    image = body.forward(body.mirror(pose), skeleton)[0][SWAP] * [1, -1, 1]
    assert np.allclose(image, body.forward(pose, skeleton)[0], atol=1e-12)


def test_height_is_from_sole_to_crown():
    skeleton = body.from_height(1.8)
    pose = np.zeros(25)
    pose[2] = 0.53 * 1.8
    ends, radius = body.limb_segments(pose, skeleton), skeleton.radii[..., None]
    crown = (ends[..., 2:] + radius[:, :, :]).max()
    assert crown == pytest.approx(1.8, abs=0.02)


@pytest.mark.parametrize("height", [0, -1, np.nan, 3])
def test_impossible_heights_are_refused(height):
    with pytest.raises(MotionError, match="height must be a number of metres from 0.5 to 2.5"):
        body.from_height(height)


def test_limits_hold_standing_and_tell_a_knee_bent_backwards():
    pose = np.zeros(25)
    assert (body.limit_excess(pose) == 0).all()
    pose[POSE.index("left_knee_flexion")] = -0.2
    assert body.limit_excess(pose)[POSE.index("left_knee_flexion")] == pytest.approx(-0.2)


def test_a_symmetric_body_is_its_own_mirror_image():
    lopsided = body.from_height().offsets + np.random.default_rng(0).normal(0, 0.02, (16, 3))
    even = symmetric(lopsided)
    assert np.allclose(even, even[SWAP] * [1, -1, 1])
    assert np.allclose(symmetric(even), even)


def test_proportions_are_winters():
    """Fig. 4.1 of Winter (2009): lengths as shares of the height, of both sides alike, at any height."""
    skeleton = body.from_height(2.0)
    length = dict(zip(NODES, np.linalg.norm(skeleton.offsets, axis=1) / 2.0, strict=True))
    for node, share in (("knee", 0.245), ("ankle", 0.246), ("elbow", 0.186), ("wrist", 0.146)):
        assert length[f"left_{node}"] == length[f"right_{node}"] == pytest.approx(share)
    np.testing.assert_allclose(symmetric(skeleton.offsets), skeleton.offsets)
    np.testing.assert_allclose(body.from_height(1.0).offsets * 2, skeleton.offsets)


def test_girth_makes_limbs_thicker_and_no_longer():
    slim, stout = body.from_height(1.7), body.from_height(1.7, girth=1.5)
    np.testing.assert_array_equal(slim.offsets, stout.offsets)
    feet = [LIMBS.index("left_foot"), LIMBS.index("right_foot")]
    np.testing.assert_array_equal(stout.radii[feet], slim.radii[feet])  # soles stay on the ground
    assert (np.delete(stout.radii / slim.radii, feet, axis=0) > 1.49).all()
    np.testing.assert_allclose(limb_radii(3.4), 2 * slim.radii)
    for girth in (0.4, 2.1, np.nan, True):
        with pytest.raises(MotionError, match=r"girth must be a number from 0\.5 to 2, got "):
            limb_radii(1.7, girth)


def test_segments_form_a_tree_from_the_torso_and_begin_at_their_joints():
    assert SEGMENT_PARENT[0] == -1
    for i, name in enumerate(SEGMENTS):
        assert -1 <= SEGMENT_PARENT[i] < len(SEGMENTS)
        way = [i]
        while way[-1] != 0:
            way.append(SEGMENT_PARENT[way[-1]])
            assert len(way) < 5
        sides = {SEGMENTS[s].split("_")[0] for s in (*way[:-1], i)} & {"left", "right"}
        assert len(sides) <= 1, name
        assert NODES[SEGMENT_ORIGIN[i]].startswith(("left", "right")) == name.startswith(("left", "right"))


def test_drawn_limbs_hang_together_in_the_body_at_rest():
    """Ends of a limb's sides are mirror images; the stick figure joins all markers once."""
    still = body.limb_segments(np.zeros(25), body.from_height())
    for i, limb in enumerate(LIMBS):
        if limb.startswith("left_"):
            other = LIMBS.index(limb.replace("left", "right"))
            np.testing.assert_allclose(still[i] * [1, -1, 1], still[other], atol=1e-12)
            sides = [SEGMENTS[LIMB_SEGMENT[i]], *(NODES[n] for n in LIMB_NODES[i])]
            assert not any(name.startswith("right_") for name in sides)
            assert limb.endswith("trunk") or any(name.startswith("left_") for name in sides)
    assert len(EDGES) == len(MARKERS) - 1  # a tree
    reached = {EDGES[0][0]}
    for a, b in EDGES * 2:
        reached |= {a, b} if {a, b} & reached else set()
    assert reached == set(range(len(MARKERS)))
    assert len(CLOTHES) == len(LIMBS)
    assert set(CLOTHES) == set(COLOURS)


def test_limits_are_alike_on_both_sides_and_a_gap_is_no_excess():
    assert (LIMITS[:, 0] < LIMITS[:, 1]).all()
    assert np.isinf(LIMITS[:6]).all()
    for name in POSE:
        if name.startswith("left_"):
            np.testing.assert_array_equal(LIMITS[POSE.index(name)], LIMITS[POSE.index(name.replace("left", "right"))])
    poses = np.zeros((2, 25))
    poses[0, POSE.index("left_elbow_flexion")] = np.radians(160)
    poses[1, POSE.index("neck_bend")] = np.nan
    excess = body.limit_excess(poses)
    assert excess[0, POSE.index("left_elbow_flexion")] == pytest.approx(np.radians(10))
    assert np.isnan(excess).sum() == 1


@given(angles)
def test_mirrored_twice_it_is_the_same(pose):
    np.testing.assert_array_equal(body.mirror(body.mirror(pose)), pose)
