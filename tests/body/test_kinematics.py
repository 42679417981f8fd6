"""Forward kinematics against scipy's rotations, hand calculation, and symmetry."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv import body
from motionenv.body.kinematics import FOOT_BALL
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import MotionError
from motionenv.types import MARKERS, POSE

NODE = {name: i for i, name in enumerate(body.NODES)}
angles = st.lists(st.floats(-2.5, 2.5), min_size=25, max_size=25).map(np.array)


def posed(**entries):
    """The zero pose of a 1.8 m person with some entries set [degrees for angles, metres for the root]."""
    pose = np.zeros(25)
    for name, value in entries.items():
        pose[POSE.index(name)] = value if name in ("root_x", "root_y", "root_z") else np.radians(value)
    return body.forward(pose, body.from_height(1.8))[0]


def by_scipy(pose, skeleton):
    """The nodes again, from scipy's intrinsic Euler angles and the tree written out."""
    offset = dict(zip(body.NODES, skeleton.offsets.copy(), strict=True))
    value = dict(zip(POSE, pose, strict=True))
    torso = Rotation.from_euler("ZXY", [value["root_heading"], value["root_obliquity"], value["root_tilt"]])
    root = pose[:3]
    at = {n: root + torso.apply(offset[n]) for n in (*body.NODES[1:5], "left_hip", "right_hip", "neck")}
    head = torso * Rotation.from_euler("YXZ", [value["neck_flexion"], -value["neck_bend"], value["neck_rotation"]])
    at["head"] = at["neck"] + head.apply(offset["head"])
    for side, out in (("left", 1), ("right", -1)):
        for ball, middle, end, hinge in (("shoulder", "elbow", "wrist", -1), ("hip", "knee", "ankle", 1)):
            flexion, abduction, turn = (value[f"{side}_{ball}_{a}"] for a in ("flexion", "abduction", "rotation"))
            upper = torso * Rotation.from_euler("YXZ", [-flexion, out * abduction, -out * turn])
            lower = upper * Rotation.from_euler("Y", hinge * value[f"{side}_{middle}_flexion"])
            at[f"{side}_{middle}"] = at[f"{side}_{ball}"] + upper.apply(offset[f"{side}_{middle}"])
            at[f"{side}_{end}"] = at[f"{side}_{middle}"] + lower.apply(offset[f"{side}_{end}"])
    return np.array([at[n] for n in body.NODES])


@given(angles)
def test_nodes_equal_scipys(pose):
    skeleton = body.from_height(1.65)
    assert np.allclose(body.forward(pose, skeleton)[0], by_scipy(pose, skeleton), atol=1e-11)


@given(angles)
def test_all_frames_are_rotations(pose):
    _, rotations = body.forward(pose, body.from_height())
    assert np.allclose(rotations @ rotations.swapaxes(-1, -2), np.eye(3), atol=1e-12)
    assert (np.linalg.det(rotations) > 0).all()


def test_zero_pose_stands_upright_and_looks_ahead():
    nodes = posed(root_z=0.53 * 1.8)
    assert nodes[NODE["left_ankle"]] == pytest.approx([0, 0.09, ANKLE_HEIGHT * 1.8])
    assert nodes[NODE["left_wrist"], 1] > 0 > nodes[NODE["right_wrist"], 1]
    assert nodes[NODE["sternum"], 0] > 0


@pytest.mark.parametrize(
    ("entry", "node", "axis", "sign"),
    [
        ("left_hip_flexion", "left_knee", 0, 1),
        ("right_hip_flexion", "right_knee", 0, 1),
        ("left_hip_abduction", "left_knee", 1, 1),
        ("right_hip_abduction", "right_knee", 1, -1),
        ("left_knee_flexion", "left_ankle", 0, -1),
        ("right_elbow_flexion", "right_wrist", 0, 1),
        ("left_shoulder_abduction", "left_elbow", 1, 1),
        ("neck_flexion", "head", 0, 1),
        ("neck_bend", "head", 1, 1),
        ("root_tilt", "head", 0, 1),
        ("root_obliquity", "left_hip", 2, 1),
        ("root_heading", "sternum", 1, 1),
    ],
)
def test_positive_angles_move_as_the_clinic_says(entry, node, axis, sign):
    moved = posed(**{entry: 20}) - posed()
    assert sign * moved[NODE[node], axis] > 0.01


def test_inward_rotation_swings_a_bent_forearm_to_the_midline():
    for side, towards in (("left", -1), ("right", 1)):
        bent = {f"{side}_elbow_flexion": 90}
        moved = posed(**bent, **{f"{side}_shoulder_rotation": 30}) - posed(**bent)
        assert towards * moved[NODE[f"{side}_wrist"], 1] > 0.05


def test_a_gap_hides_only_what_hangs_on_it():
    pose = np.zeros(25)
    pose[POSE.index("left_hip_flexion")] = np.nan
    nodes = body.markers(pose, body.from_height())
    hidden = {m for m, p in zip(MARKERS, nodes, strict=True) if np.isnan(p).any()}
    assert hidden == {"left_knee", "left_ankle"}


def test_feet_stay_above_the_ground_whatever_the_shin_does():
    skeleton = body.from_height(1.75)
    pose = np.zeros((41, 25))
    pose[:, POSE.index("left_knee_flexion")] = np.linspace(0, 1.2, 41)
    ankle = body.markers(pose, skeleton)[:, MARKERS.index("left_ankle"), 2]
    for rise in (0.0, 0.05, 0.3):
        pose[:, 2] += ANKLE_HEIGHT * skeleton.height + rise - ankle - pose[:, 2]
        ends = body.limb_segments(pose, skeleton)[:, body.LIMBS.index("left_foot")]
        sole = ends[..., 2] - skeleton.radii[body.LIMBS.index("left_foot")]
        assert sole.min() > -2e-3
        assert np.allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1), np.linalg.norm(ends[0, 1] - ends[0, 0]))


def test_limb_ends_join_the_nodes():
    rng = np.random.default_rng(4)
    poses, skeleton = rng.normal(0, 0.5, (7, 25)), body.from_height()
    ends, nodes = body.limb_segments(poses, skeleton), body.forward(poses, skeleton)[0]
    for limb, near, far in (("left_thigh", "left_hip", "left_knee"), ("right_forearm", "right_elbow", "right_wrist")):
        assert np.allclose(ends[:, body.LIMBS.index(limb)], nodes[:, [NODE[near], NODE[far]]])


def test_batches_of_any_shape_and_none():
    poses = np.random.default_rng(0).normal(size=(2, 3, 25))
    whole = body.markers(poses, body.from_height())
    assert whole.shape == (2, 3, 15, 3)
    assert np.array_equal(whole[1, 2], body.markers(poses[1, 2], body.from_height()))
    assert body.limb_segments(np.empty((0, 25)), body.from_height()).shape == (0, len(body.LIMBS), 2, 3)


def test_wrong_shape_is_named():
    with pytest.raises(MotionError, match=r"\(\.\.\., 25\), got \(3, 24\)"):
        body.markers(np.zeros((3, 24)), body.from_height())


def test_feet_are_where_forward_puts_them():
    rng = np.random.default_rng(3)
    poses, person = rng.normal(0, 0.6, (40, 25)), body.from_height(1.7)
    poses[:, 2] += 0.9
    nodes, rotations = body.forward(poses, person)
    ankles, balls = body.feet(poses, person)
    np.testing.assert_allclose(ankles, nodes[:, 13:15], atol=1e-12)
    np.testing.assert_allclose(balls, nodes[:, 13:15] + rotations[:, 10:12] @ (FOOT_BALL * 1.7), atol=1e-12)
