"""Particles with histories: their draws are the tree's own, and arms leave the rest of the body alone."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.errors import MotionError
from motionenv.models.motion_tree import Clip, MotionTree, build_database
from motionenv.models.motion_tree.features import local
from motionenv.models.registry import load
from motionenv.models.transforms import scaled
from motionenv.tracking import FPCAPrior, Start, TreePrior, VelocityPrior
from motionenv.tracking.priors.tree import TreeState
from motionenv.types import Motion
from tests.tracking.reaching import reaching_tree


@pytest.fixture(scope="module")
def database():
    model = load("walk/fpca")
    walks = [model.synthesize(seconds=5, fps=30, seed=i, height=1.75) for i in range(10)]
    return build_database([Clip(w, f"walk {i}", "walk", str(i)) for i, w in enumerate(walks)])


@pytest.fixture(scope="module")
def tree(database):
    return MotionTree().fit_database(database)


@pytest.fixture(scope="module")
def arm_tree():
    return reaching_tree(clips=60)


@pytest.fixture(scope="module")
def stranger():
    return load("walk/fpca").synthesize(seconds=4, fps=30, seed=99, height=1.75).poses


@pytest.mark.parametrize("method", ["exact", "tree"])
def test_draws_are_the_trees_own(tree, stranger, method):
    histories = np.stack([stranger[t - 12 : t] for t in range(12, 112)])
    told = local(histories[:, :-1], histories[:, 1:])
    state = TreeState(histories[:, -1], told.astype(np.float32), np.zeros((100, 25)), np.zeros(100))
    prior = TreePrior(tree, noise=0.0, method=method, temperature=0.1)
    after = prior.propagate(state, np.random.default_rng(3)).poses
    drawn = tree.sample(histories, seed=3, carry=True, method=method, leaf="kernel", temperature=0.1)
    same = np.abs(after - drawn.poses[:, 0]).max(1) < 1e-4
    assert same.mean() > 0.95  # rounding may bring a neighbour


def test_a_history_goes_on_with_what_was_drawn(tree, stranger):
    prior, rng = TreePrior(tree), np.random.default_rng(0)
    state = prior.initial(Start.at(stranger[30], stranger[29]), 200, rng)
    after = prior.propagate(state, rng)
    np.testing.assert_array_equal(after.history[:, :-1], state.history[:, 1:])
    shaped = [2, 3, 4, *range(6, 25)]
    said = (after.history[:, -1] + after.rest)[:, shaped]
    np.testing.assert_allclose(after.poses[:, shaped], said, atol=1e-6)
    assert (after.rest[:, [0, 1, 5]] == 0).all()


def test_bodies_turn_on_beyond_their_windows_and_go_where_they_head(tree, stranger):
    """The same draws with and without a turning rate: the way turns by the same angle as the body."""
    prior = TreePrior(tree, noise=0.0)
    both = []
    for rate in (0.0, 0.9):
        rng = np.random.default_rng(4)
        state = prior.initial(Start.at(stranger[30], stranger[29]), 50, rng)
        state = replace(state, turn=np.full(50, rate))
        before = state.poses
        for _ in range(15):
            state = prior.propagate(state, rng)
        assert (state.poses[:, :2] != before[:, :2]).all()
        both.append((state.poses[:, 5], np.unwrap(np.arctan2(*(state.poses - before)[:, 1::-1].T))))
    rates = 0.9 * np.exp(-np.arange(1, 16) / 30)
    np.testing.assert_allclose(both[1][0] - both[0][0], rates.sum() / 30, atol=1e-9)
    np.testing.assert_allclose(both[1][1] - both[0][1], 0.5 * rates.sum() / 30, atol=0.03)


def test_those_of_the_database_go_on_as_they_did(tree, database):
    truth = database.motion(4).poses
    prior, rng = TreePrior(tree, noise=0.0, temperature=1e-6, method="exact"), np.random.default_rng(1)
    state = prior.initial(Start.at(truth[40], truth[39], spread=0.0), 100, rng)
    for t in range(41, 56):
        state = prior.propagate(state, rng)
        off = markers(state.poses, database.skeleton) - markers(truth[t], database.skeleton)
    assert np.median(np.linalg.norm(off, axis=-1).mean(1)) < 0.1


def test_a_start_is_where_it_was_told_and_windows_end_like_it(tree, stranger):
    prior, rng = TreePrior(tree), np.random.default_rng(2)
    poses = stranger[[30, 45]].copy()
    poses[1, :2] += [0.0, 9.0]
    start = Start(poses, np.log([1.0, 4.0]), stranger[[29, 44]], np.full(25, 0.01))
    state = prior.initial(start, 1000, rng)
    far = state.poses[:, 1] > 5
    assert far.sum() == 800
    np.testing.assert_allclose(state.poses[far].mean(0), poses[1], atol=0.002)
    assert len(np.unique(state.history[far].round(4), axis=0)) > 10
    turned = Start.at(stranger[30] + 2 * np.pi * (np.arange(25) == 9), spread=0.0)
    assert np.abs(prior.initial(turned, 50, rng).rest).max() < 1.5


def test_noise_is_as_wide_as_said_and_settles(tree, stranger):
    quiet = TreePrior(tree, noise=0.5)
    one = quiet.initial(Start.at(stranger[30], spread=0.0), 2, np.random.default_rng(0)).take(np.zeros(3000, dtype=int))
    after = quiet.propagate(one, np.random.default_rng(1))
    shaped = [2, 3, 4, *range(6, 25)]
    np.testing.assert_allclose(
        after.rest.std(0)[shaped], 0.5 * tree.forecast_.deviation[shaped], rtol=0.06, err_msg="of one step"
    )
    stirred = quiet.diffuse(one, 0.5, np.random.default_rng(2))
    np.testing.assert_allclose(stirred.poses.std(0), 0.25 * tree.forecast_.deviation, rtol=0.06)
    np.testing.assert_array_equal(stirred.history, one.history)


def test_moved_puts_bodies_where_told(tree, stranger):
    prior, rng = TreePrior(tree), np.random.default_rng(4)
    state = prior.initial(Start.at(stranger[30]), 20, rng)
    poses = state.poses + 0.1 * rng.standard_normal((20, 25))
    moved = prior.moved(state, poses)
    np.testing.assert_allclose(moved.poses, poses, atol=1e-12)
    taken = moved.take(np.array([5, 5]))
    np.testing.assert_array_equal(taken.rest, moved.rest[[5, 5]])
    quiet = TreePrior(tree, noise=0.0)
    gone, went = (quiet.propagate(s, np.random.default_rng(5)).poses for s in (moved, state))
    keep = np.exp(-1 / 30)
    np.testing.assert_allclose((gone - went)[:, 6:], keep * (poses - state.poses)[:, 6:], atol=1e-6)


def test_bodies_of_other_sizes_go_on_alike(tree, stranger):
    body = from_height(1.95)
    tall = scaled(Motion(stranger, tree.database_.skeleton, 30.0), 1.95)
    results = []
    for poses, skeleton in ((stranger, None), (tall.poses, tall.skeleton)):
        prior, rng = TreePrior(tree, skeleton=skeleton, noise=0.0), np.random.default_rng(6)
        state = prior.initial(Start.at(poses[30], poses[29], spread=0.0), 20, rng)
        results.append(prior.propagate(state, rng).poses - poses[30])
    factor = body.height / tree.database_.skeleton.height
    assert np.median(np.abs(results[1][:, 0] - factor * results[0][:, 0])) < 0.003


def test_an_arm_moves_as_arms_reach_and_leaves_the_rest_alone(arm_tree):
    prior, rng = TreePrior(arm_tree), np.random.default_rng(7)
    truth = reach(60, 30.0, np.random.default_rng(8))
    pose = np.linspace(0.0, 0.3, 25)
    pose[list(RIGHT_ARM)] = truth[20]
    before = pose.copy()
    before[list(RIGHT_ARM)] = truth[19]
    state = prior.initial(Start.at(pose, before), 300, rng)
    for _ in range(5):
        state = prior.diffuse(prior.propagate(state, rng), 0.3, rng)
    others = [e for e in range(25) if e not in RIGHT_ARM]
    np.testing.assert_array_equal(state.poses[:, others], np.broadcast_to(pose[others], (300, 21)))
    off = np.abs(state.poses[:, RIGHT_ARM] - truth[25]).max(1)
    assert (off < 0.3).mean() > 0.05
    np.testing.assert_array_equal(prior.moved(state, state.poses + 1.0).poses[:, others], state.poses[:, others])


def test_the_seed_says_all(tree, stranger):
    skeleton = tree.database_.skeleton
    for make in (
        lambda: TreePrior(tree),
        lambda: FPCAPrior(skeleton=skeleton),
        lambda: VelocityPrior(skeleton=skeleton),
    ):
        runs = []
        for _ in range(2):
            prior, rng = make(), np.random.default_rng(12)
            state = prior.initial(Start.at(stranger[30]), 40, rng)
            runs.append(prior.diffuse(prior.propagate(state, rng), 0.5, rng).poses)
        np.testing.assert_array_equal(*runs)


def test_bad_arguments_are_told(tree):
    with pytest.raises(MotionError, match="MotionTree"):
        TreePrior("walk/fpca")
    with pytest.raises(MotionError, match="30 frames"):
        TreePrior(tree, fps=25)
    for bad in ({"method": "nearest"}, {"temperature": 0.0}, {"noise": -1.0}):
        with pytest.raises(MotionError, match=next(iter(bad))):
            TreePrior(tree, **bad)
