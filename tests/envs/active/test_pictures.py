"""Pictures of ActiveTracking show people, beliefs and the camera's view."""

import numpy as np
import pytest

from motionenv.envs.active.pictures import SIDE, camera_of, draw

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


def test_a_pillar_is_as_wide_as_its_edges_are_apart():
    """In the middle row, against the projection of the points where that row's rays pass the pillar."""
    pillar, camera = np.array([[6.0, 0.5, 0.6]]), camera_of(AHEAD)
    image = draw(AHEAD, pillar, WALKS + 99.0, JOINTS[None] + [0, 99.0, 0], np.zeros(1), np.zeros((0, 2)))
    row = image[SIDE // 2, SIDE + 4 :]
    drawn = (np.abs(row.astype(int) - [150, 146, 138]).max(axis=-1) < 8).sum()
    z = 4.5 + 6.0 * np.tan(AHEAD[1])  # where the middle row is at the pillar
    edges, _ = camera.project(np.array([[6.0, 0.5 - 0.6, z], [6.0, 0.5 + 0.6, z]]))
    assert drawn == pytest.approx(np.ptp(edges[:, 0]), rel=0.06)
