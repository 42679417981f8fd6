"""The reference agents in the real environments."""

import numpy as np
import pytest

from motionenv.envs.agents import ConstantVelocity, MeanPose, Oracle, evaluate
from motionenv.envs.agents.baselines import walking_poses
from motionenv.envs.arm import ArmTrackingVector
from motionenv.envs.markers import MarkerTracking
from motionenv.envs.walker import WalkerTrackingVector
from motionenv.errors import MotionError

AGENTS = (MeanPose, ConstantVelocity, Oracle)


ARMS = [{}, {"estimate": "joints"}, {"estimate": "belief", "n_belief": 32}]


def test_looking_helps_and_nothing_beats_the_truth(kind):
    _, vector, arguments = kind
    env = vector(4, horizon=40, **arguments)
    scores = [evaluate(env, agent(env), 8, seed=5) for agent in AGENTS]
    errors = [score.errors.mean() for score in scores]
    assert errors[0] > errors[1] > errors[2]
    returns = [score.returns.mean() for score in scores]
    assert returns[0] < returns[1] < returns[2]
    assert errors[2] < 0.02
    assert all((score.lengths == 40).all() and len(score.errors) == 8 for score in scores)


@pytest.mark.parametrize("arguments", ARMS)
def test_of_an_arm_the_mean_is_said_and_the_truth(arguments):
    env = ArmTrackingVector(2, horizon=10, observation="mask", size=36, **arguments)
    mean, best = evaluate(env, MeanPose(env), 4, seed=0), evaluate(env, Oracle(env), 4, seed=0)
    assert 0.1 < mean.errors.mean() < 0.5
    assert best.errors.mean() < 0.02
    assert (best.returns > mean.returns).all()
    with pytest.raises(MotionError, match="use another agent"):
        ConstantVelocity(env)


def test_the_mean_pose_stands_upright_and_its_limbs_are_in_the_middle():
    pose = walking_poses(1)[0]
    many = walking_poses(200)
    assert np.array_equal(pose[:2], [0, 0])
    assert 0.85 < pose[2] < 1.0
    assert np.abs(pose[6:] - many[:, 6:].mean(0)).max() < 0.1
    assert np.array_equal(many, walking_poses(200))


def test_a_belief_spread_as_the_truth_scores_worse_than_certainty_alone():
    """The oracle with spread 0 has the best score there is: 0."""
    env = WalkerTrackingVector(2, horizon=5, observation="mask", size=36, estimate="belief", n_belief=8)
    certain = evaluate(env, Oracle(env, spread=0.0), 2, seed=1)
    spread = evaluate(env, Oracle(env, spread=0.05), 2, seed=1)
    assert np.allclose(certain.returns, 0.0, atol=1e-4)
    assert (spread.returns < certain.returns).all()


def test_a_negative_spread_is_refused():
    with pytest.raises(MotionError, match="spread must be"):
        Oracle(MarkerTracking(horizon=3), spread=-1.0)
