"""Synthesis from the tree, on real capture (Bandai-Namco) and on walks of a shipped model."""

import numpy as np
import pytest

import motionenv
from motionenv.body.kinematics import feet, markers
from motionenv.cycles import estimate_period
from motionenv.errors import ModelError, MotionError
from motionenv.mocap import read_motion
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.motion_tree.synthesis._generator_kernels import coefficients
from motionenv.models.motion_tree.synthesis.generator import (
    MotionGenerator,
    Options,
    Target,
    future_cost_of,
)
from motionenv.models.synthesis import synthesize as walk
from motionenv.types import Motion

ACTIVITIES = ("walk", "run", "walk-turn-left", "walk-turn-right", "dash")
STYLES = ("normal", "active", "feminine")
LEGS = slice(17, 25)


@pytest.fixture(scope="module")
def clips(mocap):
    """Clips of five activities in the styles of which there are most."""
    found = []
    for path in sorted((mocap / "bandai_namco").rglob("*.bvh")):
        _, activity, style, _ = path.stem.split("_")
        if activity in ACTIVITIES and style in STYLES:
            found.append(Clip(read_motion(path, unit="cm"), path.name, activity, style))
    return found


@pytest.fixture(scope="module")
def tree(clips):
    return MotionTree().fit_database(build_database(clips))


@pytest.fixture(scope="module")
def halves(clips):
    database = build_database(clips)
    return MotionTree(part="lower").fit_database(database), MotionTree(part="upper").fit_database(database)


@pytest.fixture(scope="module")
def walkers():
    """A tree of walks of a shipped model."""
    model = motionenv.load("walk/fpca")
    motions = [walk(model, 6, 30, seed=i, speed=1.0 + 0.1 * i, height=1.75) for i in range(6)]
    labels = ("slow", "slow", "slow", "brisk", "brisk", "brisk")
    return MotionTree().fit_database(
        build_database(Clip(m, str(i), a) for i, (m, a) in enumerate(zip(motions, labels, strict=True)))
    )


def history(tree, activity="walk", frames=14):
    """Poses from the middle of the first clip of an activity."""
    database = tree.database_
    sequence = database.activities.index(activity)
    middle = int(database.starts[sequence : sequence + 2].mean())
    return database.poses[middle - frames : middle].astype(float)


def one_by_one(growth, frames):
    """Poses, and the frames of the database that they follow."""
    poses, windows = np.empty((frames, 25)), np.empty(frames, dtype=int)
    for k in range(frames):
        poses[k], windows[k] = growth.step(1)[0], growth.windows[0]
    return poses, growth._trees[0].frames_[windows].astype(int)


def changes(poses):
    """Changes of the joints' velocities (frames - 2, 19) from frame to frame [rad/s]."""
    steps = np.diff(poses[:, 6:], axis=0)
    steps -= 2 * np.pi * np.round(steps / (2 * np.pi))
    return np.abs(np.diff(steps, axis=0)) * 30


def stances(ball, stands):
    """Furthest [m] that the ball of a foot (frames, 3) goes from where it is when it begins to stand, per stance."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], stands, [0]]))).reshape(-1, 2)
    return [np.linalg.norm(ball[a:b, :2] - ball[a, :2], axis=1).max() for a, b in edges if b - a > 2]


def test_what_comes_out_does_not_depend_on_the_steps(tree):
    whole = MotionGenerator(tree, "walk", seed=3).step(30)
    growth = MotionGenerator(tree, "walk", seed=3)
    assert np.array_equal(np.concatenate([growth.step(10), growth.step(1), growth.step(19)]), whole)
    assert not np.array_equal(MotionGenerator(tree, "walk", seed=4).step(30), whole)
    assert np.array_equal(tree.generator("walk", seed=3).motion(1.0).poses, whole)


def test_two_trees_do_not_depend_on_the_steps_either(halves):
    lower, upper = halves
    whole = MotionGenerator(lower, "walk", upper=upper, seed=3, options=Options(noise=0.1)).step(30)
    growth = MotionGenerator(lower, "walk", upper=upper, seed=3, options=Options(noise=0.1))
    assert np.array_equal(np.concatenate([growth.step(10), growth.step(20)]), whole)


def test_matches_the_coefficients_of_the_tree(tree):
    """The loop's own projection of the last frames against `MotionTree.coefficients`."""
    growth = MotionGenerator(tree, history(tree), seed=0, options=Options(contact=False))
    poses = growth.step(40)
    found = np.empty(len(tree.basis_.deviation))
    coefficients(growth._sources[0], growth._state.rows, found)
    np.testing.assert_allclose(found, tree.coefficients(poses), atol=2e-4)


