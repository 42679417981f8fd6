"""Dots, lines and stick figures against supersampling and the closed forms that they should keep."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from motionenv.body import EDGES, from_height, markers
from motionenv.errors import MotionError
from motionenv.render import cameras
from motionenv.render.draw2d import shapes as drawing
from motionenv.render.draw2d.point_lights import render_points
from motionenv.render.draw2d.shapes import as_colours, draw_lines

FLAT = cameras.Orthographic(alpha=0.0, scale=1.0, target=(0, 0, 0), width=41, height=31)


@njit(error_model="numpy")
def disc_cover(x, y, radius):
    """The part of that name, for Python."""
    return drawing.disc_cover(x, y, radius)


@njit(error_model="numpy")
def draw_disc(image, x, y, radius, colour):
    """The part of that name, for Python."""
    drawing.draw_disc(image, x, y, radius, colour)


def draw_line(image, ax, ay, bx, by, width, colour):
    """One of `draw_lines`."""
    drawing.draw_lines(image, np.array([[ax, ay, bx, by]]), width, colour)


def supersampled(inside, height, width, n=64) -> np.ndarray:
    """Share of each pixel where `inside(x, y)` holds, by n × n samples per pixel."""
    fine = (np.arange(n) + 0.5) / n - 0.5
    y = (np.arange(height)[:, None] + fine).ravel()
    x = (np.arange(width)[:, None] + fine).ravel()
    hit = inside(x[None, :], y[:, None])
    return hit.reshape(height, n, width, n).mean((1, 3))


@pytest.mark.parametrize(("x", "y", "radius"), [(10.3, 8.7, 4.0), (5.0, 5.0, 0.3), (12.5, 3.1, 1.0), (0.2, 14.0, 2.6)])
def test_disc_covers_pixels_as_supersampling_says(x, y, radius):
    image = np.zeros((16, 24, 3), dtype=np.uint8)
    draw_disc(image, x, y, radius, np.array([255.0, 255.0, 255.0]))
    truth = supersampled(lambda u, v: np.hypot(u - x, v - y) < radius, 16, 24)
    assert np.abs(image[..., 0] / 255 - truth).max() < 0.006


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.2, 6))
def test_cover_adds_up_to_the_discs_area(x, y, radius):
    """The light of a dot doesn't depend on where it lies between the pixels."""
    cover = sum(disc_cover(i - x, j - y, radius) for i in range(-8, 9) for j in range(-8, 9))
    assert cover == pytest.approx(math.pi * radius**2, rel=1e-9)


def test_line_covers_pixels_nearly_as_supersampling_says():
    image = np.zeros((32, 40, 3), dtype=np.uint8)
    a, b, width = np.array([5.3, 6.1]), np.array([30.8, 21.4]), 3.0
    draw_line(image, *a, *b, width, np.array([255.0, 255.0, 255.0]))

    def inside(u, v):
        along = np.clip(((u - a[0]) * (b - a)[0] + (v - a[1]) * (b - a)[1]) / ((b - a) @ (b - a)), 0, 1)
        return np.hypot(u - a[0] - along * (b - a)[0], v - a[1] - along * (b - a)[1]) < width / 2

    truth = supersampled(inside, 32, 40)
    assert np.abs(image[..., 0] / 255 - truth).max() < 0.12
    assert image[..., 0].sum() / 255 == pytest.approx(truth.sum(), rel=0.01)


def test_drawing_outside_the_picture_leaves_it_alone():
    image = np.full((9, 9, 3), 7, dtype=np.uint8)
    white = np.array([255.0, 255.0, 255.0])
    for x, y in [(-20, 4), (1e300, 4), (4, -1e300), (np.nan, 3), (np.inf, 3)]:
        draw_disc(image, x, y, 3.0, white)
        draw_line(image, x, y, x, y, 2.0, white)
    assert (image == 7).all()


def centroid(image) -> np.ndarray:
    weight = image[..., 0].astype(float)
    y, x = np.indices(weight.shape)
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


def test_dot_lies_where_the_camera_projects_it():
    camera = cameras.view(0.7, width=160, height=120)
    point = np.array([[0.21, -0.13, 1.3]])
    np.testing.assert_allclose(centroid(render_points(point, camera)), camera.project(point)[0][0], atol=0.02)


def test_orthographic_dot_keeps_its_place_and_size_at_any_depth():
    near, far = (render_points([[3.3, y, 4.2]], FLAT) for y in (-100.0, 100.0))
    np.testing.assert_array_equal(near, far)
    np.testing.assert_allclose(centroid(near), [23.3, 10.8], atol=0.02)


