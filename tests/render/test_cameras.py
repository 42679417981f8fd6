"""Cameras against brute-force geometry: rays, hand-made pinholes, the view angle's definition."""

import json
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from motionenv.body import from_height
from motionenv.errors import FormatError, GapError, MotionError
from motionenv.render import cameras
from motionenv.render.cameras import read_camera, view
from motionenv.types import Camera, Motion

coordinates = st.floats(-3, 3, width=32)
angles = st.floats(-math.pi, math.pi)


def ray(camera: Camera, pixel, distance: float) -> np.ndarray:
    """The world point at `distance` along the ray through `pixel`, from first principles."""
    f = camera.height / 2 / math.tan(math.radians(40) / 2)
    direction = np.array([(pixel[0] - (camera.width - 1) / 2) / f, (pixel[1] - (camera.height - 1) / 2) / f, 1.0])
    return camera.centre + camera.R.T @ (direction / np.linalg.norm(direction)) * distance


@given(arrays(float, 3, elements=coordinates), arrays(float, 3, elements=coordinates), st.floats(0.5, 20))
def test_point_on_a_pixels_ray_projects_to_that_pixel(eye, target, distance):
    assume(np.linalg.norm((target - eye)[:2]) > 1e-3)  # straight up or down is tested below
    camera = cameras.look_at(eye, target, width=321, height=200)
    pixel = np.array([17.25, 180.5])
    back, depth = camera.project(ray(camera, pixel, distance))
    np.testing.assert_allclose(back, pixel, atol=1e-7)
    assert 0 < depth < distance
    np.testing.assert_allclose(camera.centre, eye, atol=1e-9)
    np.testing.assert_allclose(camera.project(target)[0], [160, 99.5], atol=1e-7)


def test_projection_by_hand():
    """A camera at (0, -2, 1) looking along +y, 90° field of view, 101 rows: 50.5 pixels per unit of slope."""
    camera = cameras.look_at((0, -2, 1), (0, 0, 1), width=201, height=101, fov_degrees=90)
    pixels, depth = camera.project([[0, 0, 1], [1, 0, 1], [0, 0, 2], [0, 2, 0]])
    np.testing.assert_allclose(pixels, [[100, 50], [125.25, 50], [100, 24.75], [100, 62.625]])
    np.testing.assert_allclose(depth, [2, 2, 2, 4])


def test_field_of_view_spans_the_picture_from_edge_to_edge():
    camera = cameras.look_at((0, -1, 0), (0, 0, 0), width=64, height=48, fov_degrees=60)
    top = camera.project([0, 0, math.tan(math.radians(30))])[0]
    np.testing.assert_allclose(top, [31.5, -0.5], atol=1e-12)


def test_up_can_be_chosen():
    camera = cameras.look_at((0, 0, 5), (0, 0, 0), up=(1, 0, 0))
    middle = np.array([319.5, 239.5])
    assert (camera.project([1, 0, 0])[0] - middle)[1] < -1  # x is up
    assert (camera.project([0, 1, 0])[0] - middle)[0] < -1  # then y is to the left, seen from above