def test_near_zero_temperature_a_clip_plays_on(tree):
    """From a clip's own history, all that comes next is the clip, but for jumps elsewhere at its end."""
    database = tree.database_
    sequence = database.activities.index("walk")
    first = database.starts[sequence]
    growth = MotionGenerator(
        tree, database.poses[first : first + 20], seed=0, options=Options(temperature=1e-4, contact=False)
    )
    np.testing.assert_allclose(growth.step(30), database.poses[first + 20 : first + 50], atol=1e-4)


def test_without_extensions_each_pose_is_a_successor_of_a_window(tree):
    """As in the paper: the local pose shown is the database's, whatever came before."""
    options = Options(persistence=0, blend=0, future=False, contact=False, candidates=1)
    poses, frames = one_by_one(MotionGenerator(tree, "walk", seed=1, options=options), 60)
    turned = poses[:, 6:] - tree.database_.poses[frames + 1, 6:]
    assert np.abs(turned - 2 * np.pi * np.round(turned / (2 * np.pi))).max() < 1e-5
    assert (np.diff(frames) != 1).mean() > 0.3  # it jumps all the time


def test_jumps_do_not_show(tree):
    """Velocities of joints change at jumps less than the capture's own do at their 99.5th percentile."""
    database = tree.database_
    own = np.concatenate([changes(database.motion(s).poses) for s in range(len(database.clips))])
    bound = np.percentile(own, 99.5, axis=0)

    def share_above(**options):
        above = []
        for seed in range(3):
            poses, frames = one_by_one(MotionGenerator(tree, "walk", seed=seed, options=Options(**options)), 600)
            jumps = np.flatnonzero(np.diff(frames) != 1)[1:-1]  # between frame j and j + 1
            found = changes(poses)
            above.append(np.maximum(found[jumps - 1], found[jumps]) > bound)
        return np.concatenate(above).mean()

    assert share_above(contact=False) < 0.005
    assert share_above() < 0.02
    assert share_above(contact=False, blend=0) > 0.02  # and that is the blending's doing


@pytest.mark.parametrize("activity", ["walk", "run"])
def test_feet_that_stand_do_not_skate(tree, activity):
    stands = future_cost_of(tree).stands
    drift, without = [], []
    for options, found in ((Options(), drift), (Options(contact=False), without)):
        for seed in range(3):
            poses, frames = one_by_one(MotionGenerator(tree, activity, seed=seed, options=options), 450)
            ball = feet(poses, tree.database_.skeleton)[1]
            for side in range(2):
                found += stances(ball[:, side], stands[frames + 1, side])
    assert np.percentile(drift, 99) < 0.02
    assert np.median(drift) < 0.002 < np.median(without)


def test_standing_feet_are_on_the_ground(tree):
    """Feet never sink, and the lower one is seldom in the air in walking."""
    skeleton = tree.database_.skeleton
    poses = tree.generator("walk", seed=0, target=Target("walk")).motion(20).poses
    sole = feet(poses, skeleton)[1][..., 2] - 0.016 * skeleton.height
    assert sole.min() > -0.01
    assert np.percentile(sole.min(1), 80) < 0.015
    assert poses[:, [20, 24]].min() > -0.2  # knees don't bend backwards


