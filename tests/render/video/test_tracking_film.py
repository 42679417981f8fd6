"""Films of tracks: what stands where in the picture."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.render.cameras import view
from motionenv.render.video.tracking_film import marked, track_film


def test_figure_body_and_curve_come_in_and_gaps_stay_empty():
    poses = np.full((3, 25), np.nan)
    poses[1:] = np.eye(25)[2] * 0.93
    particles = np.repeat(poses[:, None], 4, axis=1)
    pictures = np.zeros((3, 100, 120, 3), dtype=np.uint8)
    camera = view(0.0, width=120, height=100)
    frames = list(track_film(pictures, camera, poses, particles, from_height(), [np.nan, 0.5, 0.7], label="error"))
    assert {f.shape for f in frames} == {(124, 120 + 4 + 100, 3)}
    assert not frames[0][:100, :120].any()
    assert frames[1][:100, :120].any()
    assert np.ptp(frames[0][:100, 124:]) == 0
    assert np.ptp(frames[1][:100, 124:]) > 100
    assert (frames[2][100:] != frames[1][100:]).any()


def test_shapes_that_do_not_go_together():
    camera, body = view(0.0, width=32, height=32), from_height()
    with pytest.raises(MotionError, match="must agree"):
        next(track_film([], camera, np.zeros((2, 25)), np.zeros((3, 1, 25)), body, np.zeros(2)))
    pictures = np.zeros((2, 32, 32, 3), dtype=np.uint8)
    with pytest.raises(MotionError, match="outnumber"):
        list(track_film(pictures, camera, np.zeros((1, 25)), np.zeros((1, 1, 25)), body, np.zeros(1)))


def test_a_word_marks_the_pictures_that_it_is_for():
    pictures = np.zeros((3, 60, 80, 3), dtype=np.uint8)
    shown = list(marked(pictures, [False, True, False], "LOST"))
    assert [bool(p.any()) for p in shown] == [False, True, False]
    assert shown[1][:30].any()
    assert not shown[1][40:].any()
