"""SCoRE and SARA: joints that are known exactly are found exactly."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.body import NODES
from motionenv.errors import GapError
from motionenv.mocap import read
from motionenv.mocap.clinical import Measurements, calibrate, clinical_angles, lower_body
from motionenv.mocap.clinical.functional import functional_joint, functional_legs
from motionenv.mocap.clinical.gait_model import Segment
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.mocap.retargeting import find_nodes

AXIS = np.array([0.2, 0.95, -0.1]) / np.linalg.norm([0.2, 0.95, -0.1])
IN_PROXIMAL, IN_DISTAL = np.array([0.03, 0.1, -0.3]), np.array([-0.02, 0.05, 0.25])


def joined(relative: Rotation, noise: float = 0.0):
    """Two segments that turn against each other by `relative`, and the joint's centre (frames, 3)."""
    rng = np.random.default_rng(1)
    frames = len(relative)
    r = Rotation.from_rotvec(rng.normal(0, 0.3, (frames, 3)))
    t = rng.normal(0, 1.0, (frames, 3))
    centre = r.apply(IN_PROXIMAL) + t
    s = r * relative
    d = centre - s.apply(IN_DISTAL)
    shake = rng.normal(0, noise, (2, frames, 3))
    return Segment(t + shake[0], r.as_matrix()), Segment(d + shake[1], s.as_matrix()), centre


def ball(frames: int = 300) -> Rotation:
    return Rotation.from_rotvec(np.random.default_rng(2).normal(0, 0.3, (frames, 3)))


def hinge(frames: int = 300) -> Rotation:
    return Rotation.from_rotvec(np.linspace(0, 1.0, frames)[:, None] * AXIS)


def test_the_centre_of_a_ball_joint_is_exact():
    proximal, distal, centre = joined(ball())
    np.testing.assert_allclose(functional_joint(proximal, distal).centre, centre, atol=1e-9)


def test_noise_of_a_millimetre_leaves_it_within_a_millimetre():
    """The centre in the segments averages over 300 frames; in the world the frame's own noise stays."""
    proximal, distal, centre = joined(ball(), noise=0.001)
    away = functional_joint(proximal, distal).centre - centre
    assert np.sqrt((away**2).mean()) < 0.001
    assert np.linalg.norm(away.mean(0)) < 0.0005


@pytest.mark.parametrize("told", [True, False])
def test_a_hinge_has_its_axis_exactly_and_its_centre_on_it(told):
    proximal, distal, centre = joined(hinge())
    joint = functional_joint(proximal, distal, hinge=told)
    axis = proximal.rotation @ AXIS
    np.testing.assert_allclose(np.abs((joint.axis * axis).sum(-1)), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(joint.centre - centre, axis), 0.0, atol=1e-9)
    assert joint.swings[2] < 1e-6
    np.testing.assert_allclose(joint.swings[:2], np.std(np.linspace(0, 1.0, 300)), rtol=0.02)


def test_what_one_segment_shows_places_the_centre_where_the_other_is_hidden():
    proximal, distal, centre = joined(ball())
    origin = distal.origin.copy()
    origin[5:9] = np.nan
    joint = functional_joint(proximal, Segment(origin, distal.rotation))
    np.testing.assert_allclose(joint.centre, centre, atol=1e-9)


def test_too_few_frames_are_refused():
    proximal, distal, _ = joined(ball(9))
    with pytest.raises(GapError, match="needs 10 frames that show both segments; there are 9"):
        functional_joint(proximal, distal)


HALF, THIGH, SHANK = 0.09, 0.44, 0.42
# Clusters relative to the upper joint of thigh and shank, and to the ankle: x forward, y outward, z up. The outermost
# markers are as far from the limb's axis as those of average limbs.
CLUSTERS = {
    "thigh": [(0.03, 0.23 * THIGH, -0.18), (-0.04, 0.08, -0.22), (0.05, 0.07, -0.27)],
    "shank": [(0.03, 0.17 * THIGH, -0.15), (-0.03, 0.06, -0.2), (0.04, 0.05, -0.24)],
    "foot": [(-0.05, 0.01, -0.05), (0.14, 0.0, -0.07), (0.11, 0.05, -0.07)],
}
PELVIS = [(-0.1, 0.06, 0.1), (-0.1, -0.06, 0.1), (-0.12, 0.0, 0.06), (0.05, 0.0, 0.12)]


