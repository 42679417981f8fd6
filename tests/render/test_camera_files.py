"""Cameras out of files: our own, those of anipose and Pose2Sim, and what is none."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.errors import FormatError, MotionError
from motionenv.render.camera_files import read_camera
from motionenv.render.cameras import view

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
