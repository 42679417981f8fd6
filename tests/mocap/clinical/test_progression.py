"""The direction of progression of straight, oblique and curved walks, and of who stands."""

import numpy as np
import pytest

from motionenv.mocap.clinical.progression import progression

FPS = 50.0
T = np.arange(200) / FPS


def facing(angle) -> np.ndarray:
    """Rotations (frames, 3, 3) about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    z = np.zeros_like(c)
    return np.stack([np.stack([c, -s, z], -1), np.stack([s, c, z], -1), np.stack([z, z, z + 1], -1)], -2)


def direction(pelvis, rotation) -> np.ndarray:
    turned = progression(pelvis, rotation, FPS)
    return np.degrees(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))


@pytest.mark.parametrize(("heading", "expected"), [(4.0, 0.0), (-86.0, -90.0), (40.0, 40.0), (172.0, 180.0)])
def test_a_walk_along_the_walkway_is_reported_against_its_axis(heading, expected):
    way = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0])
    found = direction(1.3 * T[:, None] * way, facing(np.full(200, np.radians(heading))))
    np.testing.assert_allclose(np.exp(1j * np.radians(found)), np.exp(1j * np.radians(expected)), atol=1e-9)


def test_on_a_circle_the_direction_turns():
    angle = 2 * np.pi * T / 4
    found = direction(np.stack([np.sin(angle), 1 - np.cos(angle), T * 0], -1), facing(angle))
    off = np.degrees(np.angle(np.exp(1j * (np.radians(found) - angle))))
    assert np.abs(off[60:-60]).max() < 2


def test_who_stands_progresses_along_the_axis_that_the_pelvis_faces_also_with_gaps():
    pelvis = np.zeros((200, 3))
    pelvis[:50] = np.nan
    np.testing.assert_allclose(direction(pelvis, facing(np.full(200, np.radians(60.0)))), 90.0)


def test_an_unseen_pelvis_goes_nowhere():
    assert np.isnan(progression(np.full((5, 3), np.nan), facing(np.zeros(5)), FPS)).all()
