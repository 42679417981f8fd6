"""The window of render mode human, where there is a display and where there is none."""

import time

import numpy as np
import pytest

import motionenv.envs
from motionenv.envs import WalkerTracking
from motionenv.envs.window import Window


def test_a_window_shows_it(no_display):
    env = WalkerTracking(size=36, render_mode="human", fps=1000, horizon=5)
    env.reset(seed=0)
    env.step(np.zeros(25))
    assert env.render() is None
    env.close()
    env.close()


def test_a_window_that_cant_open_says_so(monkeypatch):
    pytest.importorskip("pygame", reason="pygame is missing: pip install -e '.[test]'")
    monkeypatch.setenv("SDL_VIDEODRIVER", "nonesuch")
    env = WalkerTracking(size=36, render_mode="human")
    with pytest.raises(motionenv.errors.EngineError, match='use render_mode="rgb_array"'):
        env.reset(seed=0)


def test_a_window_shows_the_pixels_that_it_is_given(no_display):
    import pygame

    window = Window(1000)
    pictures = np.random.default_rng(0).integers(0, 256, (2, 40, 60, 3), dtype=np.uint8)
    for picture in pictures:
        window.step(picture)
        shown = pygame.surfarray.array3d(pygame.display.get_surface())
        np.testing.assert_array_equal(shown.transpose(1, 0, 2), picture)
    window.close()
    assert not pygame.display.get_init()


def test_pictures_come_no_faster_than_the_frame_rate(no_display):
    window = Window(50)
    picture = np.zeros((40, 60, 3), np.uint8)
    window.step(picture)
    begun = time.perf_counter()
    for _ in range(10):
        window.step(picture)
    assert time.perf_counter() - begun > 0.9 * 10 / 50
    window.close()
