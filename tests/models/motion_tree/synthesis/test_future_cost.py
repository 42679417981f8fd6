"""The outlook of windows against brute force: Bellman's equation, exits, and what comes in the next second."""

import numpy as np
import pytest

import motionenv
from motionenv.body.kinematics import feet
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.motion_tree.synthesis.future_cost import fit_future_cost


@pytest.fixture(scope="module")
def tree():
    """Three slow and three brisk walks of a shipped model."""
    model = motionenv.load("walk/fpca")
    made = [model.synthesize(6, 30, seed=i, speed=0.8 + 0.2 * i, height=1.75) for i in range(6)]
    clips = [Clip(walk, str(i), "slow" if i < 3 else "brisk") for i, walk in enumerate(made)]
    return MotionTree().fit_database(build_database(clips))


@pytest.fixture(scope="module")
def outlook(tree):
    return fit_future_cost(tree.database_, tree.frames_, tree.index_.blocks)


def test_exits_are_the_nearest_windows_elsewhere(tree, outlook):
    where = tree.index_.coefficients(np.arange(len(tree.frames_))).astype(float)
    tails, exits, distances = outlook.exits
    for t in range(0, len(tails), 17):
        apart = np.abs(tree.frames_.astype(int) - tree.frames_[tails[t]]) > 15
        square = np.where(apart, ((where - where[tails[t]]) ** 2).sum(1), np.inf)
        assert distances[t, 0] == pytest.approx(square.min(), rel=1e-3)
        assert exits[t, 0] == square.argmin()
        assert (np.diff(distances[t]) >= 0).all()


@pytest.mark.parametrize(("activity", "discount"), [(-1, 0.97), (0, 0.99)])
def test_future_cost_is_the_cheapest_way_on(outlook, activity, discount):
    """Bellman's equation at every window, with a toll of 0.1 for each frame of another activity."""
    cost, way_out = outlook.towards(activity)
    toll = np.where(outlook.activity == activity, 0.0, 0.1) if activity >= 0 else np.zeros(len(cost))
    tails, exits, distances = outlook.exits
    best = np.full(len(cost), np.inf)
    following = outlook.place[outlook.frames + 1]
    best[following >= 0] = discount * cost[following[following >= 0]]
    np.minimum.at(best, tails, (distances + discount * cost[exits]).min(axis=1))
    np.testing.assert_allclose(cost, toll + best, rtol=2e-3, atol=1e-5)
    ends = following < 0
    assert (way_out[ends] >= 0).all()
    jumped = outlook.frames[way_out[ends]] - outlook.frames[ends]
    assert (np.abs(jumped) > 15).all()


def test_what_another_activity_costs_is_paid_until_it_is_left(outlook):
    brisk = outlook.activities.index("brisk")
    cost, free = outlook.towards(brisk)[0], outlook.towards()[0]
    assert np.median(cost[outlook.activity != brisk]) > 2 * np.median(cost[outlook.activity == brisk]) > 0
    assert (cost >= free - 1e-6).all()


def test_the_next_second_is_that_of_the_clip(tree, outlook):
    poses, starts = tree.database_.poses, tree.database_.starts
    for i in range(0, len(outlook.frames), 41):
        now = outlook.frames[i]
        then = min(now + 30, starts[starts > now].min() - 1)
        way = poses[then] - poses[now]
        assert outlook.speed[i] == pytest.approx(np.hypot(*way[:2]) * 30 / (then - now), rel=1e-4)
        assert outlook.turn[i] == pytest.approx(way[5], abs=1e-5)
    speeds = [np.median(outlook.speed[outlook.activity == outlook.activities.index(a)]) for a in ("slow", "brisk")]
    assert speeds[0] < 1.1 < speeds[1]


def test_feet_that_stand_are_still_and_the_ground_brings_soles_to_zero(tree, outlook):
    database = tree.database_
    ankles, balls = feet(database.poses, database.skeleton)
    inside = np.ones(len(database.poses), dtype=bool)
    inside[database.starts[:-1]] = inside[database.starts[1:] - 1] = False
    speed = np.linalg.norm(np.gradient(balls[..., :2], 1 / 30, axis=0), axis=-1)
    stands = outlook.stands & inside[:, None]
    assert 0.5 < outlook.stands.mean() < 0.75  # walkers stand on each foot for about 60 % of the time
    assert np.median(speed[stands]) < 0.1
    assert np.median(speed[~outlook.stands & inside[:, None]]) > 1.0
    sequence = database.sequence_of(outlook.frames)
    sole = np.array([outlook.ground[sequence == s][0, 0] for s in range(6)])
    raised = ankles[..., 2] + sole[database.sequence_of(np.arange(len(ankles)))][:, None]
    flat = np.percentile(raised[outlook.stands], 10)
    assert flat == pytest.approx(ANKLE_HEIGHT * database.skeleton.height, abs=0.003)
