"""A film of somebody who crosses the picture before clutter, compressed, with noise and changing light."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.render.video.encode import write_video

FPS, HEIGHT, FRAMES = 30, 1.75, 60


@pytest.fixture(scope="package")
def crossing(tmp_path_factory):
    """A film of somebody who crosses the picture, its camera, his poses and body."""
    rng = np.random.default_rng(5)
    walk = synthesize("walk/fpca", FRAMES / FPS, FPS, seed=22, height=HEIGHT)
    poses = walk.poses - np.eye(25)[0] * walk.poses[:, :1].mean()
    camera = view(0.0, width=256, height=192, distance=5.0)
    drawn = render(poses, walk.skeleton, camera)
    limbs = drawn.limbs
    clutter = 180 + 400 * gaussian_filter(rng.normal(0, 1, (192, 256, 3)), (6, 6, 0))
    light = 1 + 0.05 * np.sin(np.arange(FRAMES) / 9)
    pictures = np.where(limbs[..., None] > 0, drawn.rgb, clutter) * light[:, None, None, None]
    noisy = np.clip(pictures + 6 * rng.standard_normal(pictures.shape), 0, 255).astype(np.uint8)
    path = tmp_path_factory.mktemp("films") / "walk.mp4"
    write_video(path, noisy, FPS, crf=30)
    return path, camera, poses, walk.skeleton, limbs > 0
