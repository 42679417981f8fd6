"""Walks at changing speeds: the way asked for, whole steps, and standing that stands."""

import numpy as np
import pytest

import motionenv
from motionenv.body import feet
from motionenv.errors import ModelError, MotionError
from motionenv.models import FixedModel
from motionenv.models.paths import WalkPath, bend, random_path, walk_along
from motionenv.types import Motion

MODELS = ("walk/fpca", "walk/eigenwalkers", "walk/prior")
STOP_AND_GO = [(0, 0), (1, 0), (2, 1.2), (4, 1.2), (5, 0), (6.5, 0), (7.5, 1.0)]


@pytest.fixture(scope="module", params=MODELS)
def stop_and_go(request):
    model = motionenv.load(request.param)
    return walk_along(model, WalkPath.line(50), 10, 60, seed=2, speed=STOP_AND_GO)


def test_the_way_is_the_speed_summed_up(stop_and_go):
    """On average over steps, and between rests exactly: 0.6 + 2.4 + 0.6 m."""
    x = stop_and_go.poses[:, 0]
    assert x[6 * 60] - x[0] == pytest.approx(3.6, abs=0.02)
    assert x[-1] - x[6 * 60] == pytest.approx(0.5 + 2.5, abs=0.1)
    times = np.arange(600) / 60
    asked = np.interp(times, *np.transpose(STOP_AND_GO))
    assert np.abs(x - x[0] - np.cumsum(asked) / 60).max() < 0.12


def test_who_stands_stands(stop_and_go):
    """No marching on the spot: all is still, with both feet on the ground beside each other."""
    rest = stop_and_go.poses[int(5.6 * 60) : int(5.9 * 60)]
    assert np.ptp(rest, axis=0).max() < 0.01
    ankles, balls = feet(rest, stop_and_go.skeleton)
    assert np.ptp(ankles[..., 2]) < 0.03
    assert np.abs(balls[:, 0, 0] - balls[:, 1, 0]).max() < 0.1
    assert (balls[:, 0, 1] - balls[:, 1, 1]).min() > 0.0  # not crossed
    assert np.degrees(rest[:, [20, 24]].max()) < 30


def test_feet_stay_between_whole_steps(stop_and_go):
    balls = feet(stop_and_go.poses, stop_and_go.skeleton)[1][..., :2]
    pace = np.linalg.norm(np.gradient(balls, axis=0), axis=-1) * 60
    for side in range(2):
        still = pace[:, side] < 0.05
        edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int))).reshape(-1, 2)
        stances = [slice(*e) for e in edges if e[1] - e[0] > 12]
        assert 6 <= len(stances) <= 14
        assert max(np.ptp(balls[s, side], axis=0).max() for s in stances) < 0.02
    assert (pace.min(axis=1) < 0.3).mean() > 0.9  # hardly ever is no foot down
    assert np.abs(np.diff(stop_and_go.poses[:, 2])).max() * 60 < 1.0


@pytest.mark.parametrize("model", MODELS[:2])
def test_who_begins_in_mid_step_is_upright(model):
    """Not as low as the foot that comes from behind would need if it were already in front."""
    for phase in (0.0, 0.3, 0.6):
        walk = walk_along(
            motionenv.load(model), WalkPath.line(9), 3, 30, seed=2, speed=[(0, 1.2), (2, 0.8)], phase=phase
        )
        assert walk.poses[:, 2].min() > 0.93 * np.median(walk.poses[:, 2])


def test_an_even_speed_is_a_bent_walk():
    model, path = motionenv.load("walk/fpca"), random_path(np.random.default_rng(1), 20.0)
    walker = model.walker(4)
    motion = walk_along(model, path, 4, 60, walker=walker, seed=9, speed=1.1, variation=0.0)
    straight = model.synthesize(4, 60, walker=walker, speed=1.1, variation=0.0)
    np.testing.assert_array_equal(motion.poses, bend(straight, path).poses)


