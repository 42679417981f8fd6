"""Walkers in place and the markers that a camera sees of them, against geometry."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.body.fitting import fit_skeleton
from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.models.eigenwalkers.fourier_series import NECK_ABOVE
from motionenv.render.cameras import orthographic
from motionenv.types import MARKERS
from tests.envs.playing import CLEAR, episode

PELVIS = MARKERS.index("pelvis")


SHOULDERS = [MARKERS.index("left_shoulder"), MARKERS.index("right_shoulder")]


def test_without_noise_points_are_the_truth_less_its_depth():
    for settings in ({}, {"motion": "walk/fpca", "horizon": 20}):
        observed, truths, _ = episode(MarkerTracking(**CLEAR, **settings))
        for seen, truth in zip(observed, truths, strict=True):
            np.testing.assert_allclose(seen["points"], orthographic(truth["joints"], 0.0), atol=1e-6)


def test_the_view_angle_is_that_of_the_paper():
    """At 0 the walker faces +x, at 90 degrees the camera: knees bend backwards, so ankles trail the knees."""
    for degrees, ahead in ((0, (1, 0)), (90, (0, -1))):
        truths = episode(MarkerTracking(view=degrees, **CLEAR))[1]
        assert truths[0]["alpha"] == pytest.approx(np.radians(degrees))
        joints = np.array([truth["joints"] for truth in truths])
        shanks = joints[:, [MARKERS.index("left_knee"), MARKERS.index("right_knee")]].mean((0, 1))
        shanks -= joints[:, [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")]].mean((0, 1))
        assert shanks[:2] @ ahead > 0.05
        across = (joints[:, MARKERS.index("left_hip")] - joints[:, MARKERS.index("right_hip")]).mean(0)
        assert across[:2] @ (-ahead[1], ahead[0]) > 0.1


@pytest.mark.parametrize("motion", ["walk/eigenwalkers", "walk/fpca"])
def test_walkers_stay_in_place(motion):
    for seed in range(3):
        truths = episode(MarkerTracking(motion=motion, horizon=90), seed)[1]
        pelvis = np.array([truth["joints"][PELVIS] for truth in truths])
        assert np.linalg.norm(pelvis[:, :2], axis=-1).max() < 0.3
        assert 0.6 < pelvis[:, 2].mean() < 1.2


def test_heights_and_speeds_are_those_asked_for():
    envs = MarkerTrackingVector(60, height=(1.9, 1.9), speed=(1.0, 1.0), horizon=300, fps=100.0, view=0, **CLEAR)
    envs.reset(seed=0)
    tracks = []
    for _ in range(300):
        tracks.append(envs.world._view.joints.copy())
        envs.step(np.zeros((60, 15, 3), np.float32))
    tracks = np.array(tracks)
    middle, pelvis = tracks[:, :, SHOULDERS].mean(axis=2, keepdims=True), tracks[:, :, [MARKERS.index("pelvis")]]
    nodes = np.concatenate([tracks, pelvis + NECK_ABOVE * (middle - pelvis)], axis=2)
    assert [fit_skeleton(nodes[:, i]).height for i in range(60)] == pytest.approx([1.9] * 60, rel=0.01)
    ankles = tracks[:, :, [MARKERS.index("left_ankle"), MARKERS.index("right_ankle")], 0]
    back = -np.gradient(ankles, 0.01, axis=0).min(axis=-1)
    assert back.mean() == pytest.approx(1.0 / 1.086, rel=0.03)  # the body gains on ankles while feet roll


def test_train_and_eval_share_no_walker():
    splits = [MarkerTrackingVector(2, split=split).world._motion._walkers for split in ("train", "eval")]
    rows = {w.tobytes() for split in splits for w in split.coefficients}
    assert len(rows) == sum(len(split.coefficients) for split in splits)


@pytest.mark.parametrize("distance", [None, 4.0])
def test_the_likelihood_knows_the_truth_when_it_sees_it(distance):
    """Bodies that stand: the one that was seen is the most likely, others the less the more they are turned."""
    env = MarkerTracking(distance=distance)
    env.reset(seed=1)
    poses = np.zeros((5, 25))
    poses[:, 2] = 0.93
    poses[:, 5] = np.radians([0, 5, 10, 20, 40])
    points = orthographic(markers(poses[0], from_height()), 0.0)
    if distance is not None:
        depth = markers(poses[0], from_height())[:, 1]
        points = (points - [0, 0.95]) * (distance / (distance + depth))[:, None] + [0, 0.95]
    env.world._view.points[0], env.world._view.seen[0] = points, 1
    likely = env.observation_model.log_likelihood(poses)
    assert (np.diff(likely) < 0).all()


def test_captured_people_walk_in_place_too(mocap):
    env = MarkerTracking(
        motion=str(mocap / "cmu_asfamc" / "07" / "07_01.amc"), file_fps=120, horizon=60, view=0, **CLEAR
    )
    joints = np.array([truth["joints"] for truth in episode(env)[1]])
    assert np.isfinite(joints).all()
    assert np.linalg.norm(joints[:, PELVIS, :2], axis=-1).max() < 0.3
    hips = joints[:, MARKERS.index("left_hip")] - joints[:, MARKERS.index("right_hip")]
    assert (hips[:, 1] > 0.05).all()  # facing +x, the left is away from the camera
