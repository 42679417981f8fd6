"""What the service's JSON becomes: samples and lifted points are those of Python."""

import math

import numpy as np
import pytest

import motionenv
from motionenv.lifting import project_markers
from motionenv.models import cycle
from motionenv.models.paths import WalkPath
from motionenv.models.synthesis import synthesize
from motionenv.render.cameras import fit_view


def test_samples_are_those_of_the_tree(client):
    tree = motionenv.load("mixed/tree")
    before = motionenv.synthesize("walk/fpca", 1, 30, seed=3)
    drawn = client.tree_samples(before, 20, seed=7, temperature=0.2, method="exact")
    expected = tree.sample(before.poses, 20, seed=7, temperature=0.2, method="exact", probability=True)
    np.testing.assert_array_equal(drawn.poses, expected.poses)
    np.testing.assert_array_equal(drawn.windows, expected.windows)
    assert type(drawn) is type(expected)
    np.testing.assert_allclose(drawn.log_probability, expected.log_probability, atol=1e-12)
    assert client.tree_samples(tree.database_.activities[0], 3, seed=1).poses.shape == (3, 25)


def test_a_stride_is_that_of_python(client):
    how = {"deviations": [1.0], "speed": 1.3, "height": 1.6, "samples": 32}
    told, made = client.cycle("walk/eigenwalkers", **how), cycle("walk/eigenwalkers", **how)
    for name in ("markers", "poses", "standing", "contacts"):
        np.testing.assert_array_equal(getattr(told, name), getattr(made, name))
    np.testing.assert_array_equal(told.body.offsets, made.body.offsets)
    assert (told.stride, told.seconds, told.body.height) == (made.stride, made.seconds, 1.6)


def test_points_are_lifted_as_in_python(client):
    points = project_markers(
        motionenv.load("walk/eigenwalkers").synthesize_markers(3.0, 30, seed=5), math.radians(40.0)
    )
    positions = points.positions.copy()
    positions[::4, 7] = np.nan
    points = motionenv.Points(positions, points.fps, points.unit)
    told, found = client.lift(points), motionenv.lift(points)
    np.testing.assert_allclose(told.markers.positions, found.markers().positions, atol=1e-9)
    np.testing.assert_allclose(told.heading, found.heading, atol=1e-9)
    assert told.steady.alpha == pytest.approx(found.posterior.alpha, abs=1e-9)
    assert [o.alpha for o in told.steady.others] == pytest.approx([o.alpha for o in found.others], abs=1e-9)
    assert told.swapped.shape == (90, 2)
    assert client.lift(points, math.radians(40), elevation=None).plausible in (True, False)


def test_people_who_turn_and_leave_are_lifted_as_in_python(client):
    turning = synthesize("walk/fpca", 8, 30, seed=4, path=WalkPath.arc(1.6, 20.0), speed=1.1)
    places = motionenv.markers(turning.poses, turning.skeleton)
    pixels = fit_view(places, 0.4, width=640, height=480).project(places)[0]
    pixels[90:170] = np.nan
    points = motionenv.Points(pixels, 30.0, "px")
    told, found = client.lift(points), motionenv.lift(points)
    assert told.steady is None
    assert np.isnan(told.markers.positions[90:170]).all()
    np.testing.assert_allclose(told.markers.positions, found.positions, atol=1e-9)
    np.testing.assert_allclose(told.band, found.band, atol=1e-9)
    np.testing.assert_allclose(told.heading, found.heading, atol=1e-9)
    np.testing.assert_allclose(told.contact, found.contact, atol=1e-9)
    assert (told.unlike == found.unlike).all()
