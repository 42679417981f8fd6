"""Foreground probabilities of colour pictures, on pictures whose foreground is known."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.likelihoods.pixel_history import PixelHistory
from motionenv.tracking.video.foreground import FilmBackground


def scene(at, seed=0, noise=4.0, gain=1.0, plain=False):
    """A box of another colour at column `at` before clutter: picture, background, mask."""
    rng = np.random.default_rng(1)
    coarse = rng.uniform(40, 180, (16, 1 if plain else 16, 3))
    background = np.kron(coarse, np.ones((4, 64 if plain else 4, 1)))
    mask = np.zeros((64, 64), bool)
    mask[20:50, at : at + 10] = True
    picture = gain * np.where(mask[..., None], [230, 30, 200], background)
    rng = np.random.default_rng(seed)
    return (picture + noise * rng.normal(size=picture.shape)).clip(0, 255).astype(np.uint8), background, mask


@pytest.mark.parametrize("gain", [0.7, 1.0, 1.2])
@pytest.mark.parametrize("noise", [0.0, 4.0, 15.0])
def test_a_known_background_under_noise_and_other_light(gain, noise):
    picture, background, mask = scene(30, noise=noise, gain=gain)
    wrong = (foreground_probability(picture, background) > 0.5) != mask
    assert wrong.mean() < 0.01


def test_a_walker_who_passes_leaves_the_background():
    model = Background(frames=20)
    for i in range(20):
        picture, background, mask = scene(2 + 2 * i, seed=i)
        model.observe(picture)
        model.learn(mask)
    assert np.abs(model.estimate() - background).mean() < 2.0
    wrong = (foreground_probability(picture, model.estimate()) > 0.5) != mask
    assert wrong.mean() < 0.01


def test_the_first_picture_of_a_plain_wall_tells():
    model = Background()
    picture, _, mask = scene(30, plain=True)
    model.observe(picture)
    assert ((foreground_probability(picture, model.estimate()) > 0.5) != mask).mean() < 0.01


def test_the_first_picture_of_clutter_tells_little_rather_than_lies():
    model = Background()
    picture, _, mask = scene(30)
    model.observe(picture)
    p = foreground_probability(picture, model.estimate())
    assert np.mean(p[~mask] > 0.9) < 0.01


@pytest.mark.parametrize(
    ("misuse", "message"),
    [
        (lambda: foreground_probability(np.zeros((4, 4)), np.zeros((4, 4))), "rgb must be uint8"),
        (lambda: foreground_probability(scene(1)[0], np.zeros((4, 4, 3))), "rgb's shape"),
        (lambda: foreground_probability(scene(1)[0], np.full((64, 64, 3), np.inf)), "finite"),
        (lambda: Background().estimate(), "no image has been observed"),
        (lambda: Background(frames=0), "frames must be"),
        (lambda: Background().learn(np.zeros((4, 4), bool)), "observe"),
    ],
)
def test_misuse_is_named(misuse, message):
    with pytest.raises(MotionError, match=message):
        misuse()


def test_what_a_body_covers_never_becomes_background():
    """Somebody hardly moves: a history of pictures takes him for background, one that is told doesn't."""
    told, untold = Background(frames=15), PixelHistory()
    for i in range(24):
        picture, background, mask = scene(20 + i // 12, seed=i)
        told.observe(picture)
        unlike = untold.observe(picture)
        told.learn(mask)
    seen = ~np.isnan(told.estimate()[..., 0])
    np.testing.assert_array_equal(seen, ~(scene(20)[2] & scene(21)[2]))
    assert np.abs(told.estimate() - background)[seen].mean() < 2.0
    says = foreground_probability(picture, told.estimate())
    np.testing.assert_array_equal(says[~seen], 0.5)
    assert ((says > 0.5) != mask)[seen].mean() < 0.01
    assert (unlike[mask] > 0.5).mean() < 0.5


def test_a_post_taken_for_a_body_becomes_background_once_nothing_there_changes():
    told = Background()
    for i in range(40):
        picture, _, mask = scene(20, seed=i)
        told.observe(picture)
        told.learn(mask)
        if i == 20:
            np.testing.assert_array_equal(np.isnan(told.estimate()[..., 0]), mask)
    assert np.isfinite(told.estimate()).mean() > 0.99
    assert (foreground_probability(picture, told.estimate()) < 0.5)[mask].mean() > 0.95


def test_the_median_of_what_was_kept_of_each_pixel():
    """Against NumPy's, of the last pictures in which each pixel was bare."""
    rng, model = np.random.default_rng(3), Background(frames=5)
    pictures = rng.integers(0, 256, (12, 6, 8, 3)).astype(np.uint8)
    bodies = rng.random((12, 6, 8)) < 0.6
    bodies[:, 2, 3] = True
    for picture, body in zip(pictures, bodies, strict=True):
        model.observe(picture)
        model.learn(body)
    estimate = model.estimate()
    for y, x in np.ndindex(6, 8):
        kept = pictures[~bodies[:, y, x], y, x][-5:]
        expected = np.sort(kept, axis=0)[len(kept) // 2] if len(kept) else np.full(3, np.nan)
        np.testing.assert_array_equal(estimate[y, x], expected)


def test_a_plain_wall_is_plain_behind_the_body_too():
    model = Background()
    picture, _, mask = scene(30, noise=2.0, plain=True)
    model.observe(picture)
    model.learn(mask)
    assert ((foreground_probability(picture, model.estimate()) > 0.5) != mask).mean() < 0.01


def test_a_film_before_a_background_without_noise():
    """Rendered empty scenes have none, films do."""
    picture, background, mask = scene(30, noise=12.0)
    clean = FilmBackground([background.astype(np.uint8)] * 3)
    assert ((clean.foreground(picture) > 0.5) != mask).mean() < 0.02


def test_pictures_of_another_size_are_refused():
    model = Background()
    model.observe(np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(MotionError, match="shape of earlier images"):
        model.observe(np.zeros((5, 4, 3), np.uint8))