@given(angles)
def test_view_angle_is_paper_bs(alpha):
    """The image axis is cos α·x + sin α·y, z points up in the picture, and the camera is level."""
    camera = cameras.view(alpha, eye_height=0.9)
    np.testing.assert_allclose(camera.R[0], [math.cos(alpha), math.sin(alpha), 0], atol=1e-12)
    np.testing.assert_allclose(camera.R[1], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(camera.centre, [4.5 * math.sin(alpha), -4.5 * math.cos(alpha), 0.9], atol=1e-12)


def test_side_and_frontal_view():
    middle = cameras.view(0).project([0, 0, 0.9])[0]
    ahead, up = (cameras.view(0).project(p)[0] - middle for p in ([1, 0, 0.9], [0, 0, 1.9]))
    assert ahead[0] > 100  # α = 0: x, the direction of walking, is to the right
    assert abs(ahead[1]) < 1e-9
    assert up[1] < -100  # z up in the picture is -v
    left_hand = cameras.view(math.pi / 2).project([0, 0.5, 0.9])[0] - middle
    assert left_hand[0] > 50  # from the front the walker's left is to the right
    assert cameras.view(math.pi / 2).centre[0] > 0
    assert cameras.view(-math.pi / 2).centre[0] < 0


@given(arrays(float, (7, 3), elements=coordinates), angles)
def test_distant_camera_sees_the_orthographic_view(points, alpha):
    distance = 1e5
    camera = cameras.view(alpha, distance=distance, eye_height=0.0, target=(0, 0, 0))
    seen = (camera.project(points)[0] - [319.5, 239.5]) * distance / camera.K[0, 0]
    np.testing.assert_allclose(seen * [1, -1], cameras.orthographic(points, alpha), atol=1e-3)


def test_orthographic_broadcasts_angles():
    points = np.random.default_rng(0).normal(size=(4, 5, 3))
    alphas = np.array([0.0, 0.3, 1.0, -2.0])
    many = cameras.orthographic(points, alphas[:, None])
    for i, alpha in enumerate(alphas):
        np.testing.assert_array_equal(many[i], cameras.orthographic(points[i], alpha))
    np.testing.assert_array_equal(cameras.orthographic(points, 0.0), points[..., [0, 2]])


def test_orthographic_picture():
    picture = cameras.Orthographic(alpha=math.pi / 2, scale=100, target=(0, 0, 1), width=201, height=101)
    pixels, depth = picture.project([[0, 0, 1], [0.3, 0.5, 1.2]])
    np.testing.assert_allclose(pixels, [[100, 50], [150, 30]])
    np.testing.assert_allclose(depth, [0, -0.3], atol=1e-12)


@settings(max_examples=60)
@given(
    arrays(float, (9, 3), elements=coordinates), angles, st.floats(0, 0.4), st.floats(-1.2, 1.2), st.integers(20, 900)
)
def test_fit_holds_every_point_and_could_not_be_nearer(points, alpha, margin, elevation, width):
    camera = cameras.fit_view(points, alpha, width=width, height=300, margin=margin, elevation=elevation)
    pixels, depth = camera.project(points)
    size = np.array([width, 300])
    inside = (pixels + 0.5) / size
    assert (depth > 0.0999).all()
    assert (inside > margin - 1e-9).all()
    assert (inside < 1 - margin + 1e-9).all()
    np.testing.assert_allclose(camera.R[0], [math.cos(alpha), math.sin(alpha), 0], atol=1e-12)
    np.testing.assert_allclose(camera.R[2, 2], -math.sin(elevation), atol=1e-12)
    touches = np.isclose(inside.min(0), margin, atol=1e-6) & np.isclose(inside.max(0), 1 - margin, atol=1e-6)
    assert touches.any() or np.isclose(depth.min(), 0.1)


def test_fit_leaves_out_gaps():
    points = np.array([[0, 0, 0], [1, 0, 1], [np.nan, 0, 50]], dtype=float)
    np.testing.assert_array_equal(cameras.fit_view(points, 0.3).t, cameras.fit_view(points[:2], 0.3).t)


def walk(frames=90, sway=0.0, rng=None):
    t = np.arange(frames) / 30
    sideways = sway * np.sin(2 * np.pi * t)
    return np.stack([1.3 * t, 0.2 * t + sideways, 0.95 + 0.02 * np.sin(4 * np.pi * t)], -1)


def test_follow_holds_a_steady_walker_still():
    """A walker at constant velocity stays where the template has him; height is his own."""
    template = cameras.view(0.4)
    path = walk()
    many = cameras.follow(path, template)
    assert len(many) == len(path)
    for position, camera in zip(path, many, strict=True):
        np.testing.assert_allclose(camera.project(position)[0], template.project([0, 0, position[2]])[0], atol=1e-6)
        np.testing.assert_array_equal(camera.R, template.R)
        assert camera.centre[2] == pytest.approx(template.centre[2])


@pytest.mark.parametrize("smooth", [math.inf, 30.0])
def test_follow_does_not_sway_with_the_walker(smooth):
    template = cameras.view(0.0)
    many = cameras.follow(walk(sway=0.05), template, smooth=smooth)
    centres = np.stack([c.centre for c in many])
    acceleration = np.abs(np.diff(centres, 2, axis=0)).max() * 30**2
    assert acceleration < 0.15  # the walker's own is 0.05·(2π)² = 2 m/s²


def test_follow_keeps_up_in_a_turn():
    t = np.linspace(0, np.pi, 200)
    path = np.stack([4 * np.sin(t), 4 - 4 * np.cos(t), np.ones(200)], -1)
    template = cameras.view(0.0)
    shifts = np.stack([c.centre - template.centre for c in cameras.follow(path, template, smooth=10)])
    assert np.linalg.norm(shifts[:, :2] - path[:, :2], axis=-1).max() < 0.6
    inner = shifts[40:-40, :2]
    np.testing.assert_allclose(inner, gaussian_filter1d(path, 10, axis=0)[40:-40, :2], atol=1e-6)


def test_follow_bridges_gaps_and_takes_a_motion():
    path = walk()
    whole = cameras.follow(path, cameras.view(0.0), smooth=15)
    poses = np.zeros((len(path), 25))
    poses[:, :3] = path
    poses[20:50, 1] = np.nan
    motion = Motion(poses, from_height(), 30)
    bridged = cameras.follow(motion, cameras.view(0.0), smooth=15)
    np.testing.assert_allclose([c.t for c in bridged], [c.t for c in whole], atol=1e-9)


def test_project_hides_what_is_behind_and_takes_a_camera_per_frame():
    points = np.random.default_rng(1).normal(size=(2, 6, 15, 3))
    points[0, 0, 0] = [0, -50, 1]
    many = [cameras.view(a) for a in np.linspace(0, 3, 6)]
    pixels, depth = cameras.project(points, many)
    assert pixels.shape == (2, 6, 15, 2)
    assert np.isnan(pixels[0, 0, 0]).all()
    assert depth[0, 0, 0] < 0
    np.testing.assert_allclose(pixels[1, 4], many[4].project(points[1, 4])[0])
    with pytest.raises(MotionError, match="got 5 cameras"):
        cameras.project(points, many[:5])


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: cameras.look_at((0, 0, 1), (0, 0, 1)), "differ"),
        (lambda: cameras.look_at((0, 0, 1), (0, 0, 5)), "parallel"),
        (lambda: cameras.look_at((0, 0), (0, 0, 5)), "eye"),
        (lambda: cameras.look_at((0, 0, np.nan), (0, 0, 5)), "differ"),
        (lambda: cameras.look_at((1, 0, 0), (0, 0, 0), fov_degrees=180), "fov_degrees"),
        (lambda: cameras.look_at((1, 0, 0), (0, 0, 0), width=0), "width"),
        (lambda: cameras.view(0.0, distance=0), "distance"),
        (lambda: cameras.view(math.nan), "differ"),
        (lambda: cameras.fit_view(np.zeros((4, 3)), 0.0, margin=0.5), "margin"),
        (lambda: cameras.fit_view(np.zeros((4, 3)), 0.0, elevation=2), "elevation"),
        (lambda: cameras.fit_view(np.full((4, 3), np.nan), 0.0), "at least one point"),
        (lambda: cameras.follow(np.full((4, 3), np.nan), cameras.view(0)), "at least one frame"),
        (lambda: cameras.follow(np.zeros((4, 2)), cameras.view(0)), "path"),
        (lambda: cameras.follow(np.zeros((4, 3)), cameras.view(0), smooth=0), "smooth"),
        (lambda: cameras.Orthographic(0.0, scale=0), "scale"),
    ],
)
def test_bad_input_says_what_is_wrong(call, match):
    with pytest.raises(MotionError, match=match):
        call()


