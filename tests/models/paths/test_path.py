"""Curves on the ground against closed forms, and what random ones promise."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.paths import WalkPath, random_path


@pytest.mark.parametrize("angle", [2.5, -4.0])
def test_an_arc_lies_on_its_circle(angle):
    path = WalkPath.arc(1.7, angle, heading=0.4, start=(2.0, -1.0))
    s = np.linspace(0, path.length, 777)
    centre = np.array([2.0, -1.0]) + np.sign(angle) * 1.7 * np.array([-np.sin(0.4), np.cos(0.4)])
    np.testing.assert_allclose(np.linalg.norm(path.position(s) - centre, axis=-1), 1.7, atol=1e-9)
    np.testing.assert_allclose(path.heading(s), 0.4 + s / 1.7 * np.sign(angle), atol=1e-9)
    np.testing.assert_allclose(path.curvature(s), np.sign(angle) / 1.7, rtol=1e-6)
    assert path.length == pytest.approx(1.7 * abs(angle))


def test_beyond_its_ends_a_path_goes_straight_on():
    path = WalkPath.arc(2.0, 1.0)
    tip, way = path.position(2.0), np.array([np.cos(1.0), np.sin(1.0)])
    np.testing.assert_allclose(path.position([2.5, 4.0]), tip + np.outer([0.5, 2.0], way), atol=1e-12)
    np.testing.assert_allclose(path.position(-3.0), [-3.0, 0.0])
    np.testing.assert_array_equal(path.curvature([-0.1, 2.1]), 0.0)


def test_a_path_goes_through_its_points():
    points = np.array([[0, 0], [2, 0.5], [5, -1], [8, 2], [6, 5]], dtype=float)
    path = WalkPath.through(points)
    s = np.linspace(0, path.length, 20_000)
    gaps = np.linalg.norm(path.position(s)[:, None] - points, axis=-1).min(axis=0)
    assert gaps.max() < 1e-3
    steps = np.linalg.norm(np.diff(path.position(s), axis=0), axis=-1)
    np.testing.assert_allclose(steps, s[1], rtol=1e-4)  # arc length


def test_position_and_heading_are_integrals_of_heading_and_curvature():
    path = random_path(np.random.default_rng(5), 12.0, radius=1.0, scale=1.0, heading=2.0, start=(1.0, 2.0))
    s = np.linspace(0, 12.0, 24_001)
    velocity = np.gradient(path.position(s), s, axis=0)
    np.testing.assert_allclose(velocity, np.stack([np.cos(path.heading(s)), np.sin(path.heading(s))], -1), atol=2e-3)
    middle = 0.5 * (s[1:] + s[:-1])
    np.testing.assert_allclose(np.diff(path.heading(s)) / s[1], path.curvature(middle), atol=2e-2)
    assert path.heading(0.0) == 2.0


def test_random_paths_keep_their_radius_and_wind_both_ways():
    paths = [random_path(np.random.default_rng(seed), 30.0, radius=1.5) for seed in range(10)]
    bends = np.array([path.curvature(np.linspace(0, 30, 3001)) for path in paths])
    assert np.abs(bends).max() <= 1 / 1.5
    assert (bends > 0.1).any(axis=1).all()
    assert (bends < -0.1).any(axis=1).all()
    again = random_path(np.random.default_rng(3), 30.0, radius=1.5)
    np.testing.assert_array_equal(again.headings, paths[3].headings)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: WalkPath.arc(0.3, 1.0), "radius must be"),
        (lambda: WalkPath.arc(2.0, 0.0), "angle must not be 0"),
        (lambda: WalkPath.line(-1.0), "length"),
        (lambda: WalkPath.through([(0, 0)]), "at least two"),
        (lambda: WalkPath.through([(0, 0), (0, 0)]), "no two in a row"),
        (lambda: WalkPath.through([(0, 0), (1, 0), (1, 0.2), (0, 0.2)]), "radius of .* people need 0.6 m"),
        (lambda: WalkPath([0.0, np.nan], 1.0, (0, 0)), "finite"),
        (lambda: random_path(np.random.default_rng(0), 5.0, radius=0.1), "radius must be"),
    ],
)
def test_curves_that_nobody_can_walk_are_refused(make, match):
    with pytest.raises(MotionError, match=match):
        make()
