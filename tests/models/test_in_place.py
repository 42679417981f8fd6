"""One stride in place is what `synthesize` walks over the ground without variation, seen from the treadmill."""

from dataclasses import replace

import numpy as np
import pytest

import motionenv
from motionenv import MotionError
from motionenv.body import feet, limit_excess
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.models import cycle
from motionenv.models.contact_rule import SAMPLES
from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.people import average_person
from motionenv.models.walking import WalkingModel
from tests.models.eigenwalkers.walks import made_markers

PEOPLE = [(), *np.random.default_rng(3).uniform(-2, 2, (4, 8)).tolist()]
MODELS = ["walk/fpca", "walk/eigenwalkers", "walk/prior"]


def over_the_ground(model, walker, made, **asked):
    """The second of three strides that `synthesize` makes, at the phases of `made`, less its even way."""
    count = len(made.poses)
    walker = replace(walker, stride_seconds=made.seconds) if model.kind == "walking" else walker
    walk = model.synthesize(3 * made.seconds, count / made.seconds, walker=walker, variation=0, **asked)
    way = walk.poses[2 * count, :2] - walk.poses[count, :2]
    turn, poses = np.arctan2(way[1], way[0]), walk.poses[count : 2 * count].copy()
    poses[:, :2] -= np.arange(count)[:, None] / count * way
    poses[:, :2] -= poses[:, :2].mean(axis=0)
    c, s = np.cos(turn), np.sin(turn)
    poses[:, :2] = poses[:, :2] @ np.array([[c, -s], [s, c]])
    poses[:, 5] -= turn
    return poses, float(np.hypot(*way)), walk.skeleton


