"""C3D files read by ezc3d itself, and by our reader."""

import ezc3d
import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.mocap.readers import c3d
from motionenv.mocap.writers import c3d as c3d_writer
from motionenv.types import MARKERS, POSE, Motion


def with_gap(motion):
    """The left knee's angle unknown in frames 3 to 7: nobody knows where the ankle is. Nothing at all in frame 9."""
    poses = motion.poses.copy()
    poses[3:8, POSE.index("left_knee_flexion")] = np.nan
    poses[9] = np.nan
    return Motion(poses, motion.skeleton, motion.fps)


def test_ezc3d_reads_the_markers(walk, tmp_path):
    motion = with_gap(walk)
    c3d_writer.write(motion, tmp_path / "a.c3d")
    file = ezc3d.c3d(str(tmp_path / "a.c3d"))
    point = {name: p["value"] for name, p in file["parameters"]["POINT"].items() if name != "__METADATA__"}
    assert point["LABELS"] == list(MARKERS)
    assert (point["UNITS"], point["X_SCREEN"], point["Y_SCREEN"]) == (["mm"], ["+X"], ["+Z"])
    assert (point["RATE"][0], file["header"]["points"]["frame_rate"]) == (120.0, 120.0)
    expected = 1000 * markers(motion.poses, motion.skeleton).transpose(2, 1, 0)
    np.testing.assert_allclose(file["data"]["points"][:3], expected, atol=1e-3)
    residuals = file["data"]["meta_points"]["residuals"][0]
    np.testing.assert_array_equal(residuals, np.where(np.isnan(expected[0]), -1.0, 0.0))
    assert (residuals[:, 9] == -1).all()
    assert [MARKERS[i] for i in np.flatnonzero(residuals[:, 5])] == ["left_ankle"]


def test_our_reader_gives_markers_and_gaps_back(walk, any_motion, tmp_path):
    for motion in (with_gap(walk), any_motion(1), any_motion(2, frames=1, fps=29.97)):
        c3d_writer.write(motion, tmp_path / "a.c3d")
        found = c3d.read(tmp_path / "a.c3d")
        assert found.names == MARKERS
        assert found.fps == pytest.approx(motion.fps, rel=1e-6)
        np.testing.assert_allclose(found.positions, markers(motion.poses, motion.skeleton), atol=1e-6)


def test_a_full_count_of_frames_and_one_more(any_motion, tmp_path):
    skeleton = any_motion(0).skeleton
    c3d_writer.write(Motion(np.zeros((65535, 25)), skeleton, 120.0), tmp_path / "a.c3d")
    assert ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["points"].shape == (4, 15, 65535)
    with pytest.raises(MotionError, match="at most 65535 frames, got 65536"):
        c3d_writer.write(Motion(np.zeros((65536, 25)), skeleton, 120.0), tmp_path / "b.c3d")
    assert not (tmp_path / "b.c3d").exists()
