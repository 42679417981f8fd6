"""Agents of ActiveTracking: how they turn the camera, what they score, and who can play what."""

import gymnasium
import numpy as np
import pytest

import motionenv.envs  # noqa: F401 (registers the environments)
from motionenv.envs.active import Greedy, Oracle, Planner, Still, Sweep
from motionenv.envs.active.planner_kernel import turn_to
from motionenv.envs.active.scene_kernel import ACCELERATIONS, steer_all
from motionenv.envs.agents import Blob, Kalman, MeanPose, TrackingAgent, evaluate, score
from motionenv.errors import MotionError

ID, TASK = "motionenv/ActiveTracking-v1", "motionenv/ActiveTracking-Medium-v1"


@pytest.mark.parametrize("aim", [(1.5, -0.2, 1.0), (-2.5, -0.9, 0.0), (0.02, -0.42, 0.0)], ids=str)
def test_a_turn_takes_the_time_of_full_speed_and_full_brakes_and_ends_at_rest(aim):
    """A turn of θ from rest to rest at acceleration a takes 2 √(θ / a), here in frames of 0.1 s."""
    camera, commands, states = np.array([[0.0, -0.4, 0.0, 0.0, 0.0, 0.0]]), np.zeros((1, 3)), []
    for _ in range(40):
        turn_to(camera, np.array([aim]), 0.1, commands)
        steer_all(np.array([0]), camera, commands, 0.1)
        states.append(camera[0].copy())
    np.testing.assert_allclose(states[-1], [*aim, 0, 0, 0], atol=1e-6)
    pan = np.abs(np.array(states)[:, 0])
    assert pan.max() < abs(aim[0]) + 0.02  # it hardly swings beyond
    arrived = 0.1 * (1 + np.argmax(np.abs(pan - abs(aim[0])) < 0.02))
    assert arrived < 2 * np.sqrt(abs(aim[0]) / ACCELERATIONS[0]) + 0.35


def test_a_sweep_turns_on_step_by_step_and_nods():
    """In a round of the pattern, the camera gets to where a loop over its steps says."""
    env = gymnasium.make_vec(ID, num_envs=2)
    observation, _ = env.reset(seed=0)
    sweep = Sweep(env)
    sweep.step, sweep.seconds, sweep.tilts, sweep.zoom = 0.8, 1.0, (-0.3, -0.6), 0.5
    sweep.reset(observation)
    first, states = observation["camera"][:, 0].astype(float), []
    for _ in range(61):
        observation, *_ = env.step(sweep.act(observation))
        states.append(observation["camera"].astype(float))
    for i, state in enumerate(states[9::10]):  # the end of each second
        off = state[:, 0] - first - 0.8 * i
        np.testing.assert_allclose((off + np.pi) % (2 * np.pi) - np.pi, 0, atol=1e-3)
        np.testing.assert_allclose(state[:, 1:3], np.tile([-0.3 if i % 2 == 0 else -0.6, 0.5], (2, 1)), atol=1e-3)


def test_the_oracle_scores_what_its_spread_costs():
    """σ (√(π/2) - √π / 2): the energy score of a right mean with a standard deviation σ of 5 cm, and no effort."""
    for env in (gymnasium.make(ID, horizon=10), gymnasium.make_vec(ID, num_envs=3, horizon=10)):
        scores = evaluate(env, Oracle(env), episodes=3, seed=0)
        np.testing.assert_allclose(scores.returns / 10, -0.05 * (np.sqrt(np.pi / 2) - np.sqrt(np.pi) / 2), rtol=1e-4)
        np.testing.assert_allclose(scores.errors, 0, atol=1e-5)


@pytest.mark.parametrize("name", ["still", "sweep", "greedy", "planner", "oracle"])
def test_agents_are_scored_by_name_and_the_same_each_time(name):
    runs = [score(TASK, name, 2, split="train")["returns"] for _ in range(2)]
    assert np.isfinite(runs).all()
    assert runs[0] == runs[1]


@pytest.mark.parametrize("agent", [Still, Sweep, Greedy, Planner, Oracle])
def test_single_environments_are_played_too_and_others_refused(agent):
    env = gymnasium.make(ID, people=2, pillars=0, horizon=30)
    assert evaluate(env, agent(env), episodes=1, seed=0).lengths == [30]
    with pytest.raises(MotionError, match="ActiveTracking"):
        agent(gymnasium.make("motionenv/MarkerTracking-v1"))


@pytest.mark.parametrize("agent", [MeanPose, Blob, Kalman, TrackingAgent])
def test_agents_that_follow_one_body_are_refused(agent):
    with pytest.raises(MotionError, match="planner"):
        agent(gymnasium.make_vec(ID, num_envs=2))


@pytest.mark.slow
def test_a_planner_beats_the_best_pattern_and_the_greedy_agent():
    """By a twentieth of the range between a still camera and the truth, in Medium, on 24 episodes of split "train"."""
    returns = {}
    for agent in (Still, Sweep, Greedy, Planner):
        env = gymnasium.make_vec(TASK, num_envs=24)
        returns[agent] = evaluate(env, agent(env), 24, seed=5).returns.mean()
    margin = -0.05 * returns[Still]
    assert returns[Planner] > max(returns[Sweep], returns[Greedy]) + margin
