"""Motions in every lossless format, read back by NumPy, the standard library and `motionenv.read`."""

import io
import json

import numpy as np
import pytest

import motionenv
from motionenv.types import POSE
from service.formats import FILES, JSON, MOT, NPY, TRC
from service.formats.motion import parts
from service.schemas.synthesis import MotionResponse


def walk(frames: int) -> motionenv.Motion:
    return motionenv.synthesize("walk/fpca", frames / 60, 60, seed=3)


def whole(motion: motionenv.Motion, media_type: str) -> bytes:
    return b"".join(parts(motion, media_type, "walk/fpca", 3))


@pytest.mark.parametrize("frames", [1, 999, 1000, 1001, 2500])
def test_json_is_whole_however_many_parts_it_comes_in(frames):
    motion = walk(frames)
    poses = motion.poses.copy()
    poses[frames // 2, 7] = np.nan
    told = json.loads(whole(motionenv.Motion(poses, motion.skeleton, 60.0), JSON))
    assert MotionResponse(**told).seed == 3
    assert told["pose"] == list(POSE)
    assert told["poses"][frames // 2][7] is None
    np.testing.assert_array_equal(np.array(told["poses"], dtype=float), poses)


def test_long_json_comes_in_parts():
    assert [len(list(parts(walk(n), JSON, "walk/fpca", 3))) > 1 for n in (1000, 1001)] == [False, True]


def test_npy_holds_the_poses_and_nothing_that_runs():
    motion = walk(40)
    read = np.load(io.BytesIO(whole(motion, NPY)), allow_pickle=False)
    assert read.dtype == "<f8"
    np.testing.assert_array_equal(read, motion.poses)


@pytest.mark.parametrize("media_type", [TRC, MOT])
def test_opensims_files_are_those_that_python_writes_and_come_in_parts(media_type, tmp_path):
    motion = walk(1200)
    path = tmp_path / f"a{FILES[media_type]}"
    motionenv.write(motion, path)
    assert whole(motion, media_type) == path.read_bytes()
    assert len(list(parts(motion, media_type, "walk/fpca", 3))) > 2
