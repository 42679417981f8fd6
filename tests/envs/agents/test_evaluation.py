"""Episodes are counted and scored alike in single and vector environments, in every mode."""

import numpy as np
import pytest

from motionenv.envs.agents import ConstantVelocity, MeanPose, Oracle, evaluate
from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.errors import MotionError

AGENTS = (MeanPose, ConstantVelocity, Oracle)


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


def test_episodes_are_as_many_as_asked_and_whole():
    env = MarkerTrackingVector(3, horizon=30, lost_after=0.05)
    scores = evaluate(env, MeanPose(env), 8, seed=0)
    assert len(scores.errors) == 8
    assert (scores.lengths == 30).all()


@pytest.mark.parametrize("episodes", [0, -1, 1.5, True])
def test_episodes_must_be_a_number_of_them(episodes):
    env = MarkerTracking(horizon=3)
    with pytest.raises(MotionError, match="episodes must be"):
        evaluate(env, MeanPose(env), episodes)


class Shifted:
    """The truth, moved by so many metres more in each frame of an episode."""

    def __init__(self, env, step: float):
        self.env, self.step = env, step

    def reset(self, observation, began=None) -> None:
        self.frame = 0

    def act(self, observation) -> np.ndarray:
        self.frame += 1
        return self.env.action(self.env.truth()["joints"] + [0, self.step * self.frame, 0])


def test_errors_are_means_and_returns_are_sums_over_an_episode():
    env = MarkerTracking(horizon=4)
    scores = evaluate(env, Shifted(env, 0.1), 3, seed=0)
    np.testing.assert_allclose(scores.errors, (0.1 + 0.2 + 0.3 + 0.4) / 4, atol=1e-6)
    np.testing.assert_allclose(scores.returns, -(0.1 + 0.2 + 0.3 + 0.4), atol=1e-6)
    assert scores.lengths.tolist() == [4, 4, 4]
