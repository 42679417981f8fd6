"""Poses from points that a known body made, and from real capture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv import body
from motionenv import mocap as capture
from motionenv.body.fitting import fit_poses, fit_skeleton
from motionenv.body.skeleton import LIMITS, SEGMENTS
from motionenv.errors import MotionError
from motionenv.mocap.retargeting import find_nodes
from motionenv.types import POSE

FPS = 100.0
LEFT_KNEE = POSE.index("left_knee_flexion")
BONES = {"left_thigh": "lfemur", "right_thigh": "rfemur", "left_upper_arm": "lhumerus", "right_upper_arm": "rhumerus"}
UPPER = [n for n in body.NODES if not any(joint in n for joint in ("pelvis", "hip", "knee", "ankle"))]
TORSO = {"pelvis", "sternum", "neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip"}


#: Entries of the elbows' and knees' flexion.
FLEXIONS = [12, 16, 20, 24]


def limits(seed):
    """One pose (1, 25) anywhere within the joints' limits."""
    free = np.isinf(LIMITS[:, 0])
    low, high = np.where(free, -1.4, LIMITS[:, 0]), np.where(free, 1.4, LIMITS[:, 1])
    return np.random.default_rng(seed).uniform(low, high)[None]


def without(nodes, names):
    hidden = nodes.copy()
    hidden[:, [body.NODES.index(name) for name in names]] = np.nan
    return hidden


def speeds(poses, fps):
    """Angular speed [rad/s] (25,) of each entry's fastest step."""
    return np.nanmax(np.abs(np.diff(poses, axis=0)), axis=0) * fps


@given(st.integers(0, 10_000))
def test_smooth_poses_come_back_exactly(smooth_motion, nodes_of, seed):
    skeleton, poses = body.from_height(1.68), smooth_motion(seed)
    nodes, head_side, _ = nodes_of(poses, skeleton)
    off = fit_poses(nodes, skeleton, FPS, head_side) - poses
    off -= 2 * np.pi * np.round(off[0] / (2 * np.pi))
    assert np.abs(off).max() < 1e-7


@given(st.integers(0, 10_000))
def test_any_pose_within_the_limits_makes_the_same_body(nodes_of, seed):
    """A single frame whose elbows and knees are bent: one arm in 200 at random that is straighter than 17° is not."""
    skeleton, pose = body.from_height(1.68), limits(seed)
    pose[:, FLEXIONS] = np.maximum(pose[:, FLEXIONS], 0.3)
    nodes, head_side, _ = nodes_of(pose, skeleton)
    fitted = fit_poses(nodes, skeleton, FPS, head_side)
    again, rotations = body.forward(fitted, skeleton)
    assert np.abs(again - nodes).max() < 1e-4
    moving = [i for i, name in enumerate(SEGMENTS) if "foot" not in name]
    assert np.abs(rotations - body.forward(pose, skeleton)[1])[:, moving].max() < 1e-3


@pytest.mark.parametrize("limb", ["shoulder", "hip"])
@pytest.mark.parametrize("bend", [0.0, 1e-3, 0.02, 0.2])
@pytest.mark.parametrize("abduction", [np.pi / 2, np.pi / 2 - 1e-3, 1.5, 0.0])
def test_singular_poses_make_the_same_nodes(nodes_of, limb, bend, abduction):
    skeleton, pose = body.from_height(), np.zeros((1, 25))
    hinge = {"shoulder": "elbow", "hip": "knee"}[limb]
    for name, angle in ((f"{limb}_flexion", 0.4), (f"{limb}_abduction", abduction), (f"{hinge}_flexion", bend)):
        pose[0, POSE.index(f"left_{name}")] = angle
    nodes = nodes_of(pose, skeleton)[0]
    fitted = fit_poses(nodes, skeleton, FPS)
    assert np.isfinite(fitted).all()
    assert np.abs(body.forward(fitted, skeleton)[0] - nodes).max() < 1e-4


@given(st.integers(0, 10_000))
def test_straight_limbs_and_gimbal_lock_make_no_jump(nodes_of, seed):
    """Arms that swing through straightness and through sideways, at up to 3 rad/s: nothing turns much faster."""
    rng = np.random.default_rng(seed)
    time = np.arange(400)[:, None] / FPS
    poses = np.zeros((400, 25))
    waves = np.sin(2 * np.pi * (time * rng.uniform(0.2, 0.5, 8) + rng.uniform(0, 1, 8)))
    poses[:, 9:17] = waves * np.tile([0.8, 0.9, 0.6, 0.5], 2) + np.tile([0.3, 1.3, 0.0, 0.5], 2)
    skeleton = body.from_height()
    nodes = nodes_of(poses, skeleton)[0]
    fitted = fit_poses(nodes, skeleton, FPS)
    assert speeds(fitted, FPS).max() < 10
    assert np.abs(body.forward(fitted, skeleton)[0] - nodes).max() < 0.005