def test_nothing_known_is_a_gap():
    with pytest.raises(GapError):
        cameras.fit_view(np.full((4, 3), np.nan), 0.0)


CAMERA = view(0.4, width=80, height=60)
ROWS = {"K": CAMERA.K.tolist(), "R": CAMERA.R.tolist(), "t": CAMERA.t.tolist(), "width": 80, "height": 60}
VECTOR = Rotation.from_matrix(CAMERA.R).as_rotvec().tolist()
TABLE = f"size = [80.0, 60.0]\nmatrix = {ROWS['K']}\nrotation = {VECTOR}\ntranslation = {ROWS['t']}\n"


def saved(folder, name: str, content):
    (folder / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return folder / name


def test_the_camera_that_was_written_is_read(tmp_path):
    two = saved(tmp_path, "two.TOML", f"[cam01]\nname = 'left'\n{TABLE}\n[cam02]\n{TABLE}\n[metadata]\nerror = 0\n")
    one = saved(tmp_path, "one.toml", f"[cam01]\n{TABLE}")
    for read in (
        read_camera(saved(tmp_path, "one.json", ROWS)),
        read_camera(one),
        read_camera(two, "left"),
        read_camera(str(two), "cam02"),
    ):
        np.testing.assert_allclose(read.project(np.ones(3))[0], CAMERA.project(np.ones(3))[0])
        assert (read.width, read.height) == (80, 60)


def test_of_several_cameras_one_is_asked_for(tmp_path):
    two = saved(tmp_path, "two.toml", f"[cam01]\nname = 'left'\n{TABLE}\n[cam02]\nname = 2\n{TABLE}")
    with pytest.raises(MotionError, match="two.toml has 2 cameras; select one by name: cam01, cam02"):
        read_camera(two)
    with pytest.raises(MotionError, match="two.toml has no camera 'right'; it has cam01, left, cam02, 2"):
        read_camera(two, "right")


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.json", [], "must hold an object with K, R, t, width and height"),
        ("a.json", "{", "can't be read as a camera"),
        ("a.json", {"K": 1}, "lacks 'R'"),
        ("a.json", ROWS | {"width": "wide"}, r"Camera\.width must be a whole number of pixels .*, got 'wide'"),
        ("a.json", ROWS | {"K": [[1, 2], [3, 4]]}, r"Camera\.K must have shape \(3, 3\)"),
        ("a.json", ROWS | {"R": np.zeros((3, 3)).tolist()}, r"Camera\.R must be a rotation matrix"),
        ("a.toml", "", "no table with a matrix"),
        ("a.toml", f"[cam01]\n{TABLE}".replace("size", "sizes"), "lacks 'size'"),
        ("a.toml", f"[cam01]\n{TABLE}".replace("[80.0, 60.0]", "[80, 60, 3]"), "isn't a valid camera"),
        ("a.toml", f"[cam01]\n{TABLE}".replace(str(VECTOR), "[0.0, 0.0]"), "isn't a valid camera"),
        ("a.txt", "", "the suffix must be .json or .toml"),
    ],
)
def test_what_is_no_camera_is_told_with_its_file(tmp_path, name, content, says):
    with pytest.raises(FormatError, match=rf"{name}: .*{says}"):
        read_camera(saved(tmp_path, name, content))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FormatError, match=r"none\.json: can't be read as a camera: No such file"):
        read_camera(tmp_path / "none.json")
