"""Discs and lines against pictures of many times the resolution."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.render.draw2d.shapes import as_colours, draw_figures, draw_lines

FINE = 40  # samples a pixel, across and down
WHITE = np.array([[255.0, 255.0, 255.0]])


def disc(x: float, y: float, radius: float, size: int = 12) -> np.ndarray:
    """A picture of one dot."""
    image = np.zeros((1, size, size, 3), dtype=np.uint8)
    none = np.empty((0, 2), dtype=np.intp)
    draw_figures(image, np.array([[[x, y]]]), np.ones((1, 1)), none, WHITE, radius=radius, width=1.0)
    return image[0, ..., 0]


@pytest.mark.parametrize(("x", "y", "radius"), [(5, 5, 3), (5.3, 6.7, 2.6), (4.5, 5.5, 0.4), (0.2, 11.4, 3.3)])
def test_a_disc_covers_each_pixel_by_its_area(x, y, radius):
    at = (np.arange(12 * FINE) + 0.5) / FINE - 0.5
    inside = np.hypot(at[None] - x, at[:, None] - y) < radius
    cover = inside.reshape(12, FINE, 12, FINE).mean((1, 3))
    assert np.abs(disc(x, y, radius) - 255 * cover).max() < 2.0


def test_nothing_is_drawn_for_points_that_are_not_known():
    assert not disc(np.nan, 3.0, 2.0).any()
    image = np.zeros((9, 9, 3), dtype=np.uint8)
    draw_lines(image, np.array([[1.0, 1.0, np.nan, 5.0]]), 2.0, WHITE[0])
    assert not image.any()


def test_a_line_is_as_wide_as_asked_and_has_round_ends():
    image = np.zeros((21, 21, 3), dtype=np.uint8)
    draw_lines(image, np.array([[5.0, 10.0, 15.0, 10.0]]), 4.0, WHITE[0])
    assert image[:, 10, 0].sum() / 255 == pytest.approx(4.0, abs=0.02)
    assert image[..., 0].sum() / 255 == pytest.approx(4.0 * 10 + np.pi * 2**2, rel=0.02)
    np.testing.assert_array_equal(image, image[::-1])
    np.testing.assert_array_equal(image, image[:, ::-1])


def test_near_dots_hide_far_ones():
    image = np.zeros((1, 9, 9, 3), dtype=np.uint8)
    pixels = np.full((1, 2, 2), 4.0)
    none = np.empty((0, 2), dtype=np.intp)
    colours = np.array([[255.0, 0.0, 0.0], [0.0, 255.0, 0.0]])
    draw_figures(image, pixels, np.array([[1.0, 2.0]]), none, colours, radius=2.0, width=1.0)
    assert image[0, 4, 4].tolist() == [255, 0, 0]


def test_one_colour_serves_all_points_and_others_are_refused():
    assert as_colours((1, 2, 3), 4).tolist() == [[1.0, 2.0, 3.0]] * 4
    assert as_colours(np.eye(3) * 255, 3).tolist() == (np.eye(3) * 255).tolist()
    for bad in ((0, 0, 256), (-1, 0, 0), (0, 0), np.zeros((2, 3)), (np.nan, 0, 0)):
        with pytest.raises(MotionError, match=r"dots must be \(R, G, B\) from 0 to 255, or 4 of them, got"):
            as_colours(bad, 4, "dots")
