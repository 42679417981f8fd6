"""Outlines linked over time, on pictures of boxes whose ways are known."""

import numpy as np

from motionenv.tracking.video.movers import areas, common_areas, components, linked, window

FPS, FRAMES = 20.0, 50


def film(*ways) -> np.ndarray:
    """Foreground (T, 60, 120) of boxes 8 wide and 24 tall at columns `ways` (T,), NaN where there is none."""
    pictures = np.zeros((FRAMES, 60, 120))
    for t in range(FRAMES):
        for way in ways:
            if np.isfinite(way[t]):
                left = round(way[t])
                pictures[t, 20:44, max(0, left) : max(0, left + 8)] = 1
    return pictures


def found(*ways):
    """Label images and movers of `film`."""
    labels = np.stack([components(f) for f in film(*ways)])
    return labels, linked(labels, FPS)


def at(mover) -> np.ndarray:
    """Left side (T,) of a mover."""
    return mover.boxes[:, 0]


def test_who_crosses_who_stands_stays_who_she_is():
    walks, stands = 10 + 1.8 * np.arange(FRAMES), np.full(FRAMES, 56.0)
    labels, movers = found(walks, stands)
    assert len(movers) == 2
    np.testing.assert_allclose(at(movers[0]), walks, atol=4.5)
    np.testing.assert_allclose(at(movers[1]), stands, atol=4.5)
    assert movers[0].merged.any()
    apart = np.abs(walks - stands) > 14
    assert not (movers[0].merged & apart).any()
    mine = window(labels, movers[0], movers)
    other = np.zeros_like(mine)
    other[:, 20:44, 56:64] = True
    assert not (mine & other & (labels > 0))[apart].any()


def test_behind_a_post_it_is_the_same_and_after_a_second_somebody_else():
    way = 5 + 2.0 * np.arange(FRAMES)
    brief, long = way.copy(), way.copy()
    brief[20:30], long[12:40] = np.nan, np.nan
    assert len(found(brief)[1]) == 1
    assert len(found(long)[1]) == 2


def test_who_comes_after_she_left_is_not_she():
    leaves = np.where(np.arange(FRAMES) < 20, 60 + 3.2 * np.arange(FRAMES), np.nan)
    comes = np.where(np.arange(FRAMES) > 22, 112 - 2.0 * (np.arange(FRAMES) - 22), np.nan)
    _, movers = found(leaves, comes)
    assert len(movers) == 2
    assert not (movers[0].seen & movers[1].seen).any()


def test_two_side_by_side_are_not_one_body_but_legs_and_trunk_are():
    pictures = film(np.full(FRAMES, 40.0))
    pictures[10:, 31:34] = 0  # a rail in front
    assert len(linked(np.stack([components(p) for p in pictures]), FPS)) == 1
    one = np.full(FRAMES, 40.0)
    apart = one + 9 + np.minimum(0.5 * np.arange(FRAMES), 20)
    assert len(found(one, apart)[1]) == 2


def test_specks_do_not_take_over_a_body():
    """She covers a speck while another one shows between her legs: each speck lies wholly in her box."""
    pictures = np.zeros((FRAMES, 60, 120))
    for t in range(FRAMES):
        left = round(10 + 1.5 * t)
        pictures[t, 10:50, left : left + 14] = 1
        pictures[t, 30:50, left + 3 : left + 11] = 0
        if t < 22:
            pictures[t, 15:23, 48:54] = 1
        if 17 <= t < 25:
            pictures[t, 35:43, left + 6 : left + 8] = 1
    movers = linked(np.stack([components(p) for p in pictures]), FPS)
    main = max(movers, key=lambda m: m.seen.sum())
    assert main.seen.all()
    np.testing.assert_array_equal(main.boxes[:, 2:], [[10, 49]] * FRAMES)


def test_who_is_crossed_but_for_the_head_stays_who_she_is():
    pictures = film(112 - 2.0 * np.arange(FRAMES))
    ways = 20 + 0.6 * np.arange(FRAMES)
    for t, way in enumerate(ways.round().astype(int)):
        pictures[t, 6:44, way : way + 8] = 1
        pictures[t, 11:16, way : way + 8] = t < 8  # then her neck is like the background
    movers = linked(np.stack([components(p) for p in pictures]), FPS)
    assert len(movers) == 2
    she = min(movers, key=at_first)
    assert she.seen.all()
    assert she.merged.any()
    np.testing.assert_allclose(at(she), ways, atol=4.5)


def at_first(mover) -> float:
    """Where a mover first was."""
    return float(at(mover)[mover.seen][0])


def test_common_areas_are_counted_pixels():
    boxes = np.array([[0, 9, 0, 4], [5, 14, 2, 8], [30, 31, 0, 0]], dtype=float)
    masks = np.zeros((3, 10, 40), dtype=bool)
    for mask, (left, right, top, bottom) in zip(masks, boxes.astype(int), strict=True):
        mask[top : bottom + 1, left : right + 1] = True
    np.testing.assert_array_equal(areas(boxes), masks.sum(axis=(1, 2)))
    np.testing.assert_array_equal(common_areas(boxes, boxes), np.einsum("aij,bij->ab", *[masks.astype(int)] * 2))
