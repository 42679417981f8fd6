"""Who walks among what moves, on outlines of a walker, of somebody on the spot and of a car."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking.video.candidates import candidates, chosen, evidence
from motionenv.tracking.video.movers import components, linked

FPS = 20.0


@pytest.fixture(scope="module")
def scene():
    """Labels and movers: somebody walks to the right, another waves on the left, a car passes above."""
    walk = synthesize("walk/fpca", 3.0, FPS, seed=4, height=1.75, speed=1.2)
    camera = view(0.0, width=200, height=120, distance=7.0)
    poses = walk.poses - np.eye(25)[0] * (walk.poses[:, :1].mean() - 0.5)
    walker = render(poses, walk.skeleton, camera, rgb=False).limbs > 0
    spot = np.repeat(walk.poses[:1], len(poses), axis=0)
    spot[:, 0], spot[:, 1] = -2.5, 0.0
    spot[:, [9, 13]] += np.sin(np.arange(len(poses)) / 3)[:, None]
    waver = render(spot, walk.skeleton, camera, rgb=False).limbs > 0
    film = (walker | waver).astype(float)
    for t in range(len(film)):
        film[t, 3:15, 3 * t : 3 * t + 25] = 1
    labels = np.stack([components(f) for f in film])
    return labels, linked(labels, FPS), walker


def test_the_walker_is_chosen_and_said_why(scene):
    labels, movers, walker = scene
    found = candidates(movers, labels, FPS, scale=2.0)
    assert [c.number for c in found] == [1, 2, 3]
    best = chosen(found)
    assert best.walks > 0.9
    assert all(c.walks < 0.5 for c in found[1:])
    rows, columns = np.nonzero(walker[30])
    np.testing.assert_allclose((best.boxes[30] + 0.5) / 2 - 0.5, [columns.min(), columns.max(), rows.min(), rows.max()])
    assert 0.4 < best.travel < 1.0  # 1.2 m/s, 1.75 m
    assert best.rhythm > 0.3
    assert "walks with probability" in str(best)


def test_travel_rhythm_and_shape_are_those_of_the_way(scene):
    labels, movers, _ = scene
    car = next(m for m in movers if np.nanmin(m.boxes[:, 2]) < 5)
    travel, jitter, upright, rhythm, seconds, height = evidence(car, labels, FPS)
    assert height == 12
    assert travel == pytest.approx(3 * FPS / 12, rel=0.1)
    assert upright < 0.6
    assert rhythm < 0.3
    assert jitter < 0.5
    assert seconds > 2


def test_whom_you_name_is_followed(scene):
    labels, _, _ = scene
    found = candidates(linked(labels, FPS), labels, FPS)
    for one in found:
        left, right, top, bottom = one.boxes[20]
        assert chosen(found, person=one.number) is one
        assert chosen(found, box=(left, top, right - left + 1, bottom - top + 1), at=1.0) is one
        assert chosen(found, point=((left + right) / 2, (top + bottom) / 2), at=1.0) is one
    hidden = found[0].boxes[20].copy()
    found[0].boxes[18:23] = found[0].mover.boxes[18:23] = np.nan
    middle = (hidden[:2].mean(), hidden[2:].mean())
    assert chosen(found, point=middle, at=1.0) is found[0]  # between where she was before and after
    for asked in ({"point": (199, 1), "at": 0.1}, {"box": (1, 1, 1, 1), "at": 2.9}):
        with pytest.raises(MotionError, match=f"nothing moves at {next(iter(asked))}; what moves: 1: walks"):
            chosen(found, **asked)
    with pytest.raises(MotionError, match="person must be from 1 to 3"):
        chosen(found, person=4)
    with pytest.raises(MotionError, match="nobody seems to walk"):
        chosen(found[1:])
    with pytest.raises(MotionError, match="no foreground"):
        chosen([])