@pytest.mark.parametrize("deviations", PEOPLE)
@pytest.mark.parametrize(("samples", "asked"), [(96, {}), (96, {"height": 1.3}), (24, {}), (133, {})])
def test_a_walker_of_poses_stands_and_steps_as_over_the_ground(deviations, samples, asked):
    model = motionenv.load("walk/fpca")
    walker = motionenv.Walker(model.kind, model.walker(deviations=deviations).scores)  # at the pace of the scores
    made = cycle(model, walker=walker, samples=samples, **asked)
    if samples < SAMPLES:  # contact is looked at more often than is shown
        finer = cycle(model, walker=walker, samples=4 * samples, **asked)
        np.testing.assert_allclose(made.poses, finer.poses[::4] - [*finer.poses[::4, :2].mean(0), *[0] * 23], atol=1e-9)
        return
    poses, stride, body = over_the_ground(model, walker, made, **asked)
    np.testing.assert_allclose(made.poses, poses, rtol=0, atol=1e-9)
    assert made.stride == pytest.approx(stride, abs=1e-9)
    np.testing.assert_array_equal(made.body.offsets, body.offsets)
    np.testing.assert_allclose(made.markers, motionenv.markers(poses, body), rtol=0, atol=1e-9)
    np.testing.assert_allclose(feet(made.poses, body)[1], feet(poses, body)[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("asked", [{}, {"speed": 1.5}, {"speed": 0.8, "height": 1.5}])
def test_a_drawn_person_is_the_one_who_walks_over_the_ground(model, asked):
    """Of markers: the rotation of straight limbs, which they don't show, is smoothed over time."""
    model = motionenv.load(model)
    walker = model.walker(seed=4)
    made = cycle(model, walker=walker, **asked)
    given = {"height": asked["height"]} if "height" in asked else {}
    if model.kind == "walking" and "speed" in asked:  # over the ground, the pace fits the whole walk
        assert made.speed == pytest.approx(asked["speed"], rel=1e-12)
        return
    poses, stride, body = over_the_ground(model, walker, made, **(given if model.kind == "walking" else asked))
    root = made.poses[:, :2] - made.poses[:, :2].mean(axis=0)
    np.testing.assert_allclose(root, poses[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(made.poses[:, 2], poses[:, 2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(made.poses[:, 3:], poses[:, 3:], rtol=0, atol=1e-9 if model.kind == "walking" else 0.03)
    assert made.stride == pytest.approx(stride, abs=1e-9)
    assert made.body.height == body.height
    if not asked and model.kind != "walking":
        markers = made_markers(model, made.seconds, SAMPLES / made.seconds, walker=walker).positions
        placed = made.markers + np.arange(SAMPLES)[:, None, None] / SAMPLES * [made.stride, 0, 0]
        apart = (markers - placed).reshape(-1, 3)
        np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), rtol=0, atol=1e-9)


@pytest.mark.parametrize("deviations", PEOPLE)
def test_standing_feet_go_back_with_the_ground(deviations):
    """No foot slips on the moving ground, floats or goes through it, and no joint bends backwards."""
    made = cycle("walk/fpca", deviations=deviations)
    ankles, balls = feet(made.poses, made.body)
    assert balls[..., 2].min() > 0
    assert ankles[..., 2].min() > ANKLE_HEIGHT * made.body.height - 0.03
    lower = np.argmin(balls[..., 2], axis=1)
    back = 0.5 * (np.roll(balls, 1, 0) - np.roll(balls, -1, 0))[np.arange(SAMPLES), lower, 0] * SAMPLES
    still = (lower == np.roll(lower, 1)) & (lower == np.roll(lower, -1))
    assert np.median(np.abs(back[still] / made.stride - 1)) < 0.1
    assert limit_excess(made.poses)[:, [12, 16, 20, 24]].min() >= 0


@pytest.mark.parametrize("model", MODELS)
def test_one_foot_takes_over_from_the_other(model):
    made = cycle(model, deviations=[0.5])
    np.testing.assert_allclose(made.standing.sum(axis=1), 1.0, atol=1e-12)
    left, right = made.contacts
    assert left < 0.2
    assert 0.4 < right < 0.7
    back = -np.diff(made.markers[:, 13:15, 0], axis=0)
    assert (made.standing[:-1].argmax(axis=1) == back.argmax(axis=1)).mean() > 0.9


def test_a_speed_is_kept():
    for speed in (0.4, 1.2, 2.5):
        assert cycle("walk/fpca", deviations=PEOPLE[1], speed=speed).speed == pytest.approx(speed, rel=1e-12)
        assert cycle("walk/eigenwalkers", speed=speed).speed == pytest.approx(speed, rel=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_many_at_once_are_each_one(model):
    """What traits are measured on, and each of several walkers."""
    model = motionenv.load(model)
    components = model.components()
    scores = components.means + components.deviations * np.random.default_rng(1).uniform(-1, 1, (3, len(components)))
    walkers = [model.walker(scores=row) for row in scores]
    markers, heights = model.treadmill().crowd(scores)
    for i, made in enumerate(model.in_place(walkers, samples=SAMPLES)):
        alone = cycle(model, scores=scores[i])
        np.testing.assert_allclose(made.poses, alone.poses, rtol=0, atol=1e-12)
        # Without fitting bodies, the way of markers isn't known to the millimetre.
        tolerance = 1e-12 if model.kind == "walking" else 0.05
        np.testing.assert_allclose(markers[i], made.markers, atol=tolerance)
        assert made.speed == pytest.approx(average_person(heights[i]).speed, rel=1e-9)  # style doesn't change speed
        assert heights[i] == pytest.approx(made.body.height, rel=tolerance)


@pytest.mark.parametrize(("kind", "walks"), [(WalkingModel, 1), (WalkingModel, 4), (Eigenwalkers, 6)])
@pytest.mark.parametrize("speed", [0.9, 1.32, 1.7])
def test_who_is_given_by_a_style_walks_as_the_model_knows(kind, walks, speed):
    """Of slow or of fast people alone, the average is theirs; of people at the usual pace, the usual one."""
    captured = [motionenv.synthesize("walk/fpca", 6, 60, seed=seed, speed=speed) for seed in range(walks)]
    model = kind().fit(captured)
    low, high = model.learned_speeds()
    assert low < 1.05 * speed
    assert high > 0.95 * speed
    made = cycle(model)
    assert made.speed == pytest.approx(speed, rel=0.04 if kind is WalkingModel else 0.07)
    assert model.extrapolation([made.speed]) is None
    if walks > 1:
        assert cycle(model, deviations=[1.5]).speed == pytest.approx(made.speed, rel=1e-9)
    length = np.median([_stride_length(walk) for walk in captured])
    assert made.stride == pytest.approx(length, rel=0.06)


def _stride_length(walk):
    """Of a steady walk of several strides: how far it gets between times at which the left leg is furthest ahead."""
    swing = walk.poses[:, 17] - walk.poses[:, 21]
    peaks = [i for i in range(20, len(swing) - 20) if swing[i] == swing[i - 20 : i + 21].max()]
    return (walk.poses[peaks[-1], 0] - walk.poses[peaks[0], 0]) / (len(peaks) - 1)


def test_drawn_people_and_styles_walk_together():
    """Each at a pace of its own: the drawn one's stride time, the style's mean pace of people."""
    model = motionenv.load("walk/fpca")
    walkers = [model.walker(seed=4), model.walker(deviations=[1.0])]
    for made, walker in zip(model.in_place(walkers), walkers, strict=True):
        alone = model.in_place([walker])[0]
        np.testing.assert_allclose(made.poses, alone.poses, rtol=0, atol=1e-12)
        assert made.seconds == pytest.approx(alone.seconds, rel=1e-12)


@pytest.mark.parametrize(
    ("asked", "what"),
    [
        ({"scores": [np.nan]}, "scores"), ({"scores": [0] * 99}, "scores"), ({"speed": 0.0}, "speed"),
        ({"speed": np.nan}, "speed"), ({"height": 9}, "height"), ({"samples": 3}, "samples"),
        ({"deviations": [1], "scores": [1]}, "scores"), ({"model": "mixed/tree"}, "no cycles in place"),
        ({"walker": motionenv.Walker("walking", (0.0,))}, "walker"),
        ({"walker": motionenv.Walker("walking", (0.0,) * 8), "scores": [1]}, "walker"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(asked, what):
    with pytest.raises(MotionError, match=what):
        cycle(**{"model": "walk/fpca"} | asked)
