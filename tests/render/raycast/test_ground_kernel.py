"""The ground: the same wherever the camera came from, tiles where geometry says, edges as many rays would mix them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from motionenv.body import from_height
from motionenv.render import Raycaster, Scene, render
from motionenv.render.cameras import follow, view
from motionenv.render.request import enlarged
from motionenv.types import Camera

SKELETON = from_height()
SIZE = {"width": 96, "height": 72}
AWAY = np.eye(25)[0] * -500  # a body so far off that the ground is all there is


def moved(camera: Camera, shift) -> Camera:
    return Camera(camera.K, camera.R, camera.t - camera.R @ np.asarray(shift, float), camera.width, camera.height)


def ground(camera: Camera, **scene) -> np.ndarray:
    """The picture without a body, as int (height, width, 3)."""
    return render(AWAY, SKELETON, camera, scene=Scene(shadows=False, **scene)).rgb.astype(int)


@pytest.mark.parametrize("samples", [1, 2])
def test_travelling_camera_sees_what_a_fresh_raycaster_draws(samples, walking):
    scene, poses = Scene(samples=samples), walking(24)
    poses[:, 0] += np.linspace(-20, 20, len(poses))
    cameras = follow(poses[:, :3], view(0.7, **SIZE))
    one = Raycaster(scene, threads=2)
    one.render(poses, SKELETON, cameras[::-1])  # fill the caches in another order
    travelling = one.render(poses, SKELETON, cameras)
    for i in (0, 9, 23):
        alone = Raycaster(scene).render(poses[i], SKELETON, cameras[i])
        np.testing.assert_array_equal(travelling.rgb[i], alone.rgb)
        np.testing.assert_array_equal(travelling.limbs[i], alone.limbs)


def test_ground_repeats_after_two_tiles_and_not_before(walking):
    camera, pose = view(0.7, **SIZE), walking(1)[0]
    scene = Scene(samples=2, tile=0.5)
    for shift, same in (((1, 0, 0), True), ((-3, 2, 0), True), ((0.5, 0.5, 0), True), ((0.5, 0, 0), False)):
        there = pose + np.concatenate([shift, np.zeros(22)])
        a = render(pose, SKELETON, camera, scene=scene)
        b = render(there, SKELETON, moved(camera, shift), scene=scene)
        assert ((a.rgb == b.rgb).mean() > 0.9999) == same
        assert np.abs(a.rgb.astype(int) - b.rgb).max() <= 1 or not same


@pytest.mark.parametrize("shift", [(0, 0, 0), (123.4, -56.7, 0)])
def test_tiles_lie_where_rays_meet_the_ground(shift):
    """Where a pixel and those around it see one tile only, it has the colour of ground that is all of that tile's.

    The tile that begins at the origin has the first colour.
    """
    camera = moved(view(0.7, width=320, height=240), shift)
    one, other = (0.8, 0.2, 0.3), (0.1, 0.4, 0.6)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    ray = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera.K).T @ camera.R
    near = ray[..., 2] < -0.25 * np.linalg.norm(ray, axis=-1)
    where = camera.centre[:2] - camera.centre[2] / ray[..., 2:] * ray[..., :2]
    first = (np.floor(where / 0.5).sum(-1) % 2 == 0).astype(int)
    alone = near & (minimum_filter(first, 5) == maximum_filter(first, 5))
    assert alone.sum() > 3000
    picture = ground(camera, tiles=(one, other))
    plain = [ground(camera, tiles=(x, x)) for x in (one, other)]
    expected = np.where(first[..., None] == 1, *plain)
    np.testing.assert_array_equal(picture[alone], expected[alone])
    low, high = np.minimum(*plain), np.maximum(*plain)
    assert ((picture >= low - 1) & (picture <= high + 1)).all()


def test_edges_of_tiles_are_mixed_as_many_rays_would():
    camera = view(0.0, **SIZE)
    coarse = ground(camera)
    fine = ground(enlarged(camera, 8)).reshape(72, 8, 96, 8, 3).mean((1, 3))
    assert np.abs(coarse - fine).max() < 8
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 1


def test_shadow_of_more_rays_is_as_dark():
    pose, camera = np.eye(25)[2] * 0.93, view(0.4, **SIZE)
    few, many = (render(pose, SKELETON, camera, scene=replace(Scene(), samples=n)) for n in (1, 4))
    free = maximum_filter(few.limbs, 3) == 0
    difference = (few.rgb.astype(int) - many.rgb)[free]
    assert np.abs(difference).mean() < 1
    assert abs(difference.mean()) < 0.2
