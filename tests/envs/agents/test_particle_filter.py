"""The agent with a particle filter in the real environments."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from motionenv.body.arm_reaching import RIGHT_ARM
from motionenv.envs.agents import Kalman, MeanPose, TrackingAgent, evaluate, searching, truth_start
from motionenv.envs.arm import ArmTracking
from motionenv.envs.markers import MarkerTracking
from motionenv.envs.walker import WalkerTracking, WalkerTrackingVector
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.tracking import FPCAPrior, Start, TreePrior, VelocityPrior
from motionenv.tracking.initialization import automatic_start

SMALL = {"motion": "walk/fpca", "size": 48, "observation": "mask", "horizon": 15, "start": "line"}


@pytest.mark.parametrize(
    "arguments",
    [{}, {"estimate": "joints"}, {"estimate": "belief", "n_belief": 32}, {"observation": "depth"},
     {"observation": ["rgb", "mask"]}],
)  # fmt: skip
def test_tracks_walkers_better_than_constant_velocity(arguments):
    env = WalkerTracking(**{**SMALL, **arguments})
    ours = evaluate(env, TrackingAgent(env, n=300, start=truth_start, seed=0), 3, seed=1)
    theirs = evaluate(env, Kalman(env), 3, seed=1)
    assert ours.errors.mean() < 0.6 * theirs.errors.mean()
    assert ours.errors.max() < 0.07
    assert ours.returns.mean() > theirs.returns.mean()


def test_same_seed_same_estimates_with_any_number_of_threads():
    env = WalkerTracking(**SMALL)
    errors = [
        evaluate(env, TrackingAgent(env, n=200, start=truth_start, seed=5, threads=threads), 2, seed=3).errors
        for threads in (1, 2)
    ]
    assert errors[0].tobytes() == errors[1].tobytes()


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
def test_plays_vectors_in_every_mode(mode):
    env = WalkerTrackingVector(2, autoreset_mode=AutoresetMode[mode], **SMALL)
    scores = evaluate(env, TrackingAgent(env, n=200, start=truth_start, seed=0), 4, seed=1)
    assert scores.errors.mean() < 0.08


def test_looks_back_on_all_frames_of_each_episode_that_runs():
    env = WalkerTrackingVector(2, **SMALL)
    agent = TrackingAgent(env, n=200, seed=0, keep=True)
    observation, _ = env.reset(seed=3)
    agent.reset(observation)
    for _ in range(6):  # a second look comes after four
        observation, *_ = env.step(agent.act(observation))
    assert [[len(belief.poses) for belief in beliefs] for beliefs in agent.smoothed(30)] == [[30] * 6] * 2
    assert TrackingAgent(env, n=20, seed=0).smoothed() == []


@pytest.mark.parametrize("hidden", [0, 5])
def test_finds_the_start_itself_once_somebody_is_in_the_picture(hidden):
    env = WalkerTracking(**{**SMALL, "horizon": 20 + hidden})
    agent = TrackingAgent(env, n=300, seed=0)
    observation, _ = env.reset(seed=3)
    agent.reset(observation)
    errors = []
    for frame in range(20 + hidden):
        observation, _, _, _, info = env.step(agent.act(observation if frame >= hidden else 0 * observation))
        errors.append(info["error"])
    assert np.mean(errors[hidden + 10 :]) < 0.12
    assert len(agent.beliefs) == 1
    assert not agent.beliefs[0].lost


def test_somebody_behind_a_post_is_not_looked_for_far_beyond_it():
    """A column of him shows, in which somebody four times as far away would fit: so he was found for 36 frames."""
    env = gymnasium.make("motionenv/WalkerTracking-Medium-v1", split="train", disable_env_checker=True)
    agent = TrackingAgent(env, n=300, seed=0)
    observation, _ = env.reset(seed=1008)
    agent.reset(observation)
    for _ in range(12):
        observation, _, _, _, info = env.step(agent.act(observation))
    assert info["error"] < 0.8


def test_whose_start_was_given_is_not_left_for_somebody_far_away():
    env = WalkerTracking(observation="mask", start="anywhere", horizon=40)
    observation, _ = env.reset(seed=3)
    agent = TrackingAgent(env, n=200, start=truth_start, seed=0)
    agent.reset(observation)
    for _ in range(3):
        observation, *_ = env.step(agent.act(observation))
    kept, camera = agent.beliefs[0].mean[:2], env.truth()["camera"]
    middle = round(np.flatnonzero(observation.any(axis=(0, 2))).mean())
    shift = (57 if middle < 32 else 6) - middle
    depth = camera.R[2] @ (np.append(kept, 1.0) - camera.centre)
    assert abs(shift) * depth / camera.K[0, 0] > 3.0  # m
    for _ in range(30):  # he stands behind something, and somebody else is there
        agent.act(np.roll(observation, shift, axis=1))
    assert agent.beliefs[0].lost
    assert np.linalg.norm(agent.beliefs[0].mean[:2] - kept) < 2.5


@pytest.mark.parametrize(("seed", "turned", "nearer"), [(0, 0.0, 0.85), (1, 0.0, 0.85), (1, 0.6, 1.0)])
def test_who_is_followed_wrongly_is_found_again(seed, turned, nearer):
    """A body too near, or heading elsewhere, fits the pictures by half: for good, if nobody looked again."""

    def mistaken(env, slot):
        truth = env.truth()
        pose, centre = truth["pose"].copy(), truth["camera"].centre[:2]
        pose[:2], pose[5] = centre + nearer * (pose[:2] - centre), pose[5] + turned
        return Start.at(pose)

    env = WalkerTracking(**{**SMALL, "size": 64, "horizon": 60, "start": "near"})
    agent = TrackingAgent(env, n=500, start=mistaken, seed=0, keep=True)
    observation, _ = env.reset(seed=seed)
    agent.reset(observation)
    errors = []
    for _ in range(60):
        observation, _, _, _, info = env.step(agent.act(observation))
        errors.append(info["error"])
    assert np.mean(errors[5:18]) > 0.15
    assert np.mean(errors[40:]) < 0.2
    assert len(agent.smoothed(30)[0]) == 60


@pytest.fixture
def searched(monkeypatch):
    """Numbers of pictures of the searches that are made."""
    counts = []

    def counted(*seen, **options):
        counts.append(len(seen[1]))
        return automatic_start(*seen, **options)

    monkeypatch.setattr(searching, "automatic_start", counted)
    return counts


def test_only_who_fits_badly_or_is_lost_is_searched_for(searched):
    env = WalkerTracking(**{**SMALL, "size": 64, "horizon": 60, "start": "near"})
    agent = TrackingAgent(env, n=500, start=truth_start, seed=0)
    observation, _ = env.reset(seed=1)
    agent.reset(observation)
    for _ in range(40):
        observation, *_ = env.step(agent.act(observation))
    assert not searched
    elsewhere = np.roll(observation, 20, axis=1)
    while not searched:
        agent.act(elsewhere)
    assert searched == [1]
    assert not agent.beliefs[0].lost
    assert agent.beliefs[0].recovered


def test_only_pictures_of_nobody_are_left_out_of_the_start(searched):
    env = WalkerTracking(**SMALL)
    env.reset(seed=1)
    agent = TrackingAgent(env, n=100, seed=0)
    nobody, line = np.zeros((2, 48, 48, 1), dtype=np.uint8)
    line[20, 5:40] = 1
    agent.reset(nobody)
    lost = []
    for seen in (nobody, *[line] * 4):
        agent.act(seen)
        lost.append(agent.beliefs[0].lost)
    assert lost[1]
    assert searched == [1, 1, 1, 1, 4, 4]


def test_goes_on_where_the_background_must_be_learned():
    env = WalkerTracking(**{**SMALL, "observation": "rgb", "size": 64})
    agent = TrackingAgent(env, n=300, seed=0)
    observation, _ = env.reset(seed=1)
    agent.reset(observation)
    errors = []
    for _ in range(15):
        observation, _, _, _, info = env.step(agent.act(observation))
        errors.append(info["error"])
    assert max(errors) < 0.3
    assert not agent.beliefs[0].lost


def test_takes_priors_and_likelihoods_of_its_own():
    env = WalkerTracking(**SMALL)
    made = []

    def prior(env, slot):
        made.append(slot)
        return FPCAPrior(skeleton=env.truth()["skeleton"])

    def likelihood(camera, skeleton):
        assert skeleton.height == env.truth()["skeleton"].height
        return SilhouetteLikelihood(camera, skeleton, effective=12, threads=1)

    agent = TrackingAgent(env, prior, 300, likelihood=likelihood, start=truth_start, layers=2, seed=0)
    assert evaluate(env, agent, 2, seed=1).errors.max() < 0.06
    assert made == [0, 0]


def test_follows_an_arm():
    env = ArmTracking(size=48, observation="depth", horizon=15)
    agent = TrackingAgent(env, VelocityPrior(part="right_arm"), 500, start=truth_start, seed=0)
    ours, still = evaluate(env, agent, 4, seed=1), evaluate(env, MeanPose(env), 4, seed=1)
    assert ours.errors.mean() < 0.6 * still.errors.mean()
    poses = agent.beliefs[0].poses
    moving = np.flatnonzero(np.ptp(poses, axis=0) > 1e-9)
    assert set(RIGHT_ARM) <= set(moving.tolist()) <= set(RIGHT_ARM) | set(range(6))


def test_refuses_what_it_cannot_play():
    for env in (MarkerTracking(), WalkerTracking(observation="joints")):
        with pytest.raises(MotionError, match="use WalkerTracking or ArmTracking"):
            TrackingAgent(env)
    with pytest.raises(MotionError, match="start"):
        TrackingAgent(ArmTracking())
    with pytest.raises(MotionError, match="begun"):
        TrackingAgent(WalkerTracking(**SMALL)).act(np.zeros((48, 48, 1), np.uint8))
    with pytest.raises(MotionError, match="prior"):
        TrackingAgent(ArmTracking(), start=truth_start)
    with pytest.raises(MotionError, match="60 fps"):
        TrackingAgent(WalkerTracking(**SMALL), FPCAPrior(fps=60), start=truth_start).reset(None)
    with pytest.raises(MotionError, match="layers"):
        TrackingAgent(WalkerTracking(**SMALL), layers=0, start=truth_start)


@pytest.mark.parametrize("make", [FPCAPrior, TreePrior, VelocityPrior], ids=["fpca", "tree", "velocity"])
def test_every_prior_tracks(make):
    env = WalkerTracking(**{**SMALL, "horizon": 5})
    agent = TrackingAgent(env, make(), 300, start=truth_start, layers=2, seed=0)
    assert evaluate(env, agent, 1, seed=1).errors.max() < 0.1