def test_speeds_change_the_steps_with_them():
    """The same person walks with longer steps at 1.5 m/s than at 0.8 m/s, and the speed may be a function."""
    model = motionenv.load("walk/fpca")
    speed = lambda t: 0.8 if t < 6 else 1.5
    motion = walk_along(model, WalkPath.line(50), 12, 60, seed=5, speed=speed)
    strides = []
    for part in (motion.poses[60:330], motion.poses[400:700]):
        swing = part[:, 17] - part[:, 21]
        strides.append(np.ptp(swing))
    assert strides[1] > 1.15 * strides[0]
    rows = walk_along(model, WalkPath.line(50), 12, 60, seed=5, speed=[(0, 0.8), (5.99, 0.8), (6.0, 1.5)])
    np.testing.assert_allclose(rows.poses, motion.poses, atol=1e-6)


def steepest(walk: Motion) -> float:
    """Greatest vertical acceleration of the root [m/s²], but for the first and last moments."""
    return np.abs(np.diff(walk.poses[12:-12, 2], 2)).max() * walk.fps**2


@pytest.mark.parametrize("seed", range(6))
def test_the_body_is_neither_pulled_down_nor_thrown_up(seed):
    """It falls about as fast as that of the same person on a straight walk, however steps are bent and blended."""
    model = motionenv.load("walk/fpca")
    somebody = model.draw_walker(np.random.default_rng(seed), 1.2)
    curve = WalkPath.through([(0, 0), (3, 0), (5, 2), (3, 4), (0, 3)])
    straight = model.synthesize(8, 60, walker=somebody, seed=seed, speed=1.2)
    walks = [
        walk_along(model, path, 8, 60, walker=somebody, seed=seed, speed=speed)
        for path, speed in ((curve, 1.2), (WalkPath.line(50), lambda _: 1.2), (curve, STOP_AND_GO))
    ]
    most = steepest(straight)
    for walk in walks:
        assert steepest(walk) < max(1.8 * most, 17.0)


def test_a_walk_ends_where_the_path_ends():
    path = WalkPath.arc(2.0, 1.5)
    motion = walk_along(motionenv.load("walk/eigenwalkers"), path, 7, 30, seed=1, speed=1.3)
    assert np.linalg.norm(motion.poses[-1, :2] - path.position(path.length)) < 0.1
    assert np.ptp(motion.poses[-30:], axis=0).max() < 0.02


def test_the_same_seed_gives_the_same_bytes_whatever_went_before():
    model, path = motionenv.load("walk/eigenwalkers"), WalkPath.arc(3, 2)
    make = lambda seed: walk_along(model, path, 3, 30, seed=seed, speed=[(0, 0), (1, 1)], height=1.6).poses.tobytes()
    first = make(3)
    assert make(4) != first
    assert make(3) == first


def test_a_steered_model_keeps_to_the_path():
    path = WalkPath.through([(0, 0), (3, 0), (6, 2), (9, 2)])
    motion = motionenv.synthesize("mixed/tree", 5, 60, seed=1, path=path, speed=1.2, height=1.9)
    near = path.position(np.linspace(0, path.length, 1000))
    assert np.linalg.norm(motion.poses[:, None, :2] - near, axis=-1).min(axis=1).max() < 0.12
    assert motion.poses.shape == (300, 25)
    assert motion.skeleton.height == pytest.approx(1.9)


class Statue(FixedModel):
    """Glides without steps."""

    kind, card_ = "statue", {"data": "none"}

    def make_motion(self, walker, request, rng):
        body, poses = self.body(request.height), np.zeros((request.frames, 25))
        poses[:, 0] = (request.speed or 1.0) * np.arange(request.frames) / request.fps
        poses[:, 2] = 0.53 * body.height
        return Motion(poses, body, request.fps, "statue")


def test_what_cannot_be_walked_is_refused():
    model = motionenv.load("walk/fpca")
    for given, match in (
        ({"path": "left"}, "path must be"),
        ({"speed": "fast"}, "speed must be"),
        ({"speed": [(0, 1), (0, 2)]}, "increasing times"),
        ({"speed": lambda t: 4 * t}, "from 0 to 3"),
        ({"speed": lambda t: -t}, "from 0 to 3"),
        ({"speed": 0.0}, "0.1"),
        ({"seconds": 0}, "seconds"),
    ):
        with pytest.raises(MotionError, match=match):
            walk_along(model, **({"path": WalkPath.line(5), "seconds": 4, "seed": 1} | given))
    with pytest.raises(ModelError, match="no steps"):
        walk_along(Statue(), WalkPath.line(9), 3, speed=[(0, 0), (1, 1)])
    assert len(walk_along(Statue(), WalkPath.arc(5, 1), 3).poses) == 90
