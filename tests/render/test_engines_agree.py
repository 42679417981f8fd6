"""The two engines draw the same picture: ids, outlines, depth, colour."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from motionenv.body import LIMBS, from_height
from motionenv.render import Scene, render
from motionenv.render.cameras import look_at, view

pytestmark = pytest.mark.usefixtures("opengl")
PLAIN = Scene(shadows=False)
CAMERAS = {
    "side 64": view(0.0, width=64, height=64),
    "front 128": view(np.pi / 2, width=128, height=128),
    "oblique 256": view(0.7, width=256, height=256),
    "side 640x480": view(0.0, width=640, height=480),
    "close, from below": look_at((1.2, -1.4, 0.2), (0, 0, 0.9), width=160, height=120, fov_degrees=70),
}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("height", [1.55, 1.95])
def test_same_body(camera, height, walking):
    skeleton = from_height(height)
    a, b = (render(walking(3, height=height), skeleton, camera, scene=PLAIN, engine=e) for e in ("raycast", "pyrender"))
    body, other = a.limbs > 0, b.limbs > 0
    differ = a.limbs != b.limbs
    assert differ.mean() <= 1e-3
    assert differ.sum() <= 1e-2 * (body | other).sum()
    assert (body & other).sum() >= 0.99 * (body | other).sum()
    np.testing.assert_array_equal(other, np.isfinite(b.depth))
    common = body & ~differ
    assert np.median(np.abs(a.depth[common] - b.depth[common])) <= 2e-4
    inside = np.zeros_like(body)
    for i in range(len(body)):
        for limb in range(1, len(LIMBS) + 1):
            inside[i] |= binary_erosion((a.limbs[i] == limb) & (b.limbs[i] == limb), np.ones((3, 3)))
    assert inside.any()
    assert np.abs(a.rgb.astype(int) - b.rgb)[inside].max() <= 10  # of 255, on the nose


def test_same_ground_sky_and_shadow(walking):
    camera = view(0.4, width=320, height=240)
    pose = walking(1)[0]
    a, b = (render(pose, from_height(), camera, scene=Scene(samples=2), engine=e) for e in ("raycast", "pyrender"))
    away = (a.limbs == 0) & (b.limbs == 0)
    difference = np.abs(a.rgb.astype(int) - b.rgb).max(-1)[away]
    assert np.mean(difference) < 8
    assert np.quantile(difference, 0.98) < 25
    plain = render(pose, from_height(), camera, scene=Scene(samples=2, shadows=False)).rgb.astype(int)
    ours, theirs = ((plain - x.rgb).sum(-1) > 60 for x in (a, b))
    ours, theirs = ours & away, theirs & away
    assert (ours & theirs).sum() > 0.5 * (ours | theirs).sum() > 50
