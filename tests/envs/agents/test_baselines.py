"""The reference agents in the real environments."""

import numpy as np
import pytest

from motionenv.envs.agents import Kalman, MeanPose, Oracle, evaluate
from motionenv.envs.agents.baselines import SeenPoints, SeenWalkers, walker_at, walking_poses
from motionenv.envs.arm import ArmTrackingVector
from motionenv.envs.markers import MarkerTracking
from motionenv.envs.walker import WalkerTrackingVector
from motionenv.errors import MotionError
from motionenv.models.synthesis import synthesize
from motionenv.render import Raycaster
from motionenv.render.cameras import view

AGENTS = (MeanPose, Kalman, Oracle)


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
        Kalman(env)


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


def test_points_are_what_their_gaussian_process_says_given_all_that_was_seen():
    """Brute force: a constant plus a damped oscillation has a known covariance, on which the seen points condition."""
    fps, frames, rng = 30.0, 25, np.random.default_rng(3)
    look, remembered = SeenPoints(1, fps), []
    seen = rng.random((frames, 1, 15)) < 0.5
    points = rng.normal([0.0, 0.9], 0.3, (frames, 1, 15, 2))
    for now, shown in zip(points, seen, strict=True):
        remembered.append(look.at(np.where(shown[..., None], now, 0.0), shown)[0])
    start = SeenPoints(1, fps)
    mean, variances = start._mean, np.diagonal(start._start, axis1=-2, axis2=-1)
    lag = np.abs(np.arange(frames)[:, None] - np.arange(frames)) / fps
    for joint in range(15):
        for axis, rate in enumerate(2 * np.pi * np.array([0.95, 1.9])):
            constant, swing, _ = variances[joint, axis]
            cover = constant + swing * np.exp(-lag / 2.0) * np.cos(rate * lag)
            for t in range(frames):
                at = np.flatnonzero(seen[: t + 1, 0, joint])
                noisy = cover[np.ix_(at, at)] + 0.015**2 * np.eye(len(at))
                off = points[at, 0, joint, axis] - mean[joint, axis]
                expected = mean[joint, axis] + cover[t, at] @ np.linalg.solve(noisy, off)
                assert remembered[t][joint, axis] == pytest.approx(expected, abs=1e-6)


def test_points_that_nobody_remembers_are_where_walkers_have_them():
    look = SeenPoints(1, 30.0, remembers=False)
    points, seen = np.full((1, 15, 2), 1.0), np.zeros((1, 15))
    unseen = look.at(points, seen)
    assert np.allclose(unseen[..., 0], 0.0)
    assert (np.abs(look.at(points, seen + 1) - points) < np.abs(unseen - points)).all()
    assert np.array_equal(look.at(points, seen), unseen)


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
        found, depth, _ = walker_at(where, column, rows[0] - 0.5, rows[-1] + 0.5)
        off.append([np.hypot(*(found - place)), abs(depth / true - 1)])
    metres, share = np.mean(off, axis=0)
    assert metres < 0.25
    assert share < 0.05


def silhouette(*people: tuple[float, float], frame: int = 0) -> np.ndarray:
    """A mask (1, 128, 128, 1) of people who stand at places, from the side."""
    masks = [Raycaster().render(walker(*place, frame=frame), WALK.skeleton, camera(0.0)).limbs > 0 for place in people]
    return np.any(masks, axis=0)[None, ..., None]


def begun(n: int = 1, **how) -> SeenWalkers:
    look = SeenWalkers(n, 30.0, **how)
    look.forget(np.ones(n, bool), [camera(0.0)] * n)
    return look


@pytest.mark.parametrize("name", ["mask", "depth"])
def test_a_walker_who_is_hidden_is_thought_to_go_on(name):
    far, look = 50.0, begun(2)
    for frame in range(32):
        true = np.array([[-1.0 + 0.04 * frame, 0.5], [0.8 - 0.02 * frame, -0.5 + 0.02 * frame]])
        poses = [walker(*true[0], frame=frame), walker(*true[1], 3 * np.pi / 4, frame)]
        shown = [Raycaster().render(pose, WALK.skeleton, camera(0.0)) for pose in poses]
        pictures = np.stack([np.where(f.limbs > 0, f.depth, far) if name == "depth" else f.limbs for f in shown])
        if frame >= 25:  # nothing but background
            pictures = np.full_like(pictures, far if name == "depth" else 0)
        found, heading = look.at({name: pictures[..., None]}, far)
        assert np.hypot(*(found - true).T).max() < (1.1 if frame == 0 else 0.5)
    assert np.abs(np.angle(np.exp(1j * (heading - [0.0, 3 * np.pi / 4])))).max() < 0.6
    look.forget(np.array([False, True]), [camera(0.0)])
    empty = np.full((2, 128, 128, 1), far if name == "depth" else 0)
    (_, fresh), headings = look.at({name: empty}, far)
    assert fresh.tolist() == [0.0, 0.0]
    assert headings[1] == 0.0


def test_who_is_half_hidden_does_not_seem_to_be_elsewhere():
    look = begun(remembers=False)
    for frame in range(10):
        mask = silhouette((0.0, 0.0), frame=frame)
        if frame >= 5:
            mask = mask & (np.arange(128)[:, None, None] <= 78)  # legs are behind a box
        found, _ = look.at({"mask": mask}, 50.0)
        assert np.hypot(*found[0]) < 0.8  # their lowest row alone tells a distance of 12 m instead of 6


def test_a_blob_is_where_the_last_picture_has_it():
    look = begun(remembers=False)
    for x in (-1.0, 1.0):
        found, heading = look.at({"mask": silhouette((x, 0.0))}, 50.0)
    assert abs(found[0, 0] - 1.0) < 0.1
    assert heading[0] == 0.0
    assert look.at({"mask": np.zeros((1, 128, 128, 1))}, 50.0)[0].tolist() == [[0.0, 0.0]]


def test_of_two_people_the_one_who_was_followed_is_followed_on():
    for x in (-1.2, 1.2):
        look = begun()
        for _ in range(8):
            look.at({"mask": silhouette((x, 0.0))}, 50.0)
        for _ in range(8):
            found, _ = look.at({"mask": silhouette((-1.2, 0.0), (1.2, 0.0))}, 50.0)
        assert abs(found[0, 0] - x) < 0.2


def test_a_filter_starts_anew_where_all_that_is_seen_is_elsewhere():
    look, places = begun(), []
    for _ in range(8):
        look.at({"mask": silhouette((-1.5, 0.0))}, 50.0)
    for _ in range(12):
        places.append(look.at({"mask": silhouette((1.5, 0.0))}, 50.0)[0][0, 0])
    assert places[0] < -1.0
    assert places[-1] > 1.0


def test_what_shows_the_truth_alone_is_not_for_detections():
    with pytest.raises(MotionError, match="this environment shows joints"):
        Kalman(MarkerTracking(observation="joints"))
