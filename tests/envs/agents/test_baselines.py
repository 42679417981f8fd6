"""The reference agents in the real environments."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.envs.agents import ConstantVelocity, MeanPose, Oracle, evaluate
from motionenv.envs.agents.baselines import walking_poses
from motionenv.envs.agents.detectors import SeenPoints, walker_at
from motionenv.envs.arm import ArmTrackingVector
from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.envs.walker import WalkerTracking, WalkerTrackingVector
from motionenv.errors import MotionError
from motionenv.render import Raycaster
from motionenv.render.cameras import view

AGENTS = (MeanPose, ConstantVelocity, Oracle)
ENVIRONMENTS = {
    "markers": (MarkerTracking, MarkerTrackingVector, {}),
    "pose from rgb": (WalkerTracking, WalkerTrackingVector, {"size": 36}),
    "joints from depth": (WalkerTracking, WalkerTrackingVector, {"observation": "depth", "estimate": "joints"}),
    "belief from masks": (
        WalkerTracking, WalkerTrackingVector, {"observation": ["mask", "rgb"], "estimate": "belief", "n_belief": 16}
    ),
}  # fmt: skip


ARMS = [{}, {"estimate": "joints"}, {"estimate": "belief", "n_belief": 32}]


@pytest.fixture(params=ENVIRONMENTS.values(), ids=ENVIRONMENTS)
def kind(request):
    return request.param


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


@pytest.mark.parametrize("agent", AGENTS)
def test_single_and_vector_score_the_same(kind, agent):
    single, vector, arguments = kind
    envs = vector(3, horizon=12, **arguments)
    together = evaluate(envs, agent(envs), 3, seed=7)
    env = single(horizon=12, **arguments)
    alone = [evaluate(env, agent(env), 1, seed=7 + i) for i in range(3)]
    tolerance = 5e-3 if agent is Oracle and env.action_space.shape[-1] == 26 else 1e-12  # beliefs are drawn anew
    assert np.allclose(together.errors, [score.errors[0] for score in alone], atol=tolerance)


@pytest.mark.parametrize("agent", AGENTS)
def test_autoreset_modes_score_the_same(agent):
    scores = []
    for mode in ("NextStep", "SameStep", "Disabled"):
        env = MarkerTrackingVector(3, horizon=9, autoreset_mode=mode)
        scores.append(evaluate(env, agent(env), 7, seed=2))
    for other in scores[1:]:
        assert np.allclose(other.errors, scores[0].errors)
        assert np.allclose(other.returns, scores[0].returns)
    assert (scores[0].lengths == 9).all()


def test_episodes_that_end_early_count_once():
    env = MarkerTrackingVector(3, horizon=30, lost_after=0.05)
    scores = evaluate(env, MeanPose(env), 8, seed=0)
    assert len(scores.errors) == 8
    assert (scores.lengths == 10).all()


@pytest.mark.parametrize("arguments", ARMS)
def test_of_an_arm_the_mean_is_said_and_the_truth(arguments):
    env = ArmTrackingVector(2, horizon=10, observation="mask", size=36, **arguments)
    mean, best = evaluate(env, MeanPose(env), 4, seed=0), evaluate(env, Oracle(env), 4, seed=0)
    assert 0.1 < mean.errors.mean() < 0.5
    assert best.errors.mean() < 0.02
    assert (best.returns > mean.returns).all()
    with pytest.raises(MotionError, match="use another agent"):
        ConstantVelocity(env)


def test_points_go_on_at_their_last_velocity():
    look = SeenPoints(np.full((15, 2), 9.0), 2)
    look.forget(np.ones(2, bool))
    velocity = np.array([0.1, -0.2])
    seen = np.ones((2, 15))
    for t in range(12):
        seen[:] = 1
        seen[0, 3] = t in (0, 2, 3)  # gaps before and after
        seen[1, 4] = t == 5
        seen[1, 5] = 0
        points = np.where(seen[..., None] > 0, 1.0 + t * velocity, np.nan)
        got = look.at(np.nan_to_num(points), seen)
        assert np.allclose(got[0], 1.0 + t * velocity) or t == 1  # at t = 1 there is no velocity yet
        assert np.allclose(got[1, 4], 9.0 if t < 5 else 1.0 + 5 * velocity)
        assert np.allclose(got[1, 5], 9.0)


@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.2, np.pi / 2, -2.5])
@pytest.mark.parametrize("x", [-1.0, 0.3])
def test_a_walker_is_found_on_the_line(alpha, x):
    camera = view(alpha, distance=6.0, width=128, height=128)
    pose = walking_poses(1)[0] + np.eye(25)[0] * x
    mask = Raycaster().render(pose, from_height(1.75), camera, rgb=False).limbs > 0
    rows = np.flatnonzero(mask.any(1))
    found = walker_at(camera, mask.sum(0) @ np.arange(128) / mask.sum(), rows[-1] - rows[0] + 1)
    assert abs(found - x) < (0.1 if abs(np.cos(alpha)) > 0.5 else 0.4)


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


@pytest.mark.parametrize("episodes", [0, -1, 1.5, True])
def test_episodes_must_be_a_number_of_them(episodes):
    env = MarkerTracking(horizon=3)
    with pytest.raises(MotionError, match="episodes must be"):
        evaluate(env, MeanPose(env), episodes)


def test_a_negative_spread_is_refused():
    with pytest.raises(MotionError, match="spread must be"):
        Oracle(MarkerTracking(horizon=3), spread=-1.0)