@pytest.mark.parametrize("activity", ["walk", "run"])
def test_no_dead_end(tree, activity):
    """A minute of it: the motion never freezes or stops, and goes on with the activity asked for."""
    database = tree.database_
    for seed in range(4):
        growth = MotionGenerator(tree, activity, seed=seed, options=Options(contact=False), target=Target(activity))
        poses, frames = one_by_one(growth, 1800)
        way = np.linalg.norm(poses[30:, :2] - poses[:-30, :2], axis=1)
        assert (way > 0.1).mean() > 0.95
        moved = np.ptp(poses[np.arange(30)[:, None] + np.arange(0, 1770, 10), LEGS], axis=0)
        assert moved.max(-1).min() > 0.05  # [rad] in every second
        done = [database.activities[s] == activity for s in database.sequence_of(frames)]
        assert np.mean(done) > 0.9


def test_stride_time_is_that_of_the_clips(tree):
    database = tree.database_
    growth = MotionGenerator(tree, "walk", seed=0, target=Target("walk"))
    poses, frames = one_by_one(growth, 1800)
    source = {}
    for s in set(database.sequence_of(frames)):
        moving = database.motion(s).poses
        moving = moving[10:-10] if len(moving) > 90 else moving
        try:
            source[s] = estimate_period(moving[:, LEGS], 30.0).seconds
        except MotionError:
            continue  # standing still, or too short to tell
    expected = np.mean([source[s] for s in database.sequence_of(frames) if s in source])
    assert estimate_period(poses[:, LEGS], 30.0).seconds == pytest.approx(expected, rel=0.05)


def test_heading_is_steered(walkers, tree):
    for aim in (1.5, -1.5):
        poses = tree.generator("walk", seed=0, target=Target(heading=aim)).motion(30).poses
        assert abs(np.median(poses[450:, 5]) - aim) < 0.5


def test_activity_and_speed_are_steered(walkers):
    label = future_cost_of(walkers).activities
    shares = {}
    for wanted in label:
        growth = MotionGenerator(walkers, None, seed=1, options=Options(temperature=0.5), target=Target(wanted))
        _, frames = one_by_one(growth, 600)
        sequences = walkers.database_.sequence_of(frames)
        shares[wanted] = np.mean([walkers.database_.activities[s] == "brisk" for s in sequences])
    assert shares["brisk"] > shares["slow"] + 0.3
    way = [
        np.ptp(walkers.generator(seed=1, temperature=0.5, target=Target(speed=v)).motion(20).poses[:, 0])
        for v in (1.0, 1.5)
    ]
    assert way[1] > 1.15 * way[0]


def test_target_may_change_on_the_way(walkers):
    growth = MotionGenerator(walkers, seed=0)
    growth.step(10)
    growth.target = Target(speed=1.2)
    assert np.isfinite(growth.step(10)).all()
    with pytest.raises(MotionError, match="no activity 'swim'; it has: brisk, slow"):
        growth.target = Target(activity="swim")


def test_upper_body_keeps_to_the_lower(halves, tree):
    """Left arm against right leg swing together, as in the capture."""
    lower, upper = halves
    poses = lower.generator("walk", upper=upper, seed=0, target=Target("walk")).motion(20).poses
    both = np.corrcoef(poses[:, 9], poses[:, 17])[0, 1], np.corrcoef(poses[:, 13], poses[:, 21])[0, 1]
    assert max(both) < -0.3