def test_nearer_dots_cover_farther_ones():
    points = np.array([[0.0, 5.0, 0.0], [0.0, -5.0, 0.0]])  # the second is nearer at α = 0
    colours = [(255, 0, 0), (0, 255, 0)]
    for order in ([0, 1], [1, 0]):
        image = render_points(points[order], FLAT, colour=[colours[i] for i in order])
        assert image[15, 20].tolist() == [0, 255, 0]


def test_missing_and_hidden_markers_are_not_drawn():
    camera = cameras.view(0.0, width=64, height=48)
    points = np.array([[0, 0, 1], [np.nan, 0, 1], [0, -50, 1]], dtype=float)
    np.testing.assert_array_equal(render_points(points, camera), render_points(points[:1], camera))
    assert not render_points(points[1:], camera).any()


def test_batches_and_moving_cameras_are_drawn_as_one_by_one():
    rng = np.random.default_rng(0)
    points = rng.normal((0, 0, 1), 0.4, (2, 3, 15, 3))
    many = [cameras.view(a, width=50, height=40) for a in (0.0, 0.5, 1.0)]
    batch = render_points(points, many, radius=2, lines=True)
    assert batch.shape == (2, 3, 40, 50, 3)
    for i in range(2):
        for t in range(3):
            np.testing.assert_array_equal(batch[i, t], render_points(points[i, t], many[t], radius=2, lines=True))


def test_figure_of_a_body_reads_as_one():
    """From the front the dots of the standing body are as wide and tall as its markers; lines connect them."""
    body = from_height(1.8)
    poses = np.zeros(25)
    poses[2] = 0.95
    points = markers(poses, body)
    picture = cameras.Orthographic(alpha=math.pi / 2, scale=100, width=200, height=240)
    dots = render_points(points, picture, radius=3, background=(10, 20, 30), colour=(250, 240, 230))
    assert dots[0, 0].tolist() == [10, 20, 30]
    rows, columns = np.nonzero(dots[..., 0] > 130)
    spread = np.ptp(picture.project(points)[0], axis=0)
    np.testing.assert_allclose([np.ptp(columns), np.ptp(rows)], spread + 5, atol=1.0)
    lines = render_points(points, picture, radius=3, lines=True)
    a, b = EDGES[-1]
    middle = picture.project((points[a] + points[b]) / 2)[0].round().astype(int)
    assert lines[middle[1], middle[0]].tolist() == [255, 255, 255]


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: render_points(np.zeros((15, 2)), FLAT), "points must have shape"),
        (lambda: render_points(np.zeros((15, 3)), FLAT, radius=0), "radius"),
        (lambda: render_points(np.zeros((15, 3)), FLAT, colour=(0, 0, 256)), "colour"),
        (lambda: render_points(np.zeros((15, 3)), FLAT, background=(0, 0)), "background"),
        (lambda: render_points(np.zeros((14, 3)), FLAT, lines=True), "15 markers"),
        (lambda: render_points(np.zeros((15, 3)), [FLAT]), "1 cameras"),
    ],
)
def test_bad_input_says_what_is_wrong(call, match):
    with pytest.raises(MotionError, match=match):
        call()


def test_a_line_is_as_wide_as_asked_and_has_round_ends():
    image = np.zeros((21, 21, 3), dtype=np.uint8)
    draw_lines(image, np.array([[5.0, 10.0, 15.0, 10.0]]), 4.0, np.array([255.0, 255.0, 255.0]))
    assert image[:, 10, 0].sum() / 255 == pytest.approx(4.0, abs=0.02)
    assert image[..., 0].sum() / 255 == pytest.approx(4.0 * 10 + np.pi * 2**2, rel=0.02)
    np.testing.assert_array_equal(image, image[::-1])
    np.testing.assert_array_equal(image, image[:, ::-1])


def test_one_colour_serves_all_points_and_others_are_refused():
    assert as_colours((1, 2, 3), 4).tolist() == [[1.0, 2.0, 3.0]] * 4
    assert as_colours(np.eye(3) * 255, 3).tolist() == (np.eye(3) * 255).tolist()
    for bad in ((0, 0, 256), (-1, 0, 0), (0, 0), np.zeros((2, 3)), (np.nan, 0, 0)):
        with pytest.raises(MotionError, match=r"dots must be \(R, G, B\) from 0 to 255, or 4 of them, got"):
            as_colours(bad, 4, "dots")
