"""Whom detections show, and who is followed."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.tracking.video.candidates import areas, at_frames, boxes_of, candidates, chosen, common_areas
from motionenv.types import Points

FPS, FRAMES, SIZE = 20.0, 60, (400, 300)


def person(x: float, tall: float, step: float, sure: float = 0.9, frames=slice(None)) -> Points:
    """Fifteen points in a column, which goes to the right by `step` pixels per frame, seen in some frames."""
    points = np.full((FRAMES, 15, 2), np.nan)
    along = x + step * np.arange(FRAMES)
    points[..., 0] = along[:, None] + np.linspace(-0.1, 0.1, 15) * tall
    points[..., 1] = 200 - np.linspace(0, 1, 15) * tall
    hidden = np.ones(FRAMES, dtype=bool)
    hidden[frames] = False
    points[hidden] = np.nan
    return Points(points, FPS, "px", confidence=np.full((FRAMES, 15), sure))


@pytest.fixture(scope="module")
def people():
    """A tall one who walks, a tall one of whom little is sure, a small one, and somebody who is only glimpsed."""
    return [person(300, 40, 0), person(60, 120, 3), person(350, 110, 0, sure=0.3), person(200, 150, 0, frames=slice(9))]


def test_who_is_largest_surest_and_longest_seen_comes_first(people):
    found = candidates(people, FPS, FRAMES, SIZE)
    assert [c.number for c in found] == [1, 2, 3]
    assert [c.points for c in found] == [people[1], people[0], people[2]] or found[1].points is people[2]
    assert chosen(found).points is people[1]
    assert found[0].height == pytest.approx(120 * 1.16, rel=0.02)
    assert str(found[0]).startswith("1: seen from 0.0 to 3.0 s about (148, ")
    assert repr(found[0]) == f"Candidate({found[0]})"


def test_a_region_is_where_somebody_is_for_most_of_the_time(people):
    inside = candidates(people, FPS, FRAMES, SIZE, region=(250, 0, 150, 300))
    assert {id(c.points) for c in inside} == {id(people[0]), id(people[2])}
    assert candidates(people, FPS, FRAMES, SIZE, region=(0, 250, 400, 50)) == []


def test_boxes_bridge_short_gaps_only_and_stay_inside_the_picture():
    seen = np.r_[0:20, 30:35, 58:60]
    (one,) = candidates([person(10, 120, 2, frames=seen)], FPS, FRAMES, SIZE)
    (whole,) = candidates([person(10, 120, 2)], FPS, FRAMES, SIZE)
    assert np.flatnonzero(one.seen).tolist() == [*range(35), 58, 59]
    np.testing.assert_allclose(one.boxes[:35], whole.boxes[:35], atol=1e-9)
    assert whole.boxes[0, 0] == 0
    assert (np.nanmin(whole.boxes), np.nanmax(whole.boxes[:, 3])) >= (0, 0)


def test_whom_you_name_is_followed(people):
    found = candidates(people, FPS, FRAMES, SIZE)
    for one in found:
        left, right, top, bottom = one.boxes[20]
        assert chosen(found, person=one.number) is one
        assert chosen(found, box=(left, top, right - left + 1, bottom - top + 1), at=1.0) is one
        assert chosen(found, point=((left + right) / 2, (top + bottom) / 2), at=1.0) is one
    for asked in ({"point": (199, 1), "at": 0.1}, {"box": (1, 1, 1, 1), "at": 2.9}):
        with pytest.raises(MotionError, match=f"nobody is at {next(iter(asked))}; who is seen: 1: seen from"):
            chosen(found, **asked)
    with pytest.raises(MotionError, match="person must be from 1 to 3"):
        chosen(found, person=4)
    with pytest.raises(MotionError, match="nobody is detected for 0.6 s"):
        chosen([])


def test_nearest_frames_and_boxes():
    values = np.arange(6.0)
    np.testing.assert_array_equal(at_frames(values, 60.0, 30.0, 4), [0, 2, 4, np.nan])
    np.testing.assert_array_equal(at_frames(values, 15.0, 30.0, 4), [0, 0, 1, 2])
    points = np.full((2, 15, 2), np.nan)
    points[0, :6] = [[10, 20], [30, 120], [20, 60], [20, 60], [20, 60], [20, 60]]
    points[1, :5] = 1.0
    boxes = boxes_of(points)
    np.testing.assert_allclose(boxes[0], [10 - 7, 30 + 7, 20 - 10, 120 + 6])
    assert np.isnan(boxes[1]).all()


def test_areas_against_counted_pixels():
    rng = np.random.default_rng(0)
    low = rng.integers(0, 15, (30, 2))
    boxes = np.column_stack(
        [low[:, 0], low[:, 0] + rng.integers(0, 9, 30), low[:, 1], low[:, 1] + rng.integers(0, 9, 30)]
    )
    masks = np.zeros((30, 30, 30), dtype=bool)
    for mask, (c0, c1, r0, r1) in zip(masks, boxes, strict=True):
        mask[r0 : r1 + 1, c0 : c1 + 1] = True
    np.testing.assert_array_equal(areas(boxes), masks.sum(axis=(1, 2)))
    np.testing.assert_array_equal(common_areas(boxes[:15], boxes[15:]), (masks[:15] & masks[15:]).sum(axis=(1, 2)))
