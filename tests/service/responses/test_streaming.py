"""Motion without end goes on smoothly when it is changed."""

import numpy as np
import pytest

import motionenv
from motionenv import MotionError
from motionenv.models.motion_tree import MotionGenerator, Options, Target
from service.errors import Problem
from service.model_registry import ModelRegistry
from service.responses.streaming import Stream
from service.schemas.stream import StreamSettings
from service.transport.access import EVERYTHING


def test_a_tree_is_steered_as_it_goes():
    tree = motionenv.load("mixed/tree")
    settings = StreamSettings(model="mixed/tree", seed=3)
    stream = Stream(lambda _: tree, settings)
    growth = MotionGenerator(tree, seed=[3, 0], options=Options(temperature=settings.temperature))
    for change, target in (({}, Target()), ({"heading": 60.0, "speed": 1.5}, Target(None, np.radians(60), 1.5))):
        stream.change(settings.model_copy(update=change))
        growth.target = target
        assert np.array_equal([stream.next() for _ in range(40)], growth.step(40))


def taken(stream: Stream, n: int) -> np.ndarray:
    return np.array([stream.next() for _ in range(n)])


@pytest.mark.parametrize("change", [{"speed": 0.6}, {"seed": 9}, {"deviations": [2.0, -2.0]}, {"height": 1.9}])
@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_a_walk_that_changes_goes_on_where_it_was(model, change):
    settings = StreamSettings(model=model, seed=1, fps=60, speed=1.3)
    stream = Stream(motionenv.load, settings)
    before = taken(stream, 100)
    stream.change(settings.model_copy(update=change))
    poses = np.concatenate([before, taken(stream, 200)])
    steps = np.abs(np.diff(poses, axis=0))
    own = steps[:99].max(axis=0)  # of the walk itself
    assert (steps[99:][:, 6:].max(axis=0) < 3 * own[6:] + 0.03).all()
    assert steps[:, :2].max() < 0.06
    assert (np.diff(poses[:, 0]) > -0.005).all()


@pytest.mark.parametrize("fps", [60, 120])
@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_a_change_of_speed_has_no_kink(model, fps):
    """Around it, angles and the root's way bend no more than they do elsewhere in both walks."""
    for moment in (1.1, 1.35, 1.6):
        settings = StreamSettings(model=model, seed=1, fps=fps, speed=1.3)
        stream, changed = Stream(motionenv.load, settings), round(moment * fps)
        before = taken(stream, changed)
        stream.change(settings.model_copy(update={"speed": 1.6}))
        poses = np.concatenate([before, taken(stream, 3 * fps)])
        bends = np.abs(np.diff(poses, 2, axis=0))
        near = slice(changed - 2, changed + fps // 2)
        own = np.delete(bends, near, axis=0).max(axis=0)
        assert bends[near][:, 3:].max() < 1.1 * own[3:].max()
        steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) * fps
        assert np.abs(np.diff(steps))[near].max() < 0.5  # [m/s]: it stood still for a frame, which were 2.8


def test_a_walk_without_end_is_longer_than_its_pieces():
    """Half a minute at a time, of another seed each, so that no piece is the one before."""
    stream = Stream(motionenv.load, StreamSettings(seed=1, fps=10, speed=1.2))
    poses = taken(stream, 700)
    assert poses[-1, 0] / 70 == pytest.approx(1.2, rel=0.1)
    assert np.abs(np.diff(poses[:, 3:], axis=0)).max() < 1.2
    assert not np.array_equal(poses[:300, 6:], poses[300:600, 6:])


def test_standing_still_changes_nothing():
    settings = StreamSettings(seed=1)
    paused, other = Stream(motionenv.load, settings), Stream(motionenv.load, settings)
    taken(paused, 10)
    paused.change(settings.model_copy(update={"paused": True}))
    assert paused.settings.paused
    paused.change(settings)
    np.testing.assert_array_equal(taken(paused, 20), taken(other, 30)[10:])


def test_settings_that_can_not_be_leave_the_motion_as_it_was(tmp_path):
    settings, registry = StreamSettings(seed=1), ModelRegistry(tmp_path)
    models = lambda name: motionenv.load(name) if name == "walk/fpca" else registry.get(name, EVERYTHING)
    stream, other = Stream(models, settings), Stream(models, settings)
    with pytest.raises(MotionError, match="deviations must be up to 8 finite numbers"):
        stream.change(settings.model_copy(update={"deviations": [0.0] * 9}))
    with pytest.raises(Problem, match="there is no model 'fitted/nobody'"):
        stream.change(settings.model_copy(update={"model": "fitted/nobody"}))
    assert stream.settings == settings
    np.testing.assert_array_equal(taken(stream, 20), taken(other, 20))
