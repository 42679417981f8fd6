"""`render` is the engine that is asked for, for one picture or many."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.render import Raycaster, Scene
from motionenv.render.api import render
from motionenv.render.cameras import look_at

SKELETON = from_height(1.75)


def camera(eye=(1.0, -3.5, 1.2), size=64):
    return look_at(eye, (0, 0, 0.9), width=size, height=size)


def test_it_draws_what_the_raycaster_does_in_the_scene_that_is_given(walking):
    scene = Scene(shirt=(1.0, 0.0, 0.0), ground=False)
    one, other = render(walking(2), SKELETON, camera(), scene=scene), Raycaster(scene)
    again = other.render(walking(2), SKELETON, camera())
    for name in ("rgb", "depth", "limbs"):
        np.testing.assert_array_equal(getattr(one, name), getattr(again, name))
    assert (one.rgb != render(walking(2), SKELETON, camera()).rgb).any()


def test_background_is_zero_and_infinite_and_colour_is_optional(walking):
    frame = render(walking(2), SKELETON, camera(), rgb=False)
    assert frame.rgb is None
    np.testing.assert_array_equal(frame.limbs == 0, np.isinf(frame.depth))
    assert 0.02 < (frame.limbs > 0).mean() < 0.5


def test_poses_and_cameras_broadcast(walking):
    views = [camera(), camera((3, 0, 1.5)), camera((0, 3, 1.5))]
    poses = walking(3)
    assert render(poses[0], SKELETON, views[0]).rgb.shape == (64, 64, 3)
    assert render(poses[0], SKELETON, views).depth.shape == (3, 64, 64)
    assert render(poses[:2, None], SKELETON, views).limbs.shape == (2, 3, 64, 64)
    paired = render(poses, SKELETON, views)
    for i in range(3):
        np.testing.assert_array_equal(paired.rgb[i], render(poses[i], SKELETON, views[i]).rgb)


def test_empty_batch():
    frame = render(np.zeros((0, 25)), SKELETON, camera())
    assert frame.rgb.shape == (0, 64, 64, 3)


def test_an_engine_that_there_is_not_is_refused_with_those_that_there_are(walking):
    with pytest.raises(MotionError, match="engine must be one of raycast, pyrender, got 'opengl'"):
        render(walking(1), SKELETON, camera(), engine="opengl")
