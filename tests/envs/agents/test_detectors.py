"""Points and walkers found again in what is seen, against where they were put."""

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.envs.agents.baselines import walking_poses
from motionenv.envs.agents.detectors import SeenPoints, SeenWalkers, walker_at
from motionenv.render import Raycaster
from motionenv.render.cameras import view


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


@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.2, np.pi / 2, -2.5])
@pytest.mark.parametrize("x", [-1.0, 0.3])
def test_a_walker_is_found_on_the_line(alpha, x):
    camera = view(alpha, distance=6.0, width=128, height=128)
    pose = walking_poses(1)[0] + np.eye(25)[0] * x
    mask = Raycaster().render(pose, from_height(1.75), camera, rgb=False).limbs > 0
    rows = np.flatnonzero(mask.any(1))
    found = walker_at(camera, mask.sum(0) @ np.arange(128) / mask.sum(), rows[-1] - rows[0] + 1)
    assert abs(found - x) < (0.1 if abs(np.cos(alpha)) > 0.5 else 0.4)


@pytest.mark.parametrize("name", ["mask", "depth"])
def test_a_walker_who_is_hidden_is_thought_to_go_on(name):
    camera, far = view(0.0, distance=6.0, width=128, height=128), 50.0
    look = SeenWalkers(2)
    look.forget(np.ones(2, bool), [camera, camera])
    for frame in range(12):
        x = np.array([-0.8 + 0.1 * frame, 0.8 - 0.05 * frame])
        shown = [Raycaster().render(walking_poses(1)[0] + np.eye(25)[0] * at, from_height(1.75), camera) for at in x]
        pictures = np.stack([np.where(f.limbs > 0, f.depth, far) if name == "depth" else f.limbs for f in shown])
        if frame >= 8:  # nothing but background
            pictures = np.full_like(pictures, far if name == "depth" else 0)
        found = look.at({name: pictures[..., None]}, far)
        assert np.abs(found - x).max() < (0.12 if frame < 8 else 0.25)
    look.forget(np.array([False, True]), [camera])
    empty = np.full((2, 128, 128, 1), far if name == "depth" else 0)
    left, fresh = look.at({name: empty}, far)
    assert abs(left - 0.4) < 0.3
    assert fresh == 0.0
