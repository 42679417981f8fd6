"""View angles against scipy's rotations and a pinhole camera far away."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.lifting.view_geometry import axes, depth, project
from motionenv.render.cameras import look_at

angles = st.floats(-10, 10)


@given(angles, st.floats(-1.5, 1.5))
def test_axes_are_those_of_a_camera_that_turns_and_then_looks_down(alpha, elevation):
    level = np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]])  # across x, upwards z, away y
    turned = Rotation.from_euler("z", alpha) * Rotation.from_euler("x", -elevation)
    np.testing.assert_allclose(axes(alpha, elevation), turned.apply(level), atol=1e-12)


def test_from_the_side_one_walks_to_the_right_and_from_the_front_towards_one():
    np.testing.assert_allclose(axes(0.0), [[1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-12)
    across, _, away = axes(np.pi / 2)
    np.testing.assert_allclose(across, [0, 1, 0], atol=1e-12)  # the walker's left is to the right
    np.testing.assert_allclose(away, [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("alpha", "elevation"), [(0.3, 0.0), (-2.0, 0.4), (2.5, -0.7)])
def test_a_camera_far_away_sees_what_is_projected_and_how_far_it_is(alpha, elevation):
    w = np.random.default_rng(0).standard_normal((5, 15, 3))
    level = np.cos(elevation)
    eye = 1e5 * np.array([np.sin(alpha) * level, -np.cos(alpha) * level, np.sin(elevation)])
    camera = look_at(eye, (0, 0, 0))
    pixels, away = camera.project(w)
    middle, distance = camera.project(np.zeros(3))
    seen = (pixels - middle) * distance / camera.K[0, 0] * [1, -1]
    np.testing.assert_allclose(project(w, alpha, elevation), seen, atol=1e-3)
    np.testing.assert_allclose(depth(w, alpha, elevation), away - distance, atol=1e-3)


def test_views_broadcast_with_walkers_and_nothing_is_lost():
    w = np.random.default_rng(1).standard_normal((4, 5, 15, 3))
    alpha, elevation = np.array([0.0, 1.0, -2.0, 4.0]), 0.3
    flat, away = project(w, alpha, elevation), depth(w, alpha, elevation)
    assert (flat.shape, away.shape) == ((4, 5, 15, 2), (4, 5, 15))
    np.testing.assert_allclose(project(w[2], alpha[2], elevation), flat[2], atol=1e-12)
    np.testing.assert_allclose((flat**2).sum(-1) + away**2, (w**2).sum(-1))