@pytest.mark.parametrize("method", ["tree", "exact"])
def test_walks_on_from_any_history(walkers, method):
    """A person of another height walks on, in place and at scale, from where the history ends."""
    before = walk(motionenv.load("walk/fpca"), 1, 30, seed=9, height=1.5)
    turned = before.poses.copy()
    turned[:, [0, 1, 5]] += (3.0, -2.0, 0.0)
    after = walkers.generator(Motion(turned, before.skeleton, 30.0), seed=0, method=method).motion(3)
    assert after.skeleton is before.skeleton
    steps = np.linalg.norm(np.diff(np.concatenate([turned[-1:], after.poses])[:, :2], axis=0), axis=1)
    assert steps.max() < 0.12
    ground = markers(after.poses, after.skeleton)[:, 13:, 2].min(1)
    assert np.median(ground) == pytest.approx(0.039 * 1.5, abs=0.02)


def test_angles_a_whole_turn_off_are_the_same(walkers):
    before = history(walkers, "slow")
    off = before.copy()
    off[:, 9] += 2 * np.pi
    plain, turned = MotionGenerator(walkers, before, seed=0).step(20), MotionGenerator(walkers, off, seed=0).step(20)
    turned[:, 9] -= 2 * np.pi
    np.testing.assert_allclose(turned, plain, atol=1e-6)


def test_a_single_short_clip_goes_on_for_ever(walkers):
    clip = Clip(walkers.database_.motion(0), "only")
    short = MotionTree().fit_database(
        build_database([Clip(Motion(clip.motion.poses[:40], clip.motion.skeleton, 30.0))])
    )
    assert np.isfinite(short.generator(seed=0).motion(10).poses).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"temperature": 0}, "temperature must be a number above 0, got 0"),
        ({"temperature": np.inf}, "temperature"),
        ({"method": "brute"}, "method must be 'tree' or 'exact', got 'brute'"),
        ({"persistence": -1}, "persistence"),
        ({"candidates": 0}, "candidates must be a whole number from 1, got 0"),
        ({"candidates": np.nan}, "candidates"),
        ({"blend": -0.1}, "blend"),
        ({"blend": 1e-300}, "blend"),
        ({"noise": -1}, "noise"),
        ({"noise": 1e300}, "noise"),
        ({"start": 10**6}, "start must be the position of one of the"),
        ({"start": "swim"}, "no activity 'swim'; it has: brisk, slow"),
        ({"start": np.zeros((9, 25))}, "10 or more frames"),
        ({"start": np.full((12, 25), np.nan)}, "NaN"),
        ({"start": np.zeros((2, 12, 25))}, "batch"),
    ],
)
def test_bad_input(walkers, arguments, message):
    with pytest.raises(MotionError, match=message):
        walkers.generator(**arguments)


@pytest.mark.parametrize("seconds", [0, np.nan, 3601])
def test_a_motion_has_a_length(walkers, seconds):
    with pytest.raises(MotionError, match="seconds must be a number above 0 and at most 3600"):
        walkers.generator(seed=0).motion(seconds)


def test_more_bad_input(walkers, halves):
    skeleton = walkers.database_.skeleton
    with pytest.raises(MotionError, match="30 frames/s"):
        MotionGenerator(walkers, Motion(np.zeros((20, 25)), skeleton, 60.0))
    with pytest.raises(MotionError, match="one of the lower and upper= of the upper"):
        MotionGenerator(halves[0])
    with pytest.raises(MotionError, match="heading"):
        Target(heading=np.nan)
    with pytest.raises(MotionError, match="speed"):
        Target(speed=-1)
    with pytest.raises(MotionError, match="frames"):
        MotionGenerator(walkers).step(0)


def test_a_database_with_nan_in_it_is_refused_instead_of_searched_for_ever():
    motions = [walk("walk/fpca", 4, 30, seed=i) for i in range(3)]
    tree = MotionTree().fit_database(build_database([Clip(motion) for motion in motions]))
    poses = tree.database_.poses.copy()
    poses[20:] = np.nan
    object.__setattr__(tree.database_, "poses", poses)
    with pytest.raises(ModelError, match="damaged: build it again"):
        MotionGenerator(tree, seed=1).step(300)
