"""What is foreground before a background that nobody has seen: against enumeration, and on scenes that are known."""

from itertools import product

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.likelihoods import pixel_history
from motionenv.likelihoods.pixel_history import PixelHistory
from tests.likelihoods.test_background import scene


def density(squared, variance):
    """Of a Gaussian colour at a squared distance from its mean, relative to the uniform density of 256³ colours."""
    return np.exp(-0.5 * squared / variance) * 256.0**3 / (2 * np.pi * variance) ** 1.5


def enumerated(tones, share, stays, lasts):
    """Probability that the last of a grey pixel's `tones` (frames,) is foreground: the sum over all paths.

    The noise has variance 1. The background's tone is any when first seen, and then the mean of where it was seen.
    """
    rates = {(0, 1): share / (1 - share) / stays, (1, 0): 1 / stays}
    total = np.zeros(2)
    for path in product((0, 1), repeat=len(tones)):
        p = share if path[0] else 1 - share
        background = None
        for k, passes in enumerate(path):
            if k:
                p *= rates.get((path[k - 1], passes), 1 - rates[path[k - 1], 1 - path[k - 1]])
            if passes and k:
                p *= lasts * density(3 * (tones[k] - tones[k - 1]) ** 2, 2) + 1 - lasts
            elif not passes and background is not None:
                p *= density(3 * (tones[k] - background) ** 2, 1 + 1 / tones[:k].count(background))
            elif not passes:
                background = tones[k]
        total[path[-1]] += p
    return total[1] / total.sum()


@pytest.mark.parametrize("tones", ["aab", "aabb", "aabaa", "abbbbb", "aaaabb", "aaab", "abcaa", "abcbb", "aaabcc"])
def test_a_pixel_is_foreground_as_the_sum_over_all_its_paths_says(tones):
    model, picture = PixelHistory(), np.random.default_rng(0).integers(40, 200, (20, 20, 3)).astype(np.uint8)
    values = [{"a": 40, "b": 110, "c": 170}[tone] for tone in tones]
    for k, value in enumerate(values):
        picture[10, 10] = value
        told = model.observe(picture)[10, 10]
        if k:
            known = pixel_history._SHARE, pixel_history._STAYS, pixel_history._LASTS
            assert told == pytest.approx(enumerated(values[: k + 1], *known), rel=1e-9)


def test_somebody_who_moves_is_seen_after_few_pictures_and_leaves_no_ghost():
    model = PixelHistory()
    for i in range(30):
        picture, _, mask = scene(2 + i, seed=i)
        p = model.observe(picture)
        if i == 6:
            assert p[mask].mean() > 0.3
            assert p[~mask].mean() < 0.03
    assert p[mask].min() > 0.9
    assert p[~mask].mean() < 0.002


def test_earlier_pictures_are_seen_anew():
    model = PixelHistory()
    first, _, mask = scene(10, seed=99)
    assert (model.observe(first) < 0.5).all()
    for i in range(25):
        model.observe(scene(12 + i, seed=i)[0])
    p = model.foreground(first)
    assert p[mask].mean() > 0.95
    assert p[~mask].mean() < 0.01


@pytest.mark.parametrize("gain", [0.8, 1.15])
def test_other_light_is_no_foreground(gain):
    model = PixelHistory()
    for i in range(12):
        picture, _, mask = scene(5 + 2 * i, seed=i, gain=gain if i % 2 else 1.0)
        p = model.observe(picture)
    assert p[~mask].mean() < 0.01
    assert p[mask].mean() > 0.8


def test_a_thing_that_is_left_standing_becomes_background():
    model = PixelHistory()
    for i in range(40):
        model.observe(scene(50, seed=i)[0])
    seen = []
    for i in range(400):
        picture, _, mask = scene(20, seed=100 + i)
        seen.append(model.observe(picture)[mask].mean())
    assert min(seen[:30]) > 0.95
    assert max(seen[-30:]) < 0.05


def test_pictures_that_do_not_fit_are_refused():
    model = PixelHistory()
    model.observe(scene(1)[0])
    with pytest.raises(MotionError, match=r"earlier pictures \(64, 64, 3\), got \(32, 64, 3\)"):
        model.observe(scene(1)[0][::2])
    with pytest.raises(MotionError, match="uint8"):
        model.observe(np.zeros((64, 64, 3)))