def test_a_straight_leg_keeps_its_heading(nodes_of):
    poses = np.zeros((200, 25))
    poses[:, POSE.index("left_hip_rotation")] = 0.3
    poses[:, LEFT_KNEE] = np.maximum(0, 0.8 * np.sin(np.arange(200) / 15))
    skeleton = body.from_height()
    noisy = nodes_of(poses, skeleton)[0]
    noisy = noisy + np.random.default_rng(2).normal(0, 0.001, noisy.shape)
    rotation = fit_poses(noisy, skeleton, FPS)[:, POSE.index("left_hip_rotation")]
    assert np.abs(np.diff(rotation)).max() < 0.05
    assert rotation == pytest.approx(0.3, abs=0.06)


def test_knees_bend_backwards_as_measured_and_elbows_hardly(nodes_of):
    """Genu recurvatum of 12° is a finding in a clinic; an elbow that is overstretched by as much is an error."""
    swing = np.sin(np.arange(300) / 20)
    poses = np.zeros((300, 25))
    elbow = POSE.index("right_elbow_flexion")
    poses[:, LEFT_KNEE] = np.radians(16) + np.radians(28) * swing
    poses[:, elbow] = np.radians(6) + np.radians(14) * swing
    skeleton = body.from_height()
    fitted = fit_poses(nodes_of(poses, skeleton)[0], skeleton, FPS)
    assert np.abs(fitted[:, LEFT_KNEE] - poses[:, LEFT_KNEE]).max() < np.radians(0.5)
    assert np.degrees(fitted[:, elbow].min()) > -5
    bent = poses[:, elbow] > 0
    assert np.abs(fitted - poses)[bent, elbow].max() < np.radians(0.5)
    assert speeds(fitted, FPS).max() < 5


def test_gaps_stay_gaps_and_spread_no_further(smooth_motion, nodes_of):
    skeleton, poses = body.from_height(), smooth_motion(1)
    nodes, side, _ = nodes_of(poses, skeleton)
    nodes[50:60, body.NODES.index("left_wrist")] = np.nan
    nodes[100:110, body.NODES.index("left_hip")] = np.nan  # six points of the torso are left: nothing is lost
    nodes[150:155, [body.NODES.index(n) for n in TORSO - {"pelvis", "left_hip", "right_hip"}]] = np.nan
    nodes[200:205] = np.nan
    fitted = fit_poses(nodes, skeleton, FPS, side)
    lost = np.isnan(fitted)
    assert lost[200:205].all()
    assert {POSE[i] for i in np.flatnonzero(lost[50:60].all(0))} == {"left_shoulder_rotation", "left_elbow_flexion"}
    assert lost[150:155].all()  # the tilt is open, and to stand upright for five frames would be a jump
    assert lost.sum() == 10 * 25 + 10 * 2
    assert np.nanmax(np.abs(body.forward(fitted, skeleton)[0] - nodes)) < 1e-6


@pytest.mark.parametrize(
    ("missing", "unknown"),
    [
        (("head",), ("neck_",)),
        (("left_wrist", "right_wrist"), ("elbow", "shoulder_rotation")),
        (("right_knee", "right_ankle"), ("right_hip", "right_knee")),
        (("right_hip", "right_knee", "right_ankle"), ("right_hip", "right_knee")),
        (("pelvis",), ()),
        ((*UPPER,), ("neck_", "shoulder", "elbow")),
        ((*UPPER, "pelvis"), ("neck_", "shoulder", "elbow")),
        ((*UPPER, "right_hip", "right_knee", "right_ankle"), ("neck_", "shoulder", "elbow", "right_hip", "right_knee")),
    ],
)
def test_what_is_seen_of_a_body_has_the_angles_of_the_whole(smooth_motion, nodes_of, missing, unknown):
    poses, skeleton = smooth_motion(5), body.from_height(1.8)
    nodes, side, torso = nodes_of(poses, skeleton)
    side = None if "head" in missing else side
    whole = fit_poses(nodes, skeleton, FPS, side)
    part = fit_poses(without(nodes, missing), skeleton, FPS, side, torso)
    gone = np.array([any(word in name for word in unknown) for name in POSE])
    assert np.isnan(part[:, gone]).all()
    assert np.abs(part - whole)[:, ~gone].max() < 1e-7


