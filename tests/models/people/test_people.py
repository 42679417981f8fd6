"""People: bodies and paces against the publications that they are drawn from; what speed does."""

import dataclasses
import warnings

import numpy as np
import pytest

import motionenv
from motionenv.body import LIMBS, from_height, limb_segments
from motionenv.body.limbs import GIRTHS
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.errors import ExtrapolationWarning, MotionError
from motionenv.models.people.pace import EXPONENT, Pace, direction, exponent, fit_pace, within
from motionenv.models.people.population import Person, average_person, draw_person
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
    assert knees.min() > -1.5
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
    assert heights.mean() == pytest.approx(0.5 * (1.742 + 1.605), abs=0.006)  # NHANES 2017-2018
    assert heights.std() == pytest.approx(np.hypot(0.0743, 0.0685), rel=0.05)  # within the sexes, and between them
    assert speeds.mean() == pytest.approx(1.32, abs=0.02)
    assert np.mean((ratios > 0.0040) & (ratios < 0.0065)) > 0.95
    assert ratios.mean() == pytest.approx(0.0056, abs=0.0001)
    for name in ("legs", "hips"):
        assert column(people, name).mean() == pytest.approx(1, abs=0.005)
    assert column(people, "shoulders").mean() == pytest.approx(1 + 0.117 * np.log(28 / 25), abs=0.005)


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


def drawn(kind: str, n: int = 3000) -> list[Person]:
    rng = np.random.default_rng(2)
    return [draw_person(rng, person=kind) for _ in range(n)]


def girths(people, name: str) -> np.ndarray:
    return np.array([person.girths[GIRTHS.index(name)] * person.height for person in people])


def test_women_and_men_have_the_weights_and_waists_that_were_measured():
    """Percentiles 5, 50, 95 of NHANES 2017-2018, 20 to 69 years, with 17 to 40 kg/m², and of its waists at 25 kg/m²."""
    for kind, bmi, waist in (("woman", (19.6, 27.7, 38.2), 0.545), ("man", (20.6, 28.1, 37.0), 0.524)):
        people = drawn(kind)
        values = column(people, "bmi")
        np.testing.assert_allclose(np.percentile(values, [5, 50, 95]), bmi, rtol=0.03)
        assert 17 <= values.min() < values.max() <= 40
        near = [person for person in people if abs(person.bmi - 25) < 1]
        # Heinz measured the narrowest waist, NHANES a wider one above the iliac crest.
        assert np.median(girths(near, "waist") / column(near, "height")) == pytest.approx(waist - 0.06, abs=0.03)
        exponent = np.polyfit(np.log(values), np.log(girths(people, "waist") / column(people, "height")), 1)[0]
        assert exponent == pytest.approx(0.707, abs=0.04)  # NHANES: 0.692 of women, 0.722 of men


def test_girths_differ_as_published_also_at_equal_weight(people):
    """Heinz et al. 2003, table 1: the hips of women relative to their chests, forearms and thighs of men."""
    women, men = drawn("woman"), drawn("man")
    for many, hips, forearm in ((women, 1.11, 0.266), (men, 0.968, 0.288)):
        near = [person for person in many if abs(person.bmi - 23.5) < 1.5]
        assert np.mean(girths(near, "hips") / girths(near, "chest")) == pytest.approx(hips, abs=0.015)
        assert np.mean(girths(near, "forearm") / girths(near, "hips")) == pytest.approx(forearm * 0.98, abs=0.02)
    same = [person for person in women if abs(person.bmi - 25) < 0.5]
    residual = np.array([np.log(person.girths) for person in same])
    assert 0.03 < residual.std(axis=0)[GIRTHS.index("waist")] < 0.07
    upper, fore, calf = (residual[:, GIRTHS.index(name)] for name in ("upper_arm", "forearm", "calf"))
    assert np.corrcoef(upper, fore)[0, 1] == pytest.approx(0.7, abs=0.15)
    assert np.corrcoef(upper, calf)[0, 1] == pytest.approx(0.07, abs=0.2)


