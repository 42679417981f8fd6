"""Heels and toes from their rays: of a body whose feet are known."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.gait import feet_of
from motionenv.lifting.free.feet import FootRays, lift_feet
from motionenv.models.synthesis import synthesize

MOTION = synthesize("walk/fpca", 3, 30.0, seed=2)
PLACES = markers(MOTION.poses, MOTION.skeleton)
_FEET = feet_of(MOTION)
FEET = np.stack([getattr(_FEET, part)[side] for side in ("left", "right") for part in ("heel", "toe")], axis=1)
SIDE, FRONT = np.array([1.5, -6.0, 1.0]), np.array([9.0, 0.2, 1.0])


def rays(camera, noise=0.0, seed=0) -> FootRays:
    """Towards the feet from a camera, whose points err by `noise` [m] throughout."""
    off = noise * np.random.default_rng(seed).standard_normal((1, 4, 3))
    ways = FEET + off - camera
    directions = ways / np.linalg.norm(ways, axis=-1, keepdims=True)
    return FootRays(directions, np.broadcast_to(camera, (len(FEET), 3)), max(noise, 0.004))


def error(found: np.ndarray) -> np.ndarray:
    return np.linalg.norm(found - FEET, axis=-1)


def test_from_the_side_rays_tell_where_feet_are():
    found = lift_feet(PLACES, rays(SIDE))
    across = np.abs((found - FEET)[..., [0, 2]])
    assert across.mean() < 0.005
    assert error(found).mean() < 0.03


def test_from_the_front_lengths_tell_how_far_the_toe_is_ahead():
    found = lift_feet(PLACES, rays(FRONT))
    ahead = (found[:, 1] - found[:, 0])[:, 0]
    true = (FEET[:, 1] - FEET[:, 0])[:, 0]
    assert np.corrcoef(ahead, true)[0, 1] > 0.9
    assert error(found).mean() < 0.05


@pytest.mark.parametrize("camera", [SIDE, FRONT], ids=["side", "front"])
def test_draws_hold_the_truth(camera):
    inside = []
    for seed in range(6):
        towards = rays(camera, 0.012, seed)
        found = lift_feet(PLACES, towards)
        drawn = lift_feet(np.broadcast_to(PLACES, (60, *PLACES.shape)), towards, np.random.default_rng(seed))
        inside.append(np.abs(FEET - found) < 1.645 * drawn.std(axis=0))
    assert 0.75 < np.mean(inside) <= 1


def test_what_is_not_seen_stays_unknown():
    towards = rays(SIDE)
    gone = towards.directions.copy()
    gone[5:9, :2] = np.nan  # the left foot
    gone[20, 1] = np.nan  # only its toe
    places = PLACES.copy()
    places[40, 12] = np.nan  # the right knee
    found = lift_feet(places, FootRays(gone, towards.origins, towards.noise))
    assert np.isnan(found[5:9, :2]).all()
    assert np.isfinite(found[5:9, 2:]).all()
    assert error(found)[20, 1] < 0.06
    assert np.isnan(found[40, 2:]).all()
    assert np.isfinite(np.delete(found, [*range(5, 9), 40], axis=0)).all()
