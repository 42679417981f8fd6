"""Retargeting real capture: the same walk from three formats, the body where the joints were, gaps as gaps."""

import numpy as np
import pytest

from motionenv import body
from motionenv.errors import MotionError
from motionenv.mocap import read, write
from motionenv.mocap.retargeting import find_nodes, retarget, to_markers
from motionenv.models.synthesis import synthesize
from motionenv.types import MARKERS, POSE, Markers


def distances(motion, markers):
    """Distance (frames, 16) [m] of the fitted body's nodes from the captured ones."""
    return np.linalg.norm(body.forward(motion.poses, motion.skeleton)[0] - find_nodes(markers).positions, axis=-1)


@pytest.fixture(scope="module")
def amc(mocap):
    return read(mocap / "cmu_asfamc/02/02_01.amc", fps=120)


@pytest.fixture(scope="module")
def c3d(mocap):
    return read(mocap / "cmu_c3d/02_01.c3d")


def test_amc_and_c3d_are_the_same_walk(amc, c3d):
    """Markers sit on the skin: within 6 cm rms over the 15 markers, in the same world."""
    apart = to_markers(amc).positions - to_markers(c3d).positions
    assert np.sqrt(np.nanmean((apart**2).sum(-1))) < 0.045
    a, c = retarget(amc), retarget(c3d)
    assert a.skeleton.height == pytest.approx(c.skeleton.height, rel=0.02)
    for name in ("left_hip_flexion", "right_hip_flexion", "left_elbow_flexion", "left_shoulder_flexion"):
        i = POSE.index(name)
        assert np.corrcoef(a.poses[:, i], c.poses[:, i])[0, 1] > 0.98


def rms(apart):
    return np.sqrt(np.nanmean((apart**2).sum(-1)))


def test_amc_and_bvh_twins_have_the_same_markers(mocap):
    """Trial 01_01: within 1 cm rms; the BVH starts with a rest pose and lost the thorax's length (1.3 cm remain)."""
    amc = to_markers(read(mocap / "fairmotion_tests/01_01.amc", fps=120)).positions
    bvh = to_markers(read(mocap / "fairmotion_tests/01_01.bvh", unit="cmu")).positions
    assert rms(amc - bvh[1:]) < 0.01


def test_amc_and_bvh_of_02_01_are_one_walk_on_two_skeletons(mocap, amc):
    """The BVH of 02_01 sits on the skeleton of subject 01, with its own unit: 4.1 cm rms, and the angles agree."""
    bvh = read(mocap / "cmu_bvh_misc/02_01.bvh", unit=0.0254 / 0.45 * 0.94063)
    assert rms(to_markers(amc).positions - to_markers(bvh).positions) < 0.042
    a, b = retarget(amc), retarget(bvh)
    assert b.fps == pytest.approx(a.fps, rel=1e-3)
    for name in POSE[3:6] + tuple(n for n in POSE if "flexion" in n or "shoulder_abduction" in n):
        i = POSE.index(name)
        assert np.corrcoef(a.poses[:, i], b.poses[:, i])[0, 1] > 0.89, name
        assert np.degrees((a.poses[:, i] - b.poses[:, i]).std()) < 3.5, name


@pytest.mark.slow
def test_the_body_lies_within_20_mm_of_the_joints_on_all_cmu_walks(mocap):
    medians = []
    for path in sorted((mocap / "cmu_asfamc").glob("*/*.amc")):
        markers = read(path, fps=120)
        medians.append(np.median(distances(retarget(markers), markers)[:, :15]))
    assert len(medians) == 59
    assert max(medians) < 0.006  # the goal is 0.020


def test_walkers_bend_their_knees_and_elbows_the_right_way(amc):
    motion = retarget(amc)
    hinges = [i for i, n in enumerate(POSE) if "knee" in n or "elbow" in n]
    assert motion.poses[:, hinges].min() > np.radians(-3)
    assert np.abs(np.diff(motion.poses, axis=0)).max() < 0.2