def test_children_grow_and_have_large_heads():
    """CDC 2000: medians at 6 and 17 years are 1.15 and 1.63 m of girls, 1.15 and 1.75 m of boys; heads are large."""
    for kind, tallest in (("girl", 1.63), ("boy", 1.75)):
        people = drawn(kind)
        heights = column(people, "height")
        assert np.percentile(heights, 1) == pytest.approx(1.1, abs=0.06)
        assert np.percentile(heights, 95) == pytest.approx(tallest + 0.05, abs=0.06)
        small = heights < 1.25
        assert 13 < np.median(column(people, "bmi")[small]) < 17
        assert np.median(girths(people, "head")[small]) == pytest.approx(0.515, abs=0.02)
        assert np.median(girths(people, "chest")[(1.1 < heights) & (heights < 1.2)]) == pytest.approx(0.57, abs=0.02)
        assert np.median(column(people, "speed")[small]) == pytest.approx(1.32 * np.sqrt(1.18 / 1.69), abs=0.06)
        assert np.mean([p.girths[0] for p in people]) > 1.07 * np.mean([p.girths[0] for p in drawn("adult")])
    of_children = draw_person(np.random.default_rng(0), person="girl", about=1.2)
    assert of_children == draw_person(np.random.default_rng(0), person="girl")  # who is small already
    with pytest.raises(MotionError, match="person must be one of adult, woman, man, child, girl, boy, got 'gril': did"):
        draw_person(np.random.default_rng(0), person="gril")


def test_bodies_have_the_volume_of_their_weight():
    """People weigh 1.0 to 1.05 kg/l (Siri 1961). Ours lack flesh where limbs are straight cones: at most a fifth."""
    rng = np.random.default_rng(3)
    shares = []
    for kind in ("woman", "man", "child") * 4:
        person = draw_person(rng, person=kind)
        body = person.body(from_height(1.0).offsets)
        pose = np.zeros(25)
        pose[[2, 10, 14]] = 0.53 * body.height, 0.3, 0.3
        ends = limb_segments(pose, body)
        low, high = ends.min((0, 1)) - 0.2, ends.max((0, 1)) + 0.2
        points = rng.uniform(low, high, (60_000, 3))
        inside = np.zeros(len(points), bool)
        for (a, b), (first, last) in zip(ends, body.radii, strict=True):
            for t in np.linspace(0, 1, 20):
                inside |= ((points - a - t * (b - a)) ** 2).sum(1) < (first + t * (last - first)) ** 2
        shares.append(1020 * inside.mean() * np.prod(high - low) / person.weight)
    assert 0.8 < np.min(shares) < np.max(shares) < 1.15
    assert np.mean(shares) == pytest.approx(0.93, abs=0.08)


def test_who_is_asked_to_weigh_more_is_stouter_and_else_the_same(model):
    plain = model.synthesize(1, 30, seed=5)
    person = model.walker(seed=5)
    heavy = model.synthesize(1, 30, seed=5, weight=105.0)
    np.testing.assert_array_equal(heavy.poses[:, 3:], plain.poses[:, 3:])
    waist, hair = LIMBS.index("left_trunk"), LIMBS.index("hair")
    factor = (105.0 / person.person.weight) ** 0.712
    assert heavy.skeleton.radii[waist, 0] + 0.0115 * heavy.skeleton.height / 2 == pytest.approx(
        factor * (plain.skeleton.radii[waist, 0] + 0.0115 * plain.skeleton.height / 2), rel=0.02
    )
    np.testing.assert_array_equal(heavy.skeleton.radii[hair], plain.skeleton.radii[hair])
    assert heavy.skeleton.height == plain.skeleton.height
    given = model.synthesize(1, 30, seed=5, walker=person, weight=105.0)
    np.testing.assert_array_equal(given.skeleton.radii, heavy.skeleton.radii)
    with pytest.raises(MotionError, match=r"weight at a height of .* m must be a number of kg from .*, got 250"):
        model.synthesize(1, 30, walker=person, weight=250.0)


def test_children_walk_from_every_model(model):
    child = model.synthesize(2, 30, seed=3, person="child")
    assert child.skeleton.height < 1.9
    girl, boy = (model.walker(deviations=()).person for _ in range(2))
    assert girl == boy == average_person(girl.height)
    somebody = [model.synthesize(1, 30, seed=s, person="girl").skeleton.height for s in range(6)]
    assert np.mean(somebody) < 1.6


def test_arms_clear_a_broad_trunk():
    average = from_height(1.0).offsets
    for weight in (60.0, 85.0, 120.0):
        body = average_person(1.75).weighing(weight).body(average)
        pose = np.zeros(25)
        ends = limb_segments(pose, body)
        arm, trunk = LIMBS.index("left_upper_arm"), LIMBS.index("left_trunk")
        surface = ends[trunk, 0, 1] + body.radii[trunk, 0]
        assert ends[arm, 1, 1] > surface  # the elbow's centre is outside
        upper = body.offsets[NODES.index("left_elbow")]
        assert np.linalg.norm(upper) == pytest.approx(1.75 * np.linalg.norm(average[NODES.index("left_elbow")]))
