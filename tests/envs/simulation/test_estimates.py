"""Estimates in every form are scored by their distance from the truth."""

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.simulation.estimates import Estimates
from motionenv.metrics import energy_score, mpjpe
from tests.envs.playing import begun


def test_joints_are_scored_by_distance():
    env, _ = begun(estimate="joints", seed=2)
    for shift in ([0.0, 0.0, 0.0], [0.3, 0.0, -0.4], [0.0, 0.1, 0.0]):
        joints = env.truth()["joints"] + shift
        expected = mpjpe(joints, env.truth()["joints"])
        _, reward, _, _, info = env.step(joints)
        assert info["error"] == pytest.approx(expected)
        assert info["error"] == pytest.approx(np.linalg.norm(shift))
        assert reward == -info["error"]


def test_poses_are_put_on_the_true_body():
    env, _ = begun(seed=2)
    truth = env.truth()
    pose = truth["pose"] + np.random.default_rng(0).normal(0, 0.1, 25)
    expected = mpjpe(markers(pose, truth["skeleton"]), truth["joints"])
    _, reward, _, _, info = env.step(pose)
    assert info["error"] == pytest.approx(expected)
    assert reward == -info["error"]


def test_beliefs_are_scored_properly():
    env, _ = begun(estimate="belief", n_belief=40, seed=2)
    rng = np.random.default_rng(0)
    truth = env.truth()
    poses = truth["pose"] + rng.normal(0, 0.1, (40, 25))
    weights = rng.normal(0, 1, 40)
    joints = markers(poses, truth["skeleton"])
    score = energy_score(joints[None], weights[None], truth["joints"][None])[0]
    mean = np.average(joints, axis=0, weights=np.exp(weights))
    _, reward, _, _, info = env.step(np.column_stack([poses, weights]))
    assert reward == pytest.approx(-score / np.sqrt(15))
    assert info["error"] == pytest.approx(mpjpe(mean, truth["joints"]))
    truth = env.truth()  # a belief that is sure of itself and right is as good as can be
    _, reward, *_ = env.step(np.tile([*truth["pose"], 0.0], (40, 1)))
    assert reward == pytest.approx(0.0, abs=1e-6)


BODY = from_height(1.8)
TRUE = np.random.default_rng(1).normal(0, 0.3, (3, 25))
OFFSETS = np.tile(BODY.offsets, (3, 1, 1))


def test_only_what_is_scored_counts():
    """Elbow and wrist are 0.3 m and 0.5 m off; every other joint is the truth's own."""
    part = Estimates("joints", entries=RIGHT_ARM, joints=(6, 8))
    joints = markers(TRUE, BODY)
    said = joints[:, [6, 8]] + [[0.3, 0, 0], [0, 0.3, 0.4]]
    error, reward = part.judge(said, TRUE, OFFSETS)
    np.testing.assert_allclose(error, 0.4)
    np.testing.assert_array_equal(reward, -error)
    points = part.points(said, TRUE, OFFSETS)
    np.testing.assert_allclose(points[:, [6, 8]], said)
    np.testing.assert_allclose(np.delete(points, [6, 8], 1), np.delete(joints, [6, 8], 1))


def test_the_points_of_a_belief_are_its_weighted_mean():
    belief = Estimates("belief", n_belief=2)
    poses = np.stack([TRUE, TRUE + np.eye(25)[0]], axis=1)  # the other is a metre ahead, and three times as likely
    said = np.concatenate([poses, np.tile(np.log([[1.0], [3.0]]), (3, 1, 1))], axis=-1)
    np.testing.assert_allclose(
        belief.points(said, TRUE, OFFSETS), markers(TRUE, BODY) + 0.75 * np.eye(3)[0], atol=1e-12
    )
    error, reward = belief.judge(said, TRUE, OFFSETS)
    np.testing.assert_allclose(error, 0.75)
    # Energy score of two points, √15 apart as all joints are: 0.75 · √15 less half of 2 · 0.25 · 0.75 · √15.
    np.testing.assert_allclose(reward, -(0.75 - 0.1875))


@pytest.mark.parametrize(("form", "n"), [("pose", 1), ("joints", 1), ("belief", 7)])
def test_threads_share_the_work_and_change_nothing(form, n):
    alone, shared = (Estimates(form, n, threads=threads) for threads in (1, 3))
    rng = np.random.default_rng(0)
    actions = rng.normal(0, 0.3, (3, *alone.scale.space.shape))
    for one, other in zip(alone.judge(actions, TRUE, OFFSETS), shared.judge(actions, TRUE, OFFSETS), strict=True):
        np.testing.assert_array_equal(one, other)
    shared.close()
