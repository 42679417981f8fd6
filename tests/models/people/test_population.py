"""Drawn adults against the published figures, and their bodies against those figures' arithmetic."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.body.skeleton import ANKLE_HEIGHT, NODES
from motionenv.models.people.population import Person, draw_person

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
