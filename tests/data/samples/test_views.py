import numpy as np
import pytest

from motionenv.data import Sampler, Specification
from motionenv.data.samples.groups import Group
from motionenv.data.samples.walkers import PELVIS
from motionenv.types import Camera


def group(**changes) -> Group:
    return Group(Specification(clip=20, fps=20, people={"views": 2, "turning": 0.5}).replace(**changes), 0)


def test_cameras_are_opencv_cameras():
    made = group(cameras={"elevation": [-20, 40], "follow": 0.5})
    views, width, height = made.views, made.spec.pictures.width, made.spec.pictures.height
    pixels, depth = views.project(made.joints)
    for i in range(0, 32, 5):
        for f in (0, 19):
            camera = Camera(views.K[i], views.R[i], views.t[i, f], width, height)  # checks that R is a rotation
            expected = camera.project(made.joints[i, f])
            np.testing.assert_allclose(pixels[i, f], expected[0], atol=1e-9)
            np.testing.assert_allclose(depth[i, f], expected[1], atol=1e-12)


@pytest.mark.parametrize("follow", [0.0, 1.0])
def test_margins_are_kept_and_the_walker_is_as_large_as_they_allow(follow):
    made = group(cameras={"margin": [0.1, 0.1], "follow": follow, "elevation": [0, 30]})
    pixels, _ = made.views.project(made.joints)
    pixels = pixels.reshape(32, -1, 2)
    low, high = pixels.min(axis=1) / 128, pixels.max(axis=1) / 128
    assert low.min() > 0.1 - 1e-6
    assert high.max() < 0.9 + 1e-6
    assert (np.max(high - low, axis=1) > 0.45).all()  # less than 0.8 by head, hands and feet beyond the joints
    if follow:
        assert (np.linalg.norm(np.diff(made.views.t, axis=1), axis=-1).max(axis=1) > 0.005).all()
    else:
        assert np.ptp(made.views.t, axis=1).max() == 0


def test_pictures_with_margins_show_the_whole_body():
    spec = Specification(frames=64, cameras={"margin": [0.05, 0.2], "elevation": [0, 40]}, output={"fields": ["mask"]})
    for sample in Sampler(spec).samples(0, 64):
        mask = sample["mask"]
        assert mask.any()
        assert not mask[[0, -1]].any()
        assert not mask[:, [0, -1]].any()


def test_angles_and_distances_are_those_asked_for():
    made = group(cameras={"angle": [90, 90], "elevation": [0, 0], "distance": [7, 7]})
    assert np.allclose(made.views.R[:, 2, 0], -1)  # from the front: the camera looks along -x
    centre = -np.einsum("nji,nj->ni", made.views.R, made.views.t[:, 0])
    assert np.allclose(centre[:, 0] - made.joints[:, :, PELVIS, 0].mean(axis=1), 7, atol=0.7)
    opening = 2 * np.degrees(np.arctan(64 / made.views.K[:, 1, 1]))
    assert (opening >= 30).all()
    assert (opening <= 60).all()
