"""The reference agents in the real environments."""

import numpy as np
import pytest

from motionenv.envs.agents import ConstantVelocity, MeanPose, Oracle, evaluate
from motionenv.envs.agents.baselines import SeenPoints, SeenWalkers, walker_at, walking_poses
from motionenv.envs.arm import ArmTrackingVector
from motionenv.envs.markers import MarkerTracking
from motionenv.envs.walker import WalkerTrackingVector
from motionenv.errors import MotionError
from motionenv.models.synthesis import synthesize
from motionenv.render import Raycaster
from motionenv.render.cameras import view

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


def test_reprs_are_a_line():
    env = MarkerTracking(horizon=3)
    said = "(MarkerTracking(motion='walk/eigenwalkers', horizon 3))"
    assert [repr(agent(env)) for agent in AGENTS] == [f"{agent.__name__}{said}" for agent in AGENTS]


def test_a_negative_spread_is_refused():
    with pytest.raises(MotionError, match="spread must be"):
        Oracle(MarkerTracking(horizon=3), spread=-1.0)


WALK = synthesize("walk/fpca", 2.0, 30.0, seed=1, height=1.75)


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


def camera(alpha: float):
    """A level camera 6 m from the origin."""
    return view(alpha, distance=6.0, eye_height=1.1, target=(0.0, 0.0, 1.1), width=128, height=128)


def walker(x: float, y: float, heading: float = 0.0, frame: int = 0) -> np.ndarray:
    pose = WALK.poses[frame].copy()
    pose[[0, 1, 5]] = x, y, heading
    return pose


@pytest.mark.parametrize("alpha", [0.0, 0.5, np.pi / 2, -2.5])
@pytest.mark.parametrize("place", [(-1.0, 0.0), (0.3, 1.5), (0.8, -1.2)])
def test_a_walker_is_found_on_the_ground(alpha, place):
    where = camera(alpha)
    true, off = where.project(np.array([*place, 1.0]))[1], []
    for frame in range(0, 30, 5):
        mask = Raycaster().render(walker(*place, frame=frame), WALK.skeleton, where, rgb=False).limbs > 0
        rows, column = np.flatnonzero(mask.any(1)), mask.sum(0) @ np.arange(128) / mask.sum()
        found, depth = walker_at(where, column, rows[0] - 0.5, rows[-1] + 0.5)
        off.append([np.hypot(*(found - place)), abs(depth / true - 1)])
    metres, share = np.mean(off, axis=0)
    assert metres < 0.25
    assert share < 0.05


@pytest.mark.parametrize("name", ["mask", "depth"])
def test_a_walker_who_is_hidden_is_thought_to_go_on(name):
    far, look = 50.0, SeenWalkers(2)
    look.forget(np.ones(2, bool), [camera(0.0)] * 2)
    for frame in range(40):
        true = np.array([[-1.0 + 0.04 * frame, 0.5], [0.8 - 0.02 * frame, -0.5 + 0.02 * frame]])
        poses = [walker(*true[0], frame=frame), walker(*true[1], 3 * np.pi / 4, frame)]
        shown = [Raycaster().render(pose, WALK.skeleton, camera(0.0)) for pose in poses]
        pictures = np.stack([np.where(f.limbs > 0, f.depth, far) if name == "depth" else f.limbs for f in shown])
        if frame >= 25:  # nothing but background
            pictures = np.full_like(pictures, far if name == "depth" else 0)
        found, heading = look.at({name: pictures[..., None]}, far, 30.0)
        assert np.hypot(*(found - true).T).max() < 0.4
    assert np.abs(np.angle(np.exp(1j * (heading - [0.0, 3 * np.pi / 4])))).max() < 0.4
    look.forget(np.array([False, True]), [camera(0.0)])
    empty = np.full((2, 128, 128, 1), far if name == "depth" else 0)
    (_, fresh), headings = look.at({name: empty}, far, 30.0)
    assert fresh.tolist() == [0.0, 0.0]
    assert headings[1] == 0.0


def test_who_is_half_hidden_does_not_seem_to_be_elsewhere():
    look = SeenWalkers(1, kept=0.0)
    look.forget(np.ones(1, bool), [camera(0.0)])
    for frame in range(10):
        mask = Raycaster().render(walker(0.0, 0.0, frame=frame), WALK.skeleton, camera(0.0)).limbs[None, ..., None]
        if frame >= 5:
            mask = np.where(np.arange(128)[:, None, None] > 78, 0, mask)  # legs are behind a box
        found, _ = look.at({"mask": mask}, 50.0, 30.0)
        assert np.hypot(*found[0]) < 0.8  # their lowest row alone tells a distance of 12 m instead of 6


def test_a_blob_is_where_the_last_picture_has_it():
    look = SeenWalkers(1, kept=0.0)
    look.forget(np.ones(1, bool), [camera(0.0)])
    for x in (-1.0, 1.0):
        mask = Raycaster().render(walker(x, 0.0), WALK.skeleton, camera(0.0)).limbs[None, ..., None]
        found, heading = look.at({"mask": mask}, 50.0, 30.0)
    assert abs(found[0, 0] - 1.0) < 0.1
    assert heading[0] == 0.0