def walker(size: float = 1.0) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Landmarks and true joints of a walker with hinges, whose pelvis turns and lists; `size` scales all angles."""
    phase = np.linspace(0, 6 * np.pi, 300)
    pelvis = Rotation.from_euler("zx", size * np.column_stack([0.1 * np.sin(phase), 0.05 * np.cos(phase)]))
    middle = np.column_stack([0.2 * phase, 0 * phase, 0.9 + 0.02 * np.cos(2 * phase)])
    landmarks = {f"pelvis_cluster_{i + 1}": middle + pelvis.apply(p) for i, p in enumerate(PELVIS)}
    joints = {}
    for side, sign, shift in (("left", 1, 0.0), ("right", -1, np.pi)):
        at = middle + pelvis.apply([0, sign * HALF, 0])
        turn, lengths = pelvis, iter((THIGH, SHANK, 0.0))
        bends = (-0.1 - 0.4 * np.sin(phase + shift), 0.5 + 0.45 * np.cos(phase + shift), 0.2 * np.sin(phase + shift))
        for (name, shape), joint, bend in zip(CLUSTERS.items(), ("hip", "knee", "ankle"), bends, strict=True):
            turn = turn * Rotation.from_rotvec(size * bend[:, None] * [0.0, 1.0, 0.0])
            joints[f"{side}_{joint}"] = at
            for i, point in enumerate(shape):
                landmarks[f"{side}_{name}_cluster_{i + 1}"] = at + turn.apply(np.multiply(point, [1, sign, 1]))
            at = at + turn.apply([0, 0, -next(lengths)])
    return landmarks, joints


def test_a_rigid_walker_has_its_joints_exactly():
    landmarks, joints = walker()
    found = functional_legs(landmarks, None, {side: joints[f"{side}_hip"] for side in ("left", "right")})
    assert found.pelvis is None
    for name, truth in joints.items():
        np.testing.assert_allclose(found.landmarks[name], truth, atol=1e-6)


def test_without_known_hips_they_are_as_far_apart_as_usual():
    landmarks, joints = walker()
    found = functional_legs(landmarks, None, {})
    for name, truth in joints.items():
        assert np.linalg.norm(found.landmarks[name] - truth, axis=-1).max() < 0.006
    assert found.how["pelvis"] == "by a cluster, taken to be upright on average"
    left = Rotation.from_matrix(found.pelvis.rotation).apply([0, 1, 0])
    hips = joints["left_hip"] - joints["right_hip"]
    np.testing.assert_allclose(left, hips / np.linalg.norm(hips, axis=-1, keepdims=True), atol=1e-6)
    tilt = np.degrees(np.arcsin(-found.pelvis.rotation[:, 2, 0]))
    assert tilt.mean() == pytest.approx(10.0, abs=0.2)


def test_who_stands_is_asked_for_a_trial_that_moves():
    landmarks, _ = walker(0.02)
    with pytest.raises(GapError, match=r"left knee turns by 0\.\d degrees rms.* need a trial in which the joints move"):
        lower_body(landmarks, Measurements())
    assert not calibrate(landmarks, Measurements()).turns


def test_an_ankle_that_an_orthosis_holds_is_unknown_and_the_knee_is_not():
    landmarks, joints = walker()
    shank = [landmarks[f"left_shank_cluster_{i}"] for i in (1, 2, 3)]
    held = {f"left_foot_cluster_{i}": 2 * shank[i - 1] - np.mean(shank, axis=0) for i in (1, 2, 3)}
    found = functional_legs(landmarks | held, None, {side: joints[f"{side}_hip"] for side in ("left", "right")})
    assert "left_ankle" not in found.landmarks
    np.testing.assert_allclose(found.landmarks["left_knee"], joints["left_knee"], atol=1e-6)


def test_markers_on_the_joints_come_first():
    landmarks, _ = walker()
    for side in ("left", "right"):
        landmarks[f"{side}_knee_lateral"] = landmarks[f"{side}_thigh_cluster_1"]
    assert not functional_legs(landmarks, None, {}).landmarks


@pytest.mark.parametrize("trial", ["grf/Subject4/MarkerData/walking2.trc", "osim/LaiArnoldSubject6/walking1.trc"])
def test_clusters_of_real_walkers_tell_what_their_knee_markers_tell(mocap, trial):
    """Against the chord function on markers of hips, knees and ankles, which clusters don't use."""
    markers = read(mocap / "nimble" / trial)
    truth, found = (clinical_angles(markers, marker_map=name) for name in (None, "clusters"))
    assert "functional" in found.method
    assert "functional" not in truth.method
    for angle, most in (("hip_flexion", 3.0), ("knee_flexion", 6.0)):
        for side in ("left", "right"):
            away = found[f"{side}_{angle}"] - truth[f"{side}_{angle}"]
            assert np.sqrt(np.nanmean(away**2)) < most


@pytest.mark.parametrize(
    ("file", "known", "knee"),
    [
        ("btkdata/C3DSamples/c3d.org/sample01/Eb015pr.c3d", "clusters", (20, 75)),
        ("btkdata/C3DSamples/c3d.org/sample02/pc_real.c3d", "clusters", (55, 70)),
        ("btkdata/C3DSamples/c3d.org/sample06/MACsample.c3d", "cleveland-clinic", (55, 70)),
        ("nimble/osim/HamnerSubject04/subject04/trials/run200/markers.trc", "clusters", (75, 95)),
    ],
)
def test_captures_with_clusters_only_become_legs_of_people(mocap, file, known, knee):
    markers = read(mocap / file)
    assert find_landmarks(markers).marker_set == known
    nodes = find_nodes(markers)
    assert nodes.trunk is not None
    angles = clinical_angles(markers)
    for side in ("left", "right"):
        hip, mid, ankle = (nodes.positions[:, NODES.index(f"{side}_{joint}")] for joint in ("hip", "knee", "ankle"))
        for length in (np.linalg.norm(hip - mid, axis=-1), np.linalg.norm(mid - ankle, axis=-1)):
            assert 0.35 < np.nanmedian(length) < 0.5
            assert np.nanstd(length) < 0.01
        assert knee[0] < np.nanmax(angles[f"{side}_knee_flexion"]) < knee[1]
