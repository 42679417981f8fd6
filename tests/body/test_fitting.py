"""Fitting the body to points that a known body made."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv import body
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.body.skeleton import SEGMENTS
from motionenv.errors import GapError, MotionError
from motionenv.types import POSE

FPS = 100.0


def smooth_motion(seed, frames=240):
    """Poses (frames, 25) that swing within the joints' ranges, knees and elbows bent by 10° at least."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None] / FPS
    poses = rng.normal(0, 0.3, 25) * np.sin(2 * np.pi * (time * rng.uniform(0.4, 1, 25) + rng.uniform(0, 1, 25)))
    hinges = [i for i, n in enumerate(POSE) if "knee" in n or "elbow" in n]
    poses[:, hinges] = np.abs(poses[:, hinges]) + 0.35
    poses[:, 5] += np.linspace(0, 8, frames)  # turns more than once around
    return poses


def nodes_of(poses, skeleton):
    nodes, rotations = body.forward(poses, skeleton)
    return nodes, rotations[:, SEGMENTS.index("head"), :, 1]


@given(st.integers(0, 10_000))
def test_poses_come_back(seed):
    skeleton, poses = body.from_height(1.68), smooth_motion(seed)
    nodes, head_side = nodes_of(poses, skeleton)
    fitted = fit_poses(nodes, skeleton, FPS, head_side)
    turns = (fitted - poses)[0] / (2 * np.pi)
    off = np.abs(fitted - poses - 2 * np.pi * np.round(turns))
    axial = [i for i, n in enumerate(POSE) if n.endswith(("shoulder_rotation", "hip_rotation"))]
    assert np.delete(off, axial, axis=1).max() < 5e-3
    assert off[:, axial].max() < 0.15  # drawn towards neighbours where the limb is nearly straight
    assert np.abs(body.forward(fitted, skeleton)[0] - nodes).max() < 0.02


@given(st.floats(0.9, 2.2), st.integers(0, 1000))
def test_a_persons_limbs_come_back(height, seed):
    skeleton = body.from_height(height)
    nodes, _ = nodes_of(smooth_motion(seed), skeleton)
    fitted = fit_skeleton(nodes)
    assert np.allclose(fitted.offsets, skeleton.offsets, atol=1e-9)
    assert fitted.height == pytest.approx(height)


def test_gaps_stay_gaps_and_spread_no_further():
    skeleton, poses = body.from_height(), smooth_motion(1)
    nodes, side = nodes_of(poses, skeleton)
    nodes[50:60, body.NODES.index("left_wrist")] = np.nan
    nodes[100:110, body.NODES.index("left_hip")] = np.nan  # six points of the torso are left: nothing is lost
    nodes[200:205] = np.nan
    fitted = fit_poses(nodes, skeleton, FPS, side)
    lost = np.isnan(fitted)
    assert lost[200:205].all()
    assert {POSE[i] for i in np.flatnonzero(lost[50:60].all(0))} == {"left_shoulder_rotation", "left_elbow_flexion"}
    assert not lost[100:110].any()
    assert lost.sum() == 5 * 25 + 10 * 2
    again = body.forward(fitted, skeleton)[0]
    assert np.nanmax(np.abs(again - nodes)) < 5e-3


def test_a_straight_leg_keeps_its_heading():
    poses = np.zeros((200, 25))
    poses[:, POSE.index("left_hip_rotation")] = 0.3
    knee = POSE.index("left_knee_flexion")
    poses[:, knee] = np.maximum(0, 0.8 * np.sin(np.arange(200) / 15))
    skeleton = body.from_height()
    nodes, _ = nodes_of(poses, skeleton)
    noisy = nodes + np.random.default_rng(2).normal(0, 0.001, nodes.shape)
    rotation = fit_poses(noisy, skeleton, FPS)[:, POSE.index("left_hip_rotation")]
    assert np.abs(np.diff(rotation)).max() < 0.1
    assert np.median(rotation[poses[:, knee] > 0.4]) == pytest.approx(0.3, abs=0.03)


def test_a_missing_neck_is_taken_between_the_shoulders():
    nodes, _ = nodes_of(smooth_motion(3), body.from_height())
    nodes[:, body.NODES.index("neck")] = np.nan
    fitted = fit_skeleton(nodes)
    shoulders = fitted.offsets[[body.NODES.index("left_shoulder"), body.NODES.index("right_shoulder")]]
    assert np.allclose(fitted.offsets[body.NODES.index("neck")], shoulders.mean(0), atol=1e-9)


def test_what_can_not_be_fitted_is_said():
    nodes, _ = nodes_of(smooth_motion(3), body.from_height())
    hidden = nodes.copy()
    hidden[:, body.NODES.index("left_ankle")] = np.nan
    with pytest.raises(GapError, match="left_knee and left_ankle are never seen"):
        fit_skeleton(hidden)
    with pytest.raises(MotionError, match="check the unit"):
        fit_skeleton(nodes * 1000)
    with pytest.raises(MotionError, match=r"shape \(frames, 16, 3\)"):
        fit_poses(nodes[:, :15], body.from_height(), FPS)
