"""People: bodies and paces against the publications that they are drawn from; what speed does."""

import dataclasses
import warnings

import numpy as np
import pytest

import motionenv
from motionenv.body import from_height
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.errors import ExtrapolationWarning
from motionenv.models.people.pace import EXPONENT, Pace, direction, exponent, fit_pace, within
from motionenv.models.people.population import Person, draw_person
from motionenv.models.walking.preprocessing import find_cycles, forward_speed

SPEEDS = (0.6, 0.9, 1.3, 1.6, 2.2)


@pytest.fixture(scope="module", params=["walk/fpca", "walk/eigenwalkers", "walk/prior"])
def model(request):
    return motionenv.load(request.param)


def gait_of(motion) -> tuple[float, float, float]:
    """Speed [m/s], step length [m] and walk ratio [m/(steps/min)] of a walk, by its period."""
    seconds, speed = find_cycles(motion).seconds, forward_speed(motion)
    return speed, 0.5 * speed * seconds, speed * seconds**2 / 240


def test_faster_people_take_longer_and_quicker_steps(model):
    """Both by half: speeds are met within 2 %, and the walk ratio stays."""
    for seed in range(3):
        person = model.walker(seed=seed)
        found = [gait_of(model.synthesize(12, 60, walker=person, speed=v, variation=0, seed=0)) for v in SPEEDS]
        speeds, steps, ratios = np.transpose(found)
        np.testing.assert_allclose(speeds, SPEEDS, rtol=0.02)
        assert (np.diff(steps) > 0).all()
        assert (np.diff(speeds / steps) > 0).all()
        assert ((ratios > 0.0036) & (ratios < 0.0070)).all()
        np.testing.assert_allclose(ratios[1:4], ratios[2], rtol=0.12)


def test_the_average_person_does_not_scurry(model):
    """Before, steps at 2.0 m/s were no longer than at 1.0 m/s, and there were 208 of them a minute."""
    motion = motionenv.synthesize(model, 10, 60, deviations=[], speed=2.0, variation=0, seed=0)
    speed, step, _ = gait_of(motion)
    assert 60 * speed / step < 165
    knees = np.degrees(motion.poses[:, [20, 24]])
    assert knees.min() > -1
    assert knees.max() < 85


def test_it_stays_the_same_person(model):
    person = model.walker(seed=2)
    slow, fast = (model.synthesize(2, 60, walker=person, speed=v, seed=0) for v in (1.0, 1.6))
    np.testing.assert_allclose(slow.skeleton.offsets, fast.skeleton.offsets, atol=0.02)
    own = model.synthesize(8, 60, walker=person, variation=0, seed=0)
    assert gait_of(own)[0] == pytest.approx(person.person.speed, rel=0.04)
    assert gait_of(own)[2] == pytest.approx(person.person.walk_ratio, rel=0.08)


def test_people_differ_in_body_and_pace(model):
    walks = [model.synthesize(4, 60, seed=seed) for seed in range(24)]
    heights = np.array([walk.skeleton.height for walk in walks])
    legs = np.array([-walk.skeleton.offsets[[11, 13], 2].sum() / walk.skeleton.height for walk in walks])
    speeds = np.array([forward_speed(walk) for walk in walks])
    assert 0.04 < heights.std() < 0.15
    assert legs.std() / legs.mean() > 0.008
    assert speeds.mean() == pytest.approx(1.3, abs=0.12)
    assert speeds.std() > 0.08


def test_walkers_with_a_body_are_stored_as_json(model):
    person = model.walker(seed=4)
    assert motionenv.Walker(**dataclasses.asdict(person)) == person


def test_beyond_what_was_learned_there_is_one_warning(model):
    low, high = model.learned_speeds()
    assert 0.6 < low < 0.9 < 1.55 < high < 1.9
    with pytest.warns(
        ExtrapolationWarning, match=r"speed 2\.2 m/s is beyond the walks .* 0\.\d\d to 1\.\d\d m/s"
    ) as seen:
        model.synthesize(1, 30, seed=0, speed=2.2)
    assert len(seen) == 1
    assert seen[0].filename == __file__
    with pytest.warns(ExtrapolationWarning) as seen:
        model.synthesize_batch(1, 30, heights=[1.7] * 3, speeds=[0.5] * 3, seed=0)
    assert len(seen) >= 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.synthesize(1, 30, seed=0, speed=1.3)


def test_a_batch_is_of_different_bodies_at_the_speeds_asked_for():
    model = motionenv.load("walk/fpca")
    heights, speeds = np.linspace(1.5, 1.9, 16), np.linspace(0.7, 1.9, 16)
    walks = model.synthesize_batch(8, 60, heights=heights, speeds=speeds.tolist(), seed=1)
    np.testing.assert_allclose([forward_speed(walk) for walk in walks], speeds, rtol=0.03)
    np.testing.assert_allclose([walk.skeleton.height for walk in walks], heights)
    assert len({round(float(walk.skeleton.offsets[9, 1] / walk.skeleton.height), 6) for walk in walks}) == 16


def straight(rng, q: int = 4) -> tuple:
    """Walks of 6 people at 5 speeds each, whose z change along a known way with the log stride length."""
    way, weights = rng.standard_normal(q), rng.standard_normal(q)
    way /= way @ weights
    people = np.repeat(np.arange(6), 5)
    own = rng.standard_normal((6, q))
    log_speeds = np.tile(np.linspace(-0.4, 0.4, 5), 6)
    change = 0.5 * log_speeds
    z = own[people] + change[:, None] * way
    drawn = rng.standard_normal((200, q))
    bend = rng.standard_normal(q)
    return way, weights, (z, people, log_speeds, change + 0.1, drawn, 0.3 + drawn @ weights, bend)


