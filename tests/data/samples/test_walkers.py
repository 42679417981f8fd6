from types import SimpleNamespace

import numpy as np
import pytest

from motionenv import gait
from motionenv.data import Specification
from motionenv.data.samples.walkers import (
    PASSERS,
    WALKERS,
    contacts,
    frames_of,
    generator,
    joints_in,
    mean_heading,
    phases,
    record,
    shown,
    turned,
)
from motionenv.errors import MotionError
from motionenv.models.registry import gait_model
from motionenv.models.synthesis import synthesize
from motionenv.types import POSE, Motion

SPEC = Specification(clip=30, people={"turning": 0.5})


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_contacts_are_those_that_gait_analysis_finds(model):
    errors = []
    for seed in range(5):
        motion = synthesize(model, 6, 100, seed=seed)
        events = gait.find_events(gait.feet_of(motion)).events
        found = contacts(motion)
        for side, name in enumerate(("left", "right")):
            turns = np.flatnonzero(np.diff(found[:, side].astype(int)))
            wanted = [event.time for event in events if event.side == name]
            assert len(turns) >= 6
            errors += [min(abs(time - (turn + 0.5) / 100) for time in wanted) for turn in turns]
        assert 0.5 < found.mean() < 0.72  # stance is about 60 % of a stride
    assert np.median(errors) < 0.03  # [s], a frame at 30 Hz


def test_phase_is_that_of_the_model():
    model = gait_model("walk/fpca")
    motion = model.synthesize(8, 60, seed=5, variation=0.0, phase=0.3)
    found = np.unwrap(2 * np.pi * phases(motion)) / (2 * np.pi)
    rate = np.diff(found)
    assert rate.min() > 0
    assert np.ptp(rate) < 0.02 * rate.mean()
    assert abs((found[0] - 0.3 + 0.5) % 1 - 0.5) < 0.06  # the model's phase 0 is fitted, this one is of the ankles


def test_phase_needs_strides():
    motion = synthesize("walk/fpca", 0.5, 30, seed=1)
    with pytest.raises(MotionError, match="too slow for a phase: raise people.speed"):
        phases(motion)


def test_groups_depend_on_seed_and_number_alone():
    first, again = record(SPEC, 3), record(SPEC.replace(frames=7, output={"picture": "webp"}), 3)
    assert all(np.array_equal(a.poses, b.poses) for a, b in zip(first, again, strict=True))
    others = [record(SPEC, 4), record(SPEC.replace(seed=1), 3), record(SPEC, 3, PASSERS)]
    assert all(not np.array_equal(first[0].poses, other[0].poses) for other in others)
    assert len(first) == WALKERS
    assert len(first[0].poses) == frames_of(SPEC)[0] == len(first[0].phase) == len(first[0].contact)
    assert generator(1, 2, 3).random() == generator(1, 2, 3).random() != generator(1, 3, 2).random()


def test_about_half_turn_and_nobody_leaves_the_ground():
    people = [one for group in range(4) for one in record(SPEC, group)]
    headings = [np.unwrap(one.poses[:, POSE.index("root_heading")]) for one in people]
    turning = np.mean([np.ptp(heading) > 0.5 for heading in headings])
    assert 0.25 < turning < 0.7
    for one in people:
        floor = joints_in(one.poses[None], one.skeleton.offsets[None])[0, :, -2:, 2].min(axis=1)
        assert floor.min() > 0
        assert np.median(floor) < 0.08 * one.skeleton.height


def test_models_that_do_not_walk_are_refused(monkeypatch):
    restless = SimpleNamespace(kind="tree", steady=False)  # as mixed/tree, which takes seconds to load
    monkeypatch.setattr("motionenv.data.samples.walkers.gait_model", lambda name: restless)
    spec = SPEC.replace(people={"models": ["restless"]})
    with pytest.raises(MotionError, match="people.models takes models that walk steadily"):
        record(spec, 0)


def test_turning_moves_everything_about_the_origin():
    people = record(SPEC, 0)[:3]
    poses, offsets, _, heights = shown(people, np.array([2, 0]), np.arange(5)[None] + [[0], [7]])
    assert np.array_equal(poses[1], people[0].poses[7:12])
    assert heights.tolist() == [people[2].skeleton.height, people[0].skeleton.height]
    before, angle = joints_in(poses, offsets), np.array([0.3, -1.1])
    heading = mean_heading(poses)
    turned(poses, angle)
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], 1)
    after = joints_in(poses, offsets)
    expected = np.einsum("nij,ntkj->ntki", rotation, before[..., :2])
    np.testing.assert_allclose(after[..., :2], expected, atol=1e-12)
    np.testing.assert_allclose(mean_heading(poses), heading + angle, atol=1e-12)
    assert isinstance(Motion(poses[0], people[2].skeleton, 30.0), Motion)
