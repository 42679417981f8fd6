"""What is to be drawn: scenes, poses and cameras against NumPy's broadcasting, and what can't be drawn."""

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height
from motionenv.errors import MotionError
from motionenv.render.cameras import view
from motionenv.render.request import batch, enlarged
from motionenv.render.scene import Scene, linear
from motionenv.types import Camera, Frame

SKELETON = from_height()


def views(n, size=24):
    return [view(0.1 * i, width=size, height=2 * size) for i in range(n)]


@pytest.mark.parametrize(
    ("lead", "n"),
    [(lead, n) for lead in ((), (3,), (2, 3), (2, 1), (4, 1, 1), (0, 3)) for n in (None, 1, 3)]
    + [((0,), None), ((0,), 1)],
)
def test_poses_and_cameras_are_paired_as_numpy_pairs_arrays(lead, n):
    poses = np.random.default_rng(0).normal(size=(*lead, 25))
    cameras = views(1)[0] if n is None else views(n)
    made = batch(poses, SKELETON, cameras)
    shape = np.broadcast_shapes(lead, () if n is None else (n,))
    number = np.broadcast_to(np.arange(n or 1) if n else 0, shape)
    assert made.shape == shape
    assert made.size == (48, 24)
    np.testing.assert_array_equal(made.which, number.ravel())
    np.testing.assert_array_equal(made.poses.reshape(*shape, 25), np.broadcast_to(poses, (*shape, 25)))


def test_frames_have_the_shape_of_the_batch_and_are_flattened_in_place():
    made = batch(np.zeros((2, 3, 25)), SKELETON, views(3))
    frame = made.empty(rgb=True)
    assert frame.rgb.shape == (2, 3, 48, 24, 3)
    assert (frame.rgb.dtype, frame.depth.dtype, frame.limbs.dtype) == (np.uint8, np.float32, np.uint8)
    assert made.empty(rgb=False).rgb is None
    flat = made.flat(frame)
    flat.depth[:] = 7.0
    assert flat.depth.shape == (6, 48, 24)
    assert (frame.depth == 7.0).all()


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("depth", lambda a: a.astype(np.float64), r"out\.depth must be a contiguous float32 .* got float64"),
        ("limbs", lambda a: a[:, :-1], r"out\.limbs must be .* of shape \(2, 48, 24\), got uint8 \(2, 47, 24\)"),
        ("rgb", lambda a: a[..., ::-1], r"out\.rgb must be a contiguous uint8"),
    ],
)
def test_a_frame_that_does_not_fit_is_told_what_it_should_be(name, change, says):
    made = batch(np.zeros((2, 25)), SKELETON, views(1)[0])
    frame = made.empty(rgb=True)
    arrays = {key: np.zeros_like(getattr(frame, key)) for key in ("rgb", "depth", "limbs")}
    with pytest.raises(MotionError, match=says):
        made.flat(Frame(**arrays | {name: change(arrays[name])}))


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_a_pixel_of_an_enlarged_view_is_a_part_of_that_of_the_view(samples):
    """Corners of the picture stay where they are; each pixel's centre is the mean of those of its parts."""
    camera = view(0.7, width=31, height=20)
    larger = enlarged(camera, samples)
    assert (larger.width, larger.height) == (31 * samples, 20 * samples)
    points = np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose((larger.project(points)[0] + 0.5) / samples, camera.project(points)[0] + 0.5)
    np.testing.assert_array_equal(larger.centre, camera.centre)


def odd(**changes) -> Camera:
    camera = view(0.0, width=24, height=48)
    return Camera(**{"K": camera.K, "R": camera.R, "t": camera.t, "width": 24, "height": 48} | changes)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"poses": np.full((2, 25), np.inf)}, r"poses must be finite, or NaN where unknown; poses\[0, 0\] is inf"),
        ({"poses": np.zeros((2, 24))}, r"poses must have shape \(\.\.\., 25\), got \(2, 24\)"),
        ({"poses": 1.0}, r"got \(\)"),
        ({"cameras": []}, "cameras must be a Camera or a sequence of at least one"),
        ({"cameras": [1]}, "cameras must be a Camera or a sequence"),
        ({"cameras": views(2)}, r"one per pose; got 2 for poses of batch shape \(3,\)"),
        ({"cameras": [*views(2), *views(1, size=32)]}, "must have the same image size"),
        ({"cameras": odd(K=np.eye(3) * 2)}, r"Camera\.K must be invertible with last row \(0, 0, 1\)"),
        ({"cameras": odd(K=np.diag([0.0, 1, 1]))}, r"Camera\.K must be invertible"),
    ],
)
def test_what_can_not_be_drawn_is_named(bad, says):
    given = {"poses": np.zeros((3, 25)), "skeleton": SKELETON, "cameras": views(1)[0]}
    with pytest.raises(MotionError, match=says):
        batch(**given | bad)


def test_lights_come_from_where_they_were_put_with_the_strength_that_was_given():
    scene = Scene(key=(0, 3, 4), key_light=(1, 2, 3), fill=(0, 0, 9))
    np.testing.assert_allclose(scene.lights[0], [0, 0.6, 0.8, 1, 2, 3])
    np.testing.assert_allclose(scene.lights[1, :3], [0, 0, 1])
    assert Scene(key=(0, 0.3, 0.4), key_light=(1, 2, 3), fill=(0, 0, 1)) == scene


def test_limbs_wear_their_clothes():
    scene = Scene(skin=(1, 0, 0), shirt=(0, 1, 0), trousers=(0, 0, 1), shoes=(1, 1, 1))
    worn = dict(zip(LIMBS, scene.limb_colours, strict=True))
    for limb, colour in (
        ("head", [1, 0, 0]),
        ("left_hand", [1, 0, 0]),
        ("right_upper_arm", [0, 1, 0]),
        ("left_trunk", [0, 1, 0]),
        ("left_shin", [0, 0, 1]),
        ("right_foot", [1, 1, 1]),
    ):
        np.testing.assert_array_equal(worn[limb], colour)


def test_half_as_bright_to_the_eye_is_about_a_fifth_of_the_light():
    np.testing.assert_allclose(linear([0.0, 0.5, 1.0]), [0, 0.2176, 1], atol=1e-4)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"samples": 5}, r"Scene\.samples must be 1, 2, 3 or 4, got 5"),
        ({"key": (0, 0, -1)}, r"Scene\.key must be a direction with z > 0, got \(0, 0, -1\)"),
        ({"key": (1, 0, 0)}, r"Scene\.key must be a direction"),
        ({"fill": (0, 1)}, r"Scene\.fill must be a direction with z > 0"),
        ({"fill": (0, 0, np.nan)}, r"Scene\.fill"),
        ({"tile": 0}, r"Scene\.tile must be a number of metres above 0, got 0"),
        ({"fade": -1.0}, r"Scene\.fade must be a number of metres above 0, got -1\.0"),
    ],
)
def test_scenes_that_can_not_be_lit_are_named(bad, says):
    with pytest.raises(MotionError, match=says):
        Scene(**bad)
