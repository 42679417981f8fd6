"""Who is where in a film, and the camera that could have seen it, against a body that stands before a known camera."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.render import render
from motionenv.render.cameras import look_at, view
from motionenv.tracking.video.detection import resized, side_camera, span, standing_height


def detections(masks: np.ndarray) -> np.ndarray:
    """Boxes (T, 4) around masks (T, height, width); NaN around none."""
    found = np.full((len(masks), 4), np.nan)
    for t, mask in enumerate(masks):
        rows, columns = np.nonzero(mask)
        if len(rows):
            found[t] = columns.min(), columns.max(), rows.min(), rows.max()
    return found


def test_a_guessed_camera_puts_the_person_on_the_ground(crossing):
    _, _, _, skeleton, masks = crossing
    boxes = detections(masks.astype(float))
    guess = side_camera(boxes, skeleton, 256, 192)
    feet = guess.project(np.zeros(3))[0]
    crown = guess.project(np.array([0.0, 0.0, skeleton.height]))[0]
    assert feet[1] == pytest.approx(np.median(boxes[:, 3]), abs=2)
    assert feet[1] - crown[1] == pytest.approx(np.median(boxes[:, 3] - boxes[:, 2]), rel=0.05)
    small = resized(guess, 128, 96)
    np.testing.assert_allclose(small.project(np.ones(3))[0] + 0.5, (guess.project(np.ones(3))[0] + 0.5) / 2)


def test_height_by_a_known_camera(crossing):
    _, camera, _, _, masks = crossing
    boxes = detections(masks.astype(float))
    assert standing_height(boxes, camera) == pytest.approx(1.75, rel=0.04)
    high = look_at((0, -6, 4), (0, 0, 0.5), width=256, height=192)
    seen, _ = high.project(np.array([[0.0, 0, 1.6], [0, 0, 0]]))
    box = [seen[0, 0] - 9, seen[0, 0] + 9, seen[0, 1] + 0.5, seen[1, 1] - 0.5]
    assert standing_height(np.array([box]), high) == pytest.approx(1.6, rel=1e-3)
    with pytest.raises(MotionError, match="contradicts the picture"):
        standing_height(boxes - [0, 0, 0, 60], camera)


def test_when_somebody_is_there():
    boxes = np.full((20, 4), np.nan)
    boxes[3:6] = [0, 10, 5, 30]
    boxes[6:15] = [20, 30, 5, 30]
    assert span(boxes, 64) == (6, 15)
    with pytest.raises(MotionError, match="whole person"):
        span(boxes[:9], 64)


@pytest.mark.parametrize("eyes", [1.0, 1.5, 3.0])
def test_a_guess_puts_the_body_into_its_box_whatever_the_true_camera(eyes):
    """From one place height and tilt can't be told apart, but who stands at the origin fills the box."""
    body, camera = from_height(1.7), look_at((0, -6, eyes), (0, 0, 0.9), width=200, height=150, fov_degrees=40)
    pose = np.eye(25)[2] * 0.53 * 1.7
    boxes = detections((render(pose, body, camera, rgb=False).limbs > 0)[None].astype(float))
    guess = side_camera(np.concatenate([boxes, np.full((1, 4), np.nan)]), body, 200, 150)
    again = detections((render(pose, body, guess, rgb=False).limbs > 0)[None].astype(float))
    np.testing.assert_allclose(again[0, 2:], boxes[0, 2:], atol=3)
    assert guess.project(np.zeros(3))[0][0] == pytest.approx(99.5)
    assert 0.8 <= guess.centre[2] <= 1.9


@pytest.mark.parametrize("eyes", [1.0, 2.4])
def test_who_comes_nearer_shows_how_high_and_how_tilted_the_camera_is(eyes):
    """Boxes of 1.7 m by the true camera, some of them cut off, give the camera where assumptions would be far off."""
    camera = look_at((0, -6, eyes), (0, 0, 1.0), width=200, height=150, fov_degrees=2 * np.degrees(np.arctan(75 / 200)))
    away = np.stack([np.zeros(40), np.linspace(-1, 5, 40)], axis=1)
    feet, crown = (camera.project(np.column_stack([away, np.full(40, z)]))[0] for z in (0, 1.7))
    boxes = np.column_stack([crown[:, 0] - 8, crown[:, 0] + 8, crown[:, 1] + 0.5, feet[:, 1] - 0.5])
    boxes[:5, 3] -= 20  # behind a wall
    guess = side_camera(boxes, from_height(1.7), 200, 150)
    tilts = [np.degrees(np.arcsin(c.R[2, 2])) for c in (guess, camera)]
    assert tilts[0] == pytest.approx(tilts[1], abs=2.0)
    assert guess.centre[2] == pytest.approx(eyes, abs=0.2)


def test_what_no_box_can_tell_is_refused():
    with pytest.raises(MotionError, match="no person was detected, so the camera can't be guessed: give a camera"):
        side_camera(np.full((3, 4), np.nan), from_height(), 64, 48)
    says = r"camera has images of 64 x 48, but the video has 64 x 64: the aspect ratios must agree"
    with pytest.raises(MotionError, match=says):
        resized(view(0.0, width=64, height=48), 64, 64)
    up = look_at((0, -4, 1), (0, 0, 9), width=64, height=48)
    with pytest.raises(MotionError, match=r"contradicts the picture.*feet above its horizon.*leave the camera out"):
        standing_height(np.array([[20.0, 30, 10, 40]]), up)


def test_a_camera_in_another_unit_is_told_which_factor_suits():
    """Who is 1.7 m tall in metres is 17 m tall by a camera whose distances are ten times as large."""
    near, far = (look_at((0, -6 * k, 1.5 * k), (0, 0, 0.9 * k), width=200, height=150) for k in (1, 10))
    seen, _ = near.project(np.array([[0.0, 0, 1.7], [0, 0, 0]]))
    box = np.array([[seen[0, 0] - 9, seen[0, 0] + 9, seen[0, 1] + 0.5, seen[1, 1] - 0.5]])
    assert standing_height(box, near) == pytest.approx(1.7, rel=1e-3)
    with pytest.raises(MotionError, match=r"17\.\d\d m tall.*times 0\.103 would suit"):
        standing_height(box, far)
    below = look_at((0, -6, -1), (0, 0, 0.9), width=200, height=150)
    with pytest.raises(MotionError, match="below the ground"):
        standing_height(box, below)
