"""A camera that moves is told from people who do, on crops of one texture."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from motionenv.errors import MotionError
from motionenv.tracking.video.survey import refuse_moving

FPS, FRAMES = 20.0, 40


def crops(shift: np.ndarray) -> np.ndarray:
    """Pictures (T, 96, 128, 3) of a texture seen `shift` (T, 2) pixels further, with noise."""
    rng = np.random.default_rng(3)
    wall = gaussian_filter(rng.standard_normal((200, 300)), 2)
    wall = 128 + 40 * wall / wall.std()
    seen = np.stack([wall[40 + y : 136 + y, 80 + x : 208 + x] for y, x in shift.round().astype(int)])
    return np.clip(seen[..., None] + 4 * rng.standard_normal((*seen.shape, 3)), 0, 255).astype(np.uint8)


def test_pans_and_shakes_are_refused_with_a_way_out():
    time = np.arange(FRAMES)[:, None]
    for shift in (time * [0, 0.5], 6 * np.sin(time / [3, 5])):
        with pytest.raises(MotionError, match=r"the camera moves.*tripod"):
            refuse_moving(crops(shift), FPS)


def test_somebody_large_or_changing_light_is_no_camera():
    still = crops(np.zeros((FRAMES, 2)))
    refuse_moving(still, FPS)
    person = still.copy()
    for t in range(FRAMES):
        person[t, 5:90, 2 * t : 2 * t + 40] = 30
    refuse_moving(person, FPS)
    light = still * (1 + 0.1 * np.sin(np.arange(FRAMES) / 5))[:, None, None, None]
    refuse_moving(np.clip(light, 0, 255).astype(np.uint8), FPS)
    refuse_moving(np.full((5, 32, 32, 3), 50, dtype=np.uint8), FPS)  # nothing to see