def test_the_way_within_people_is_found_again():
    way, weights, walks = straight(np.random.default_rng(3))
    pace = fit_pace(*walks)
    np.testing.assert_allclose(pace.weights, weights, atol=1e-9)
    np.testing.assert_allclose(pace.curvature, 0, atol=1e-9)
    assert pace.exponent == pytest.approx(0.5, abs=1e-9)
    bend = walks[-1]
    for found in (pace.direction, pace.between):
        np.testing.assert_allclose([found @ weights, np.degrees(found @ bend)], [1, 15], rtol=1e-6)
    walks = (*walks[:-1], bend + weights * (np.radians(15.0) - way @ bend))  # now knees do as is published
    pace = fit_pace(*walks)
    assert pace.direction @ way / np.linalg.norm(pace.direction) / np.linalg.norm(way) > 0.99


def test_strides_get_as_much_longer_as_asked():
    rng = np.random.default_rng(5)
    curvature = 0.004 * rng.standard_normal((3, 3))
    weights = np.array([0.2, -0.1, 0.05])
    pace = Pace(-0.4, weights, curvature + curvature.T, weights / (weights @ weights), weights, 0.5, np.ones(2))
    z = rng.standard_normal((20, 3))
    for change in (-0.3, 0.0, 0.2):
        made = pace.log_length(pace.longer(z, change, pace.direction)) - pace.log_length(z)
        np.testing.assert_allclose(made, change, atol=1e-9)
    same, seconds = pace.at_speed(z, 1.1, 1.7, np.exp(pace.log_length(z)) * 1.7 / 1.1)
    np.testing.assert_allclose(same, z, atol=1e-12)
    np.testing.assert_allclose(seconds, 1.1)


def test_few_people_are_weighed_against_what_is_published():
    people, x = np.repeat([0, 1], 4), np.tile(np.linspace(-0.3, 0.3, 4), 2)
    assert exponent(0.7 * x, x, people) == pytest.approx(0.5 + 0.2 * 0.03**2 / (0.03**2 + 0.05**2))
    assert exponent(0.7 * x, x, np.arange(8)) == EXPONENT  # one walk each tells nothing
    prior = np.array([1.0, -2.0])
    np.testing.assert_array_equal(direction(np.ones((8, 2)), x, np.arange(8), prior), prior)
    np.testing.assert_allclose(within(x, people).reshape(2, 4).sum(1), 0, atol=1e-12)


KNEE, ANKLE, NECK, HEAD = (NODES.index(name) for name in ("left_knee", "left_ankle", "neck", "head"))


@pytest.fixture(scope="module")
def people() -> list[Person]:
    rng = np.random.default_rng(0)
    return [draw_person(rng) for _ in range(4000)]


def column(people, name: str) -> np.ndarray:
    return np.array([getattr(person, name) for person in people])


def test_adults_are_as_tall_quick_and_long_of_step_as_published(people):
    heights, speeds, ratios = (column(people, name) for name in ("height", "speed", "walk_ratio"))
    assert heights.mean() == pytest.approx(0.5 * (1.756 + 1.629), abs=0.006)
    assert heights.std() == pytest.approx(np.hypot(0.0665, 0.0635), rel=0.05)  # within the sexes, and between them
    assert speeds.mean() == pytest.approx(1.32, abs=0.02)
    assert np.mean((ratios > 0.0040) & (ratios < 0.0065)) > 0.95
    assert ratios.mean() == pytest.approx(0.0056, abs=0.0001)
    for name in ("legs", "shoulders", "hips"):
        assert column(people, name).mean() == pytest.approx(1, abs=0.005)


def test_steps_are_as_long_as_speed_and_walk_ratio_say(people):
    for person in people[:20]:
        cadence = 60 * person.speed / person.step_length
        assert person.step_length / cadence == pytest.approx(person.walk_ratio)


def test_longer_legs_make_a_shorter_trunk_of_the_same_stature():
    average = from_height(1.0).offsets
    stature = lambda body: ANKLE_HEIGHT * body.height + body.offsets[[NECK, HEAD], 2].sum() - body.offsets[
        [KNEE, ANKLE], 2
    ].sum()  # fmt: skip
    top = 1 - stature(from_height(1.0))  # the skull above the head's node
    for legs in (0.94, 1.06):
        body = Person(1.8, legs, 1.1, 0.9, 1.3, 0.0056).body(average)
        assert body.offsets[KNEE, 2] == pytest.approx(1.8 * legs * average[KNEE, 2])
        assert stature(body) == pytest.approx(1.8 * (1 - top), abs=1.8 * top * 0.1)
        assert np.ptp(body.offsets[[3, 4], 1]) == pytest.approx(1.8 * 1.1 * np.ptp(average[[3, 4], 1]))
        assert np.ptp(body.offsets[[9, 10], 1]) == pytest.approx(1.8 * 0.9 * np.ptp(average[[9, 10], 1]))
        taller = Person(1.8, legs, 1.1, 0.9, 1.3, 0.0056).body(average, 2.0)
        np.testing.assert_allclose(taller.offsets, body.offsets * 2.0 / 1.8)


def test_people_are_as_large_as_those_a_model_learned_from():
    rng = np.random.default_rng(1)
    children = [draw_person(rng, about=1.2) for _ in range(500)]
    assert column(children, "height").mean() == pytest.approx(1.2, abs=0.02)
    assert column(children, "speed").mean() == pytest.approx(1.32 * np.sqrt(1.2 / 1.69), abs=0.03)
    assert draw_person(rng, height=1.91).height == 1.91
