"""Pictures of ActiveTracking show people, beliefs and the camera's view."""

import numpy as np

from motionenv.envs.active.pictures import SIDE, draw

PILLARS, WALKS = np.array([[5.0, 5.0, 0.8]]), np.array([[8.0, 0.0, 0.0, 0.0]])
JOINTS = np.array([[8.0, 0.0, 1.0]]) + np.linspace(-0.5, 0.5, 15)[:, None] * [0, 0.3, 1]
AHEAD = np.array([0.0, np.arctan2(1.0 - 4.5, 8.0), 0.5, 0, 0, 0])


def picture(state=AHEAD, points=(), beliefs=None) -> np.ndarray:
    return draw(state, PILLARS, WALKS, JOINTS[None], np.zeros(1), np.reshape(points, (-1, 2)), beliefs)


def red(image) -> np.ndarray:
    """Where the person of hue 0 is."""
    return (image[..., 0] > 180) & (image[..., 1] < 110)


def test_a_person_ahead_is_in_the_middle_of_the_view_and_upwards_on_the_map():
    image = picture()
    assert image.dtype == np.uint8
    plan, view = red(image[:, :SIDE]), red(image[:, SIDE + 4 :])
    rows, columns = np.nonzero(plan)
    assert rows.max() < SIDE / 2
    assert abs(columns.mean() - SIDE / 2) < 3
    rows, columns = np.nonzero(view)
    assert abs(rows.mean() - SIDE / 2) < 4
    assert abs(columns.mean() - view.shape[1] / 2) < 4


def test_a_camera_that_looks_away_sees_nobody():
    assert not red(picture(AHEAD + np.array([np.pi, 0, 0, 0, 0, 0]))[:, SIDE + 4 :]).any()


def test_beliefs_and_points_are_drawn():
    beliefs = np.array([[-8.0, 0.0, 1.0]])
    assert red(picture(beliefs=beliefs)[SIDE // 2 + 20 : SIDE, :SIDE]).any()
    assert not red(picture()[SIDE // 2 + 20 : SIDE, :SIDE]).any()
    white = lambda image: (image.min(axis=-1) > 200).sum()
    assert white(picture(points=[[0.5, 0.5]])) > white(picture())
