"""The camera's motors, and what pillars hide."""

import numpy as np
import pytest

from motionenv.envs.active.scene_kernel import ACCELERATIONS, RATES, TILT, look, steer_all

DT = 0.1


def turned(commands, camera=(0.0, -0.4, 0.0, 0.0, 0.0, 0.0)) -> np.ndarray:
    """States (steps, 6) of a camera after each of the commands (steps, 3)."""
    cameras, states = np.array([camera]), []
    for command in commands:
        steer_all(np.array([0]), cameras, np.array([command]), DT)
        states.append(cameras[0].copy())
    return np.array(states)


def test_the_camera_has_inertia_and_limits():
    states = turned(np.ones((40, 3)))
    rates = np.concatenate([np.zeros((1, 3)), states[:, 3:]])
    assert (np.diff(rates, axis=0) <= ACCELERATIONS * DT + 1e-12).all()
    assert states[:, 3].max() == pytest.approx(RATES[0])
    assert states[-1, 1] == TILT[1]
    assert states[-1, 2] == 1.0
    assert (states[-1, 4:] == 0).all()  # it stands at the stops
    assert (np.abs(states[:, 0]) <= np.pi).all()
    way = np.unwrap(states[:, 0])
    assert way[-1] > np.pi  # and pan has no stop
    np.testing.assert_allclose(np.diff(way), DT * states[1:, 3])


def test_a_stopping_camera_coasts():
    states = turned(np.concatenate([np.ones((10, 3)), np.zeros((10, 3))]))
    braking = states[10:13, 3]
    assert (braking > 0).all()
    assert states[-1, 3] == 0


@pytest.mark.parametrize(
    ("pillar", "seen"),
    [((4.0, 0.0, 1.0), 0), ((4.0, 2.0, 1.0), 15), ((12.0, 0.0, 1.0), 15), ((-4.0, 0.0, 1.0), 15)],
    ids=["between", "beside", "behind", "opposite"],
)
def test_a_pillar_hides_who_is_behind_it(pillar, seen):
    """A person at (8, 0), whom the camera faces."""
    bodies = np.tile([8.0, 0.0, 1.0], (1, 1, 15, 1))
    cameras = np.array([[0.0, np.arctan2(1.0 - 4.5, 8.0), 0.0, 0.0, 0.0, 0.0]])
    points, shown, colours = np.zeros((1, 1, 15, 2)), np.zeros((1, 1, 15), np.int8), np.zeros((1, 1, 2))
    drawn = np.zeros(1, np.uint64), np.zeros(1, np.intp), cameras, np.array([[pillar]]), bodies, np.zeros((1, 1))
    look(np.array([0]), *drawn, (1e-6, 1e-6, 0.0, 0.0), points, shown, colours)
    assert shown.sum() == seen
    np.testing.assert_allclose(points, 0, atol=1e-4)
    assert colours[0, 0, 0] == pytest.approx(1.0 if seen else 0.0)


@pytest.mark.parametrize(
    ("rates", "zoom"), [((0.3, 0.0), 0.0), ((0.2, 0.1), 0.0), ((0.15, 0.0), 1.0), ((0.0, 0.0), 0.0)]
)
def test_a_turning_camera_misses_people(rates, zoom):
    """Of a person in the middle, a share (1 - dropout) exp(-s²) is seen, s half images in the time of the blur."""
    n, tilt, blur, dropout = 20_000, np.arctan2(-3.5, 8.0), 0.8, 0.1
    half = np.tan(np.radians(20.0)) * 0.5**zoom  # of an image 40° wide
    cameras = np.tile([0.0, tilt, zoom, rates[0], rates[1], 0.0], (n, 1))
    bodies = np.tile([8.0, 0.0, 1.0], (n, 1, 15, 1))
    points, shown, colours = np.zeros((n, 1, 15, 2)), np.zeros((n, 1, 15), np.int8), np.zeros((n, 1, 2))
    drawn = np.arange(n, dtype=np.uint64), np.zeros(n, np.intp), cameras, np.zeros((n, 0, 3)), bodies, np.zeros((n, 1))
    look(np.arange(n), *drawn, (0.01, 0.01, dropout, blur), points, shown, colours)
    moved = blur * np.hypot(rates[0] * np.cos(tilt), rates[1]) / half
    expected = (1 - dropout) * np.exp(-(moved**2))
    share = shown.any(axis=-1).mean()
    assert share == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / n))
