"""Files read as motions of the body, and told in two lines."""

import re

import numpy as np
import pytest

import motionenv
from motionenv.errors import FormatError, MotionError
from motionenv.mocap import read, retarget
from motionenv.mocap.motion_io import describe, read_motion


def test_a_motion_is_as_written_and_capture_is_put_on_the_body(mocap, any_motion, tmp_path):
    motion = any_motion(1)
    motionenv.write(motion, tmp_path / "a.npz")
    assert read_motion(tmp_path / "a.npz").poses.tobytes() == motion.poses.tobytes()
    path = mocap / "cmu_asfamc" / "02" / "02_01.amc"
    np.testing.assert_array_equal(read_motion(path, fps=120).poses, retarget(read(path, fps=120)).poses)


def test_what_can_not_be_put_on_the_body_is_told_with_its_file(tmp_path):
    rows = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        "100\t100\t2\t1\tm",
    ]
    rows += ["Frame#\tTime\tnose", "\t\tX1\tY1\tZ1", "", "1\t0\t1\t2\t3", "2\t0.01\t1\t2\t3"]
    (tmp_path / "a.trc").write_text("\n".join(rows))
    with pytest.raises(MotionError, match=r"a\.trc: .*no leg with hip and knee"):
        read_motion(tmp_path / "a.trc")
    with pytest.raises(FormatError, match=r"b\.bvh"):
        read_motion(tmp_path / "b.bvh")


def test_a_file_is_told_by_frames_seconds_gaps_and_names(mocap, any_motion, tmp_path):
    motion = any_motion(2, frames=50)
    poses = motion.poses.copy()
    poses[:10] = np.nan
    motionenv.write(motionenv.Motion(poses, motion.skeleton, 25.0), tmp_path / "a.npz")
    assert describe(tmp_path / "a.npz") == "a.npz: 50 frames, 2.00 s at 25 fps, gaps 20.0%\nthe 25-DOF body"
    told = describe(mocap / "cmu_asfamc" / "02" / "02_01.amc", fps=120)
    assert told.startswith("02_01.amc: 343 frames, 2.86 s at 120 fps, gaps 0.0%\n")
    assert "lfemur" in told


def test_a_laboratorys_file_is_told_with_its_events_plates_and_angles(mocap):
    lines = describe(mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample04" / "sub_labels.c3d").split("\n")
    assert lines[2] == "marker set plug-in-gait: 14 of its 55 landmarks"
    assert lines[3] == "subject Matt, 8 events, 2 force plates, unit mm"
    assert lines[4].startswith("stored angles: LHipAngles, LKneeAngles, LAnkleAngles")
    assert "Force" not in lines[4]


def test_no_file_of_the_collection_is_told_in_words_of_another_library(mocap):
    """Refusals name the file and say what to pass, or that there is nothing in it."""
    told, refused = {}, {}
    for path in sorted(p for p in mocap.rglob("*") if p.suffix.lower() in (".c3d", ".trc")):
        try:
            told[path.name] = describe(path)
        except FormatError as error:
            refused[path.name] = str(error)
    assert len(told) > 60
    for name, text in refused.items():
        assert name in text
        assert re.search(r"pass unit=\"mm\" \(--unit mm\)|is empty|is truncated", text), text
    for text in (*told.values(), *refused.values()):
        assert not re.search(r"ezc3d|bad_alloc|Traceback|Error\b|np\.|array\(", text), text