@pytest.mark.parametrize("content", ["walk_normal_001", "dash_active_001", "bow_normal_001"])
def test_bandai_namco(mocap, content):
    path = next((mocap / "bandai_namco").glob(f"*/data/dataset-1_{content}.bvh"))
    markers = read(path, unit="cm")
    motion = retarget(markers)
    assert np.median(distances(motion, markers)) < 0.02
    assert 1.3 < motion.skeleton.height < 2.0


def test_plug_in_gait_keeps_its_gaps(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-Hole.c3d")
    holed = markers.positions.copy()
    holed[40:60, markers.index("LANK")] = np.nan
    motion = retarget(Markers(markers.names, holed, markers.fps))
    knee, hip = POSE.index("left_knee_flexion"), POSE.index("left_hip_flexion")
    assert np.isnan(motion.poses[40:60, knee]).all()
    assert np.isfinite(motion.poses[40:60, hip]).all()
    assert np.nanmedian(distances(motion, markers)) < 0.02


def test_mixamo_names_with_and_without_prefix():
    skeleton = body.from_height(1.7)
    poses = np.random.default_rng(0).normal(0, 0.2, (30, 25)) + np.eye(25)[20] * 0.6
    nodes = dict(zip(body.NODES, np.moveaxis(body.forward(poses, skeleton)[0], 1, 0), strict=True))
    joints = {"Neck": nodes["neck"], "Head": (nodes["neck"] + nodes["head"]) / 2, "Spine2": nodes["sternum"]}
    for side in ("left", "right"):
        for joint, name in zip(
            ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"),
            ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot"),
            strict=True,
        ):
            joints[side.title() + name] = nodes[f"{side}_{joint}"]
    for prefix in ("", "mixamorig:"):
        markers = Markers([prefix + n for n in joints], np.stack(list(joints.values()), 1), 30)
        found = to_markers(markers).positions
        assert np.allclose(found, np.stack([nodes[m] for m in MARKERS], 1), atol=1e-9)


def test_unknown_names_and_sets_are_named():
    points = Markers(["LeftArm", "nonsense"], np.zeros((3, 2, 3)), 30)
    with pytest.raises(MotionError, match=r"no leg with hip and knee: the nearest marker set is 'mixamo'.*left_hip"):
        retarget(points)
    with pytest.raises(MotionError, match=r"the marker set must be one of anatomical, .*, got 'vicon'"):
        retarget(points, marker_map="vicon")


def test_our_own_markers_come_back_from_the_c3d_that_we_write(tmp_path):
    motion = synthesize("walk/fpca", 1, 30, seed=3)
    write(motion, tmp_path / "walk.c3d")
    points = to_markers(read(tmp_path / "walk.c3d"))
    np.testing.assert_allclose(points.positions, body.markers(motion.poses, motion.skeleton), atol=1e-4)
    again = retarget(points)
    assert np.abs(body.markers(again.poses, again.skeleton) - points.positions).max() < 0.02


def test_a_motion_that_was_read_is_already_on_the_body(tmp_path):
    """An .npz holds a motion: `retarget(read(...))` returns it, or scales it to a skeleton of the same proportions."""
    write(synthesize("walk/fpca", 1, 30, seed=2), tmp_path / "walk.npz")
    motion = read(tmp_path / "walk.npz")
    np.testing.assert_array_equal(retarget(motion).poses, motion.poses)
    small = retarget(motion, skeleton=body.from_height(1.5))
    tall = retarget(small, skeleton=body.from_height(2.0))
    nodes, taller = (body.forward(m.poses, m.skeleton)[0] for m in (small, tall))
    np.testing.assert_allclose(taller, nodes * 4 / 3, atol=1e-9)
    with pytest.raises(MotionError, match="omit marker_map"):
        retarget(motion, marker_map="plug-in-gait")
    with pytest.raises(MotionError, match=r"as read\(\) returns, got str"):
        retarget("walk.npz")