def test_legs_alone_stand_upright(smooth_motion, nodes_of):
    poses, skeleton = smooth_motion(6), body.from_height()
    poses[:, POSE.index("root_tilt")] = 0.0
    fitted = fit_poses(without(nodes_of(poses, skeleton)[0], UPPER), skeleton, FPS)
    known = [i for i, name in enumerate(POSE) if name.startswith("root") or "hip" in name or "knee" in name]
    off = (fitted - poses)[:, known]
    assert np.abs(off - 2 * np.pi * np.round(off[0] / (2 * np.pi))).max() < 1e-7


def test_a_torso_measured_elsewhere_takes_over_without_a_jump(smooth_motion, nodes_of):
    """The pelvis leans against the torso by 10°: that constant turn is taken out."""
    poses, skeleton = smooth_motion(7), body.from_height()
    nodes, _, torso = nodes_of(poses, skeleton)
    whole = fit_poses(nodes, skeleton, FPS)
    nodes[80:120, [body.NODES.index(n) for n in UPPER]] = np.nan
    c, s = np.cos(0.17), np.sin(0.17)
    fitted = fit_poses(nodes, skeleton, FPS, torso=torso @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]))
    assert np.nanmax(np.abs(fitted - whole)) < 1e-7


def test_what_can_not_be_posed_is_said(smooth_motion, nodes_of):
    skeleton = body.from_height()
    nodes, _, torso = nodes_of(smooth_motion(3), skeleton)
    with pytest.raises(MotionError, match=r"shape \(frames, 16, 3\)"):
        fit_poses(nodes[:, :15], skeleton, FPS)
    legs = without(nodes, UPPER)
    with pytest.raises(MotionError, match=r"torso must have shape \(240, 3, 3\)"):
        fit_poses(legs, skeleton, FPS, torso=torso[1:])
    with pytest.raises(MotionError, match="torso must hold rotations"):
        fit_poses(legs, skeleton, FPS, torso=-torso)


@pytest.fixture(scope="session")
def cmu_walks(mocap):
    """Nodes, head and the capture system's own rotations of thighs and upper arms, of every third of CMU's walks."""
    walks = []
    for path in sorted((mocap / "cmu_asfamc").glob("*/*.amc"))[::3]:
        markers = capture.read(path, fps=120)
        found = find_nodes(markers)
        nodes, side = found.positions, found.head_side
        bones = {seg: markers.rotations[:, markers.index(bone)] for seg, bone in BONES.items()}
        skeleton = fit_skeleton(nodes)
        walks.append((path.stem, nodes, fit_poses(nodes, skeleton, 120, side), skeleton, bones))
    return walks


def test_no_angle_of_a_real_walk_jumps_unless_a_bone_does(cmu_walks):
    for name, _, poses, _, bones in cmu_walks:
        turns = [np.linalg.matrix_norm(np.diff(bone, axis=0)).max() * 120 / np.sqrt(2) for bone in bones.values()]
        if max(turns) < 25:  # in 05_01 and 16_15 an arm itself turns by 30° and 94° between two frames
            assert speeds(poses, 120)[3:].max() < 30, name  # knees by 12° in 07_11, where the file's bones do


def test_limbs_of_a_real_walk_turn_as_their_markers_do(cmu_walks):
    """Rotation about thigh and upper arm, beside that which the capture system solved from markers on them."""
    off = []
    for _, _, poses, skeleton, bones in cmu_walks:
        rotations = body.forward(poses, skeleton)[1]
        for segment, bone in bones.items():
            local = rotations[:, SEGMENTS.index(segment)].swapaxes(-1, -2) @ bone
            level = np.abs(local[:, 2]).mean(0).argmin()
            angle = np.unwrap(np.arctan2(local[:, 1, level], local[:, 0, level]))
            off.append(np.degrees(np.std(angle)))
    assert np.mean(off) < 1.2
    assert np.max(off) < 6.0


def test_a_real_walks_nodes_stay_where_they_were(cmu_walks):
    error = np.concatenate([np.linalg.norm(body.forward(w[2], w[3])[0] - w[1], axis=-1).ravel() for w in cmu_walks])
    assert error.mean() < 0.0036
    assert np.quantile(error, 0.95) < 0.011
