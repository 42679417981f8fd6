"""Points and walkers found again in what is seen, against where they were put."""

import numpy as np
import pytest

from motionenv.envs.agents.detectors import SeenPoints, SeenWalkers, walker_at
from motionenv.models.synthesis import synthesize
from motionenv.render import Raycaster
from motionenv.render.cameras import view

WALK = synthesize("walk/fpca", 2.0, 30.0, seed=1, height=1.75)


def test_points_go_on_at_their_last_velocity():
    look = SeenPoints(np.full((15, 2), 9.0), 2)
    look.forget(np.ones(2, bool))
    velocity = np.array([0.1, -0.2])
    seen = np.ones((2, 15))
    for t in range(12):
        seen[:] = 1
        seen[0, 3] = t in (0, 2, 3)  # gaps before and after
        seen[1, 4] = t == 5
        seen[1, 5] = 0
        points = np.where(seen[..., None] > 0, 1.0 + t * velocity, np.nan)
        got = look.at(np.nan_to_num(points), seen)
        assert np.allclose(got[0], 1.0 + t * velocity) or t == 1  # at t = 1 there is no velocity yet
        assert np.allclose(got[1, 4], 9.0 if t < 5 else 1.0 + 5 * velocity)
        assert np.allclose(got[1, 5], 9.0)


def camera(alpha: float):
    """A level camera 6 m from the origin."""
    return view(alpha, distance=6.0, eye_height=1.1, target=(0.0, 0.0, 1.1), width=128, height=128)


def walker(x: float, y: float, heading: float = 0.0, frame: int = 0) -> np.ndarray:
    pose = WALK.poses[frame].copy()
    pose[[0, 1, 5]] = x, y, heading
    return pose


@pytest.mark.parametrize("alpha", [0.0, 0.5, np.pi / 2, -2.5])
@pytest.mark.parametrize("place", [(-1.0, 0.0), (0.3, 1.5), (0.8, -1.2)])
def test_a_walker_is_found_on_the_ground(alpha, place):
    where = camera(alpha)
    true, off = where.project(np.array([*place, 1.0]))[1], []
    for frame in range(0, 30, 5):
        mask = Raycaster().render(walker(*place, frame=frame), WALK.skeleton, where, rgb=False).limbs > 0
        rows, column = np.flatnonzero(mask.any(1)), mask.sum(0) @ np.arange(128) / mask.sum()
        found, depth = walker_at(where, column, rows[0] - 0.5, rows[-1] + 0.5)
        off.append([np.hypot(*(found - place)), abs(depth / true - 1)])
    metres, share = np.mean(off, axis=0)
    assert metres < 0.25
    assert share < 0.05


@pytest.mark.parametrize("name", ["mask", "depth"])
def test_a_walker_who_is_hidden_is_thought_to_go_on(name):
    far, look = 50.0, SeenWalkers(2)
    look.forget(np.ones(2, bool), [camera(0.0)] * 2)
    for frame in range(40):
        true = np.array([[-1.0 + 0.04 * frame, 0.5], [0.8 - 0.02 * frame, -0.5 + 0.02 * frame]])
        poses = [walker(*true[0], frame=frame), walker(*true[1], 3 * np.pi / 4, frame)]
        shown = [Raycaster().render(pose, WALK.skeleton, camera(0.0)) for pose in poses]
        pictures = np.stack([np.where(f.limbs > 0, f.depth, far) if name == "depth" else f.limbs for f in shown])
        if frame >= 25:  # nothing but background
            pictures = np.full_like(pictures, far if name == "depth" else 0)
        found, heading = look.at({name: pictures[..., None]}, far, 30.0)
        assert np.hypot(*(found - true).T).max() < 0.4
    assert np.abs(np.angle(np.exp(1j * (heading - [0.0, 3 * np.pi / 4])))).max() < 0.4
    look.forget(np.array([False, True]), [camera(0.0)])
    empty = np.full((2, 128, 128, 1), far if name == "depth" else 0)
    (_, fresh), headings = look.at({name: empty}, far, 30.0)
    assert fresh.tolist() == [0.0, 0.0]
    assert headings[1] == 0.0


def test_who_is_half_hidden_does_not_seem_to_be_elsewhere():
    look = SeenWalkers(1, kept=0.0)
    look.forget(np.ones(1, bool), [camera(0.0)])
    for frame in range(10):
        mask = Raycaster().render(walker(0.0, 0.0, frame=frame), WALK.skeleton, camera(0.0)).limbs[None, ..., None]
        if frame >= 5:
            mask = np.where(np.arange(128)[:, None, None] > 78, 0, mask)  # legs are behind a box
        found, _ = look.at({"mask": mask}, 50.0, 30.0)
        assert np.hypot(*found[0]) < 0.8  # their lowest row alone tells a distance of 12 m instead of 6


def test_a_blob_is_where_the_last_picture_has_it():
    look = SeenWalkers(1, kept=0.0)
    look.forget(np.ones(1, bool), [camera(0.0)])
    for x in (-1.0, 1.0):
        mask = Raycaster().render(walker(x, 0.0), WALK.skeleton, camera(0.0)).limbs[None, ..., None]
        found, heading = look.at({"mask": mask}, 50.0, 30.0)
    assert abs(found[0, 0] - 1.0) < 0.1
    assert heading[0] == 0.0
