"""Swapped sides: found in real walks and in rays where they were made, and nowhere else, and put back."""

import numpy as np
import pytest

from motionenv.lifting.side_labels import GROUPS, exchanged, find_swaps, swapped_frames, unswapped
from motionenv.types import MARKERS, Points

RNG = np.random.default_rng(0)
PLACES = np.array([4.0, 0, 0]) + np.stack([np.zeros(15), RNG.uniform(-0.5, 0.5, 15), RNG.uniform(-1, 1, 15)], -1)
PLACES = np.repeat(PLACES[None], 60, axis=0)


def mixed_up(points: Points, labels) -> Points:
    """Left and right exchanged marker by marker where `labels` (frames, 2) of arms and legs say so."""
    positions = points.positions.copy()
    for g, pairs in enumerate(GROUPS.values()):
        for pair in pairs:
            left, right = (MARKERS.index(f"{side}_{pair}") for side in ("left", "right"))
            for i in np.flatnonzero(labels[:, g]):
                positions[i, [left, right]] = positions[i, [right, left]]
    return Points(positions, points.fps, points.unit)


def some_labels(frames: int, kind: str, rng) -> np.ndarray:
    labels = np.zeros((frames, 2), dtype=bool)
    if kind == "single frames":
        labels[:] = rng.random((frames, 2)) < 0.1
    elif kind == "whole side":
        labels[rng.random(frames) < 0.3] = True
    elif kind == "runs":
        for g in (0, 1, 1):
            start = rng.integers(0, frames - 12)
            labels[start : start + rng.integers(3, 12), g] = True
    elif kind == "from here on":
        labels[round(0.65 * frames) :] = True
    return labels


def noisy(points: Points, noise=0.02) -> Points:
    rng = np.random.default_rng(len(points.positions))
    return Points(points.positions + noise * rng.standard_normal(points.positions.shape), points.fps, points.unit)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("kind", ["none", "single frames", "whole side", "runs", "from here on"])
def test_mixed_up_frames_are_found(views, kind, noise):
    rng = np.random.default_rng(3)
    found = truly = wrong = fine = 0
    for points in views[::4]:
        labels = some_labels(len(points.positions), kind, rng)
        seen = swapped_frames(mixed_up(noisy(points, noise), labels))
        found, truly = found + (seen & labels).sum(), truly + labels.sum()
        wrong, fine = wrong + (seen & ~labels).sum(), fine + (~labels).sum()
    assert found >= 0.95 * truly
    assert wrong < 0.01 * fine


def test_unswapped_puts_left_and_right_back(views):
    points = views[1]
    labels = some_labels(len(points.positions), "runs", np.random.default_rng(0))
    assert labels.any()
    back, found = unswapped(mixed_up(points, labels))
    np.testing.assert_array_equal(found, labels)
    np.testing.assert_array_equal(back.positions, points.positions)


def test_gaps_don_t_look_mixed_up(views):
    rng = np.random.default_rng(0)
    for points in views[::6]:
        positions = points.positions.copy()
        positions[rng.random(positions.shape[:2]) < 0.2] = np.nan
        positions[:, [MARKERS.index(n) for n in ("left_wrist", "left_elbow")]] = np.nan
        labels = some_labels(len(positions), "runs", rng)
        found = swapped_frames(mixed_up(Points(positions, 30, "m"), labels))
        assert (found == labels)[:, 1].mean() > 0.97


def rays(noise: float) -> np.ndarray:
    way = PLACES + noise * RNG.standard_normal(PLACES.shape)
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


@pytest.mark.parametrize(("arms", "legs"), [((10, 11), (30, 50)), ((0, 5), (59, 60)), ((20, 20), (0, 60))])
def test_spans_of_exchanged_labels_are_found(arms, legs):
    labels = np.zeros((60, 2), dtype=bool)
    labels[slice(*arms), 0] = labels[slice(*legs), 1] = True
    found = find_swaps(exchanged(rays(0.02), labels), PLACES, 0.02)
    assert (found == labels).all()


def test_gaps_and_noise_are_no_exchange():
    seen = rays(0.05)
    seen[RNG.uniform(size=seen.shape[:2]) < 0.3] = np.nan
    assert not find_swaps(seen, PLACES, 0.05).any()


def test_exchanging_twice_changes_nothing():
    labels = RNG.uniform(size=(60, 2)) < 0.5
    once = exchanged(PLACES, labels)
    knees = [MARKERS.index("left_knee"), MARKERS.index("right_knee")]
    np.testing.assert_array_equal(once[labels[:, 1]][:, knees], PLACES[labels[:, 1]][:, knees[::-1]])
    np.testing.assert_array_equal(exchanged(once, labels), PLACES)
