"""Trees in real filters: a person and an arm of whom the database has nothing, from silhouettes."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.envs.agents import MeanPose, TrackingAgent, evaluate, truth_start
from motionenv.envs.arm import ArmTracking
from motionenv.envs.walker import WalkerTracking
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.motion_tree import Clip, MotionTree, build_database
from motionenv.models.registry import load
from motionenv.tracking import FPCAPrior, ParticleFilter, TreePrior, VelocityPrior
from tests.tracking.reaching import reaching_tree


@pytest.fixture(scope="module")
def arm_tree():
    return reaching_tree(clips=150)


@pytest.fixture(scope="module")
def tree_file(tmp_path_factory):
    model = load("walk/fpca")
    walks = [model.synthesize(seconds=5, fps=30, seed=i, height=1.75) for i in range(100, 140)]
    path = tmp_path_factory.mktemp("tree") / "walks.npz"
    MotionTree().fit_database(build_database([Clip(w, f"walk {i}", "walk", str(i)) for i, w in enumerate(walks)])).save(
        path
    )
    return str(path)


def test_a_tree_from_a_file_follows_a_person_for_thirty_frames(tree_file):
    env = WalkerTracking(
        motion="walk/fpca", start="line", actions="metric", size=64, observation="mask", horizon=31, camera="side"
    )
    observation, _ = env.reset(seed=2)
    body = env.truth()["skeleton"]
    likelihood = SilhouetteLikelihood(env.truth()["camera"], body, still=True)
    tracker = ParticleFilter(TreePrior(tree_file, skeleton=body), likelihood, 1000, seed=0)
    tracker.start(truth_start(env.unwrapped, 0))
    first, errors, beliefs = env.truth()["joints"], [], []
    for _ in range(30):
        beliefs.append(tracker.step(mask=observation[..., 0]))
        errors.append(np.linalg.norm(beliefs[-1].expected_joints(body) - env.truth()["joints"], axis=-1).mean())
        last = env.truth()["joints"]
        observation, *_ = env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    assert np.linalg.norm(last - first, axis=-1).mean() > 0.6  # there is something to follow
    assert np.mean(errors) < 0.06
    assert max(errors) < 0.12
    assert not any(b.lost for b in beliefs)
    assert all(1 <= b.effective <= 1000 and np.isfinite(b.log_evidence) for b in beliefs)
    weights = np.exp(beliefs[-1].log_weights)
    spread = markers(beliefs[-1].poses, body).std(axis=0)
    assert weights.sum() == pytest.approx(1.0)
    assert 0.003 < np.linalg.norm(spread, axis=-1).mean() < 0.3


def test_a_tree_of_reaching_arms_follows_an_arm(arm_tree):
    env = ArmTracking(actions="metric", size=64, observation="mask", horizon=30)
    ours = evaluate(env, TrackingAgent(env, TreePrior(arm_tree), 300, start=truth_start, seed=0), 5, seed=1)
    still = evaluate(env, MeanPose(env), 5, seed=1)
    assert np.median(ours.errors) < 0.45 * np.median(still.errors)  # with an average body, whoever it is
    assert np.median(ours.errors) < 0.1


@pytest.mark.parametrize("make", [FPCAPrior, VelocityPrior, lambda: VelocityPrior(part="left_arm")])
def test_priors_that_move_more_than_the_arm_are_refused_for_arms(make):
    env = ArmTracking(actions="metric", size=36, horizon=5)
    agent = TrackingAgent(env, make(), 10, start=truth_start, seed=0)
    observation, _ = env.reset(seed=0)
    with pytest.raises(MotionError, match="only the right arm"):
        agent.reset(observation)
