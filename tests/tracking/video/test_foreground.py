"""What moves before a still camera: told from noise, light and shadows, against films that were made so."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.tracking.video.foreground import FilmBackground


def test_what_moves_is_told_from_noise_light_and_shadows():
    rng = np.random.default_rng(0)
    plain = rng.integers(80, 200, (48, 64, 3)).astype(float)
    film = np.clip(plain + 4 * rng.standard_normal((20, 48, 64, 3)), 0, 255).astype(np.uint8)
    background = FilmBackground(film)
    assert (background.foreground(film[3]) > 0.5).mean() < 0.001
    assert (background.foreground((0.9 * film[3]).astype(np.uint8)) > 0.5).mean() < 0.01
    shaded = film[3].copy()
    shaded[30:] = (0.75 * shaded[30:]).astype(np.uint8)
    assert (background.foreground(shaded) > 0.5).mean() < 0.02
    bodied = film[3].copy()
    bodied[10:40, 20:30] = (200, 30, 40)
    assert (background.foreground(bodied)[12:38, 22:28] > 0.5).mean() > 0.95


def test_the_background_is_what_is_there_most_of_the_time_and_its_noise_is_found():
    rng = np.random.default_rng(1)
    plain = rng.integers(60, 200, (20, 30, 3)).astype(float)
    spread = np.where(np.arange(30) < 15, 4.0, 8.0)[:, None]
    film = np.clip(plain + spread * rng.standard_normal((80, 20, 30, 3)), 0, 255).astype(np.uint8)
    film[:30, 5:15, 10:20] = (250, 10, 10)  # somebody who stands there for less than half of the time
    background = FilmBackground(film)
    free = np.ones((20, 30), dtype=bool)
    free[5:15, 10:20] = False
    assert np.abs(background.typical - plain)[free].max() < 8
    assert np.abs(background.typical - plain).max() < 16
    left, right = background.noise[:, :10].mean(), background.noise[:, 20:].mean()
    # The median of the largest of three colours' deviations, which a Gaussian has 1.264 standard deviations away
    assert left == pytest.approx(4.0 * 1.264 * 1.4826, rel=0.1)
    assert right == pytest.approx(2 * left, rel=0.15)


def test_who_comes_nearer_and_covers_a_pixel_for_long_is_seen_there():
    """Where somebody stands in two of five frames, deviations from the median are as large as his contrast."""
    rng = np.random.default_rng(2)
    film = np.clip(120 + 4 * rng.standard_normal((60, 24, 24, 3)), 0, 255)
    film[36:, 6:18, 6:18] += 40
    film = np.clip(film, 0, 255).astype(np.uint8)
    background = FilmBackground(film)
    assert background.noise[8:16, 8:16].mean() < 1.5 * background.noise[:4].mean()
    seen = background.foreground(film[50]) > 0.5
    assert seen[7:17, 7:17].mean() > 0.95
    assert seen[:4].mean() < 0.02


def test_a_film_without_noise_still_has_some_and_shows_who_is_there():
    film = np.full((5, 24, 24, 3), 90, dtype=np.uint8)
    background = FilmBackground(film)
    assert (background.noise > 0).all()
    assert background.foreground(film[0]).max() < 0.2
    there = film[0].copy()
    there[8:16, 8:16] = 200
    seen = background.foreground(there)
    assert seen[9:15, 9:15].min() > 0.9
    assert seen[:6].max() < 0.2


def test_what_is_no_film_or_another_size_is_refused():
    with pytest.raises(MotionError, match="a background needs at least 3 frames, got 2"):
        FilmBackground(np.zeros((2, 8, 8, 3), dtype=np.uint8))
    background = FilmBackground(np.zeros((3, 8, 8, 3), dtype=np.uint8))
    with pytest.raises(MotionError, match=r"rgb must have the video's shape \(8, 8, 3\), got \(8, 9, 3\)"):
        background.foreground(np.zeros((8, 9, 3), dtype=np.uint8))
