"""Overlays and compositions: the right pixels change, and no others."""

import numpy as np
import pytest

from motionenv.body import EDGES, from_height, markers
from motionenv.errors import MotionError
from motionenv.render import cameras
from motionenv.render.draw2d.overlay import LEFT, MIDDLE, RIGHT, draw_pose, side_by_side, strip
from motionenv.types import MARKERS

CAMERA = cameras.view(np.pi / 2, width=160, height=120)


def figure() -> np.ndarray:
    poses = np.zeros(25)
    poses[2] = 0.95
    return markers(poses, from_height(1.7))


def noise(*shape) -> np.ndarray:
    return np.random.default_rng(0).integers(0, 255, (*shape, 3), dtype=np.uint8)


def test_pose_is_drawn_on_its_limbs_and_nowhere_else():
    under = noise(120, 160)
    before = under.copy()
    over = draw_pose(under, figure(), CAMERA, colour=(0, 0, 0))
    np.testing.assert_array_equal(under, before)
    pixels = CAMERA.project(figure())[0]
    y, x = np.indices((120, 160))
    distance = np.full((120, 160), np.inf)
    for a, b in EDGES:
        for s in np.linspace(0, 1, 200):
            u, v = pixels[a] + s * (pixels[b] - pixels[a])
            distance = np.minimum(distance, np.hypot(x - u, y - v))
    joints = np.min([np.hypot(x - u, y - v) for u, v in pixels], axis=0)
    assert (over[(distance < 0.9) | (joints < 2.2)] == 0).all()
    away = (distance > 2.1) & (joints > 3.8)
    np.testing.assert_array_equal(over[away], before[away])


def test_sides_have_their_colours():
    over = draw_pose(np.zeros((120, 160, 3), dtype=np.uint8), figure(), CAMERA, width=2.0)
    for name, colour in (("left_wrist", LEFT), ("right_knee", RIGHT), ("pelvis", MIDDLE)):
        u, v = CAMERA.project(figure()[MARKERS.index(name)])[0].round().astype(int)
        assert tuple(over[v, u]) == colour


def test_missing_markers_leave_the_rest():
    points = figure()
    points[MARKERS.index("left_ankle")] = np.nan
    under = np.zeros((120, 160, 3), dtype=np.uint8)
    some, whole = draw_pose(under, points, CAMERA), draw_pose(under, figure(), CAMERA)
    assert 0 < (some != whole).any(-1).sum() < 150
    assert not draw_pose(under, np.full((15, 3), np.nan), CAMERA).any()


def test_side_by_side_keeps_both_pictures():
    a, b = noise(2, 5, 4), noise(2, 5, 7)
    both = side_by_side(a, b, gap=3)
    assert both.shape == (2, 5, 14, 3)
    np.testing.assert_array_equal(both[:, :, :4], a)
    np.testing.assert_array_equal(both[:, :, 7:], b)
    assert not both[:, :, 4:7].any()


def test_strip_shows_equally_spaced_frames():
    frames = np.broadcast_to(np.arange(11, dtype=np.uint8)[:, None, None, None], (11, 3, 2, 3))
    row = strip(frames, 6, gap=1)
    assert row.shape == (3, 17, 3)
    assert row[0, ::3, 0].tolist() == [0, 2, 4, 6, 8, 10]
    assert not row[:, 2::3].any()
    np.testing.assert_array_equal(strip(list(frames), 1), frames[0])


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: draw_pose(np.zeros((120, 160, 3)), figure(), CAMERA), "uint8"),
        (lambda: draw_pose(noise(120, 161), figure(), CAMERA), "160 x 120"),
        (lambda: draw_pose(noise(120, 160), figure()[:14], CAMERA), "must agree"),
        (lambda: draw_pose(noise(2, 120, 160), figure(), CAMERA), "must agree"),
        (lambda: draw_pose(noise(120, 160), figure(), CAMERA, width=-1), "width"),
        (lambda: side_by_side(noise(4, 4), noise(5, 4)), "same number of images"),
        (lambda: side_by_side(noise(4, 4), np.zeros((4, 4))), "right must be uint8"),
        (lambda: strip(noise(3, 4, 4), 4), "got 4"),
        (lambda: strip(noise(3, 4, 4), 0), "got 0"),
    ],
)
def test_bad_input_says_what_is_wrong(call, match):
    with pytest.raises(MotionError, match=match):
        call()
