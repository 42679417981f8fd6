"""Episodes are counted and scored alike in single and vector environments, in every mode."""

import json

import gymnasium
import numpy as np
import pytest

from motionenv.envs.agents import Blob, Kalman, MeanPose, Oracle, evaluate, score
from motionenv.envs.agents.evaluation import AGENTS, FIRST_SEED, agent_of, interval
from motionenv.envs.markers import MarkerTracking, MarkerTrackingVector
from motionenv.envs.tasks import TASKS, settings
from motionenv.errors import ExtrapolationWarning, MotionError

BASELINES = (MeanPose, Kalman, Oracle)


@pytest.mark.parametrize("agent", BASELINES)
def test_single_and_vector_score_the_same(kind, agent):
    single, vector, arguments = kind
    envs = vector(3, horizon=12, **arguments)
    together = evaluate(envs, agent(envs), 3, seed=7)
    env = single(horizon=12, **arguments)
    alone = [evaluate(env, agent(env), 1, seed=7 + i) for i in range(3)]
    tolerance = 5e-3 if agent is Oracle and env.action_space.shape[-1] == 26 else 1e-12  # beliefs are drawn anew
    assert np.allclose(together.errors, [score.errors[0] for score in alone], atol=tolerance)


@pytest.mark.parametrize("agent", BASELINES)
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


MARKERS = "motionenv/MarkerTracking-Medium-v1"


def test_episodes_have_the_seeds_that_the_report_says():
    report = json.loads(json.dumps(score(MARKERS, "blob", 18)))
    assert report["seeds"] == list(range(FIRST_SEED, FIRST_SEED + 18))
    env = gymnasium.make(MARKERS, split="eval")
    for i in (0, 15, 16, 17):
        alone = evaluate(env, Blob(env), 1, seed=report["seeds"][i])
        assert alone.errors[0] == pytest.approx(report["errors"][i], abs=1e-12)
        assert alone.returns[0] == pytest.approx(report["returns"][i], abs=1e-9)
    assert report["mean_error"] == pytest.approx(np.mean(report["errors"]))
    assert report["error_interval"][0] < report["mean_error"] < report["error_interval"][1]
    assert report["settings"] == {**TASKS[MARKERS].settings, "split": "eval"}
    assert report["agent"] == "blob"
    assert {"motionenv", "gymnasium", "numpy", "python"} <= set(report["versions"])


def test_more_episodes_begin_with_the_same_ones():
    few, many = (score(MARKERS, Blob, n)["errors"] for n in (3, 20))
    assert few == pytest.approx(many[:3], abs=1e-12)


def test_other_people_are_another_split():
    usual, other = score(MARKERS, Blob, 2), score(MARKERS, Blob, 2, split="ood")
    assert other["settings"]["motion"] == "walk/fpca"
    assert other["errors"] != usual["errors"]
    assert other["seeds"] == usual["seeds"]


@pytest.mark.filterwarnings("error")
def test_people_who_are_out_of_distribution_on_purpose_warn_nobody():
    task = "motionenv/WalkerTracking-Easy-v1"
    env = gymnasium.make_vec(task, num_envs=4, **settings(task, "ood"))
    with pytest.warns(ExtrapolationWarning, match="beyond"):
        env.reset(seed=FIRST_SEED)
    score(task, "mean-pose", 4, split="ood")


def test_the_interval_is_that_of_a_mean():
    """Of many normal values, 1.96 standard errors on either side."""
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    error = 1.96 * values.std() / 20
    np.testing.assert_allclose(interval(values), [values.mean() - error, values.mean() + error], atol=0.06)


class Halfway(MeanPose):
    """In the middle between the mean pose and the truth, half as wrong as the mean pose in every frame."""

    def act(self, observation) -> np.ndarray:
        env = self._actions.env
        scored = slice(None) if env.single_action_space.shape[0] == 15 else [6, 8]
        truth = np.stack([truth["joints"] for truth in env.truth()])[:, scored]
        return env.action((env.estimate(super().act(observation)) + truth) / 2)


@pytest.mark.parametrize("task", [MARKERS, "motionenv/ArmTracking-Medium-v2"])
@pytest.mark.parametrize("split", ["eval", "ood"])
def test_returns_are_normalised_between_the_mean_pose_and_the_oracle(task, split):
    for agent, expected in (("mean-pose", 0.0), (Halfway, 0.5), ("oracle", 1.0)):
        report = score(task, agent, 5, split=split)
        assert report["normalised_return"] == pytest.approx(expected, abs=1e-5)
        np.testing.assert_allclose(report["normalised_interval"], expected, atol=1e-5)
        assert report["mean_return"] == pytest.approx(np.mean(report["returns"]))
    assert report["return_interval"] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_the_normalised_interval_follows_the_episodes():
    values, ones = np.random.default_rng(2).normal(-3.0, 1.0, 300), np.ones(300)
    low, high = interval(values)
    np.testing.assert_allclose(interval(values, -5 * ones, 0 * ones), [(low + 5) / 5, (high + 5) / 5])


def test_agents_are_named_or_made_by_a_factory():
    assert agent_of("blob") is AGENTS["blob"] is Blob
    assert agent_of("kalman") is Kalman
    assert agent_of("motionenv.envs.agents:Blob") is Blob
    for name in ("blub", "motionenv.nowhere:Agent", "motionenv.envs.agents:Nobody", ":", ""):
        with pytest.raises(MotionError, match="agent must be one of mean-pose, .* or module:factory"):
            agent_of(name)


@pytest.mark.parametrize("episodes", [0, 1.5])
def test_a_number_of_episodes_that_is_none_is_refused(episodes):
    with pytest.raises(MotionError, match="episodes must be"):
        score(MARKERS, Blob, episodes)
