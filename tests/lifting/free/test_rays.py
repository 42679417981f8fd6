"""Rays against the cameras that they come from, and OpenCV's distortion written out."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.lifting.free.rays import rays_of
from motionenv.render.cameras import look_at
from motionenv.types import Camera

RNG = np.random.default_rng(3)
PLACES = np.add(RNG.uniform(-1, 1, (6, 15, 3)), [0, 0, 1])
CAMERA = look_at((4.0, 1.0, 1.6), (0.0, 0.0, 1.0))


def towards(centre) -> np.ndarray:
    way = PLACES - centre
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


def test_rays_go_from_the_camera_to_what_it_sees():
    rays = rays_of(CAMERA.project(PLACES)[0], CAMERA)
    np.testing.assert_allclose(rays.directions, towards(CAMERA.centre), atol=1e-12)
    np.testing.assert_allclose(rays.origins, np.tile(CAMERA.centre, (6, 1)))
    assert rays.posed


def test_a_camera_may_move():
    cameras = [look_at((4.0, 0.3 * i, 1.6), (0.0, 0.0, 1.0)) for i in range(6)]
    pixels = np.stack([camera.project(place)[0] for camera, place in zip(cameras, PLACES, strict=True)])
    rays = rays_of(pixels, cameras)
    np.testing.assert_allclose(rays.directions, towards(rays.origins[:, None]), atol=1e-12)
    with pytest.raises(MotionError, match="each of the 6 frames, got 5"):
        rays_of(pixels, cameras[:5])


def test_intrinsics_alone_give_directions_up_to_the_azimuth():
    camera = look_at((0.0, -4.0, 1.5), (0.0, 0.0, 1.0))
    down = np.arctan2(0.5, 4.0)
    rays = rays_of(camera.project(PLACES)[0], camera.K, elevation=down)
    np.testing.assert_allclose(rays.directions, towards(camera.centre), atol=1e-12)
    assert not rays.posed
    with pytest.raises(MotionError, match="intrinsics"):
        rays_of(camera.project(PLACES)[0], np.eye(4))


@pytest.mark.parametrize("count", [4, 5, 8])
def test_distortion_is_undone(count):
    k = np.array([-0.21, 0.06, 0.002, -0.003, 0.01, 0.02, -0.01, 0.004])[:count]
    k1, k2, p1, p2, k3, k4, k5, k6 = np.append(k, np.zeros(8 - count))
    seen = PLACES @ CAMERA.R.T + CAMERA.t
    x, y = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
    r = x**2 + y**2  # OpenCV, "Camera Calibration and 3D Reconstruction"
    radial = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
    bent = np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r + 2 * x**2), y * radial + p1 * (r + 2 * y**2) + 2 * p2 * x * y]
    )
    pixels = np.moveaxis(bent, 0, -1) @ CAMERA.K[:2, :2].T + CAMERA.K[:2, 2]
    np.testing.assert_allclose(rays_of(pixels, CAMERA, k).directions, towards(CAMERA.centre), atol=1e-7)


def test_wrong_distortion_is_told():
    with pytest.raises(MotionError, match="distortion must be 4, 5 or 8"):
        rays_of(CAMERA.project(PLACES)[0], CAMERA, [0.1, 0.2])


def test_an_unknown_camera_sees_about_what_a_usual_one_does():
    camera = Camera(np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]), CAMERA.R, CAMERA.t, 640, 480)
    pixels = camera.project(PLACES)[0]
    rays = rays_of(pixels, None)
    angle = np.arccos((rays.directions[0, 0] * rays.directions[0, 5]).sum())
    truth = np.arccos((towards(camera.centre)[0, 0] * towards(camera.centre)[0, 5]).sum())
    assert angle == pytest.approx(truth, rel=0.35)
