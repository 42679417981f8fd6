import re
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import motionenv
from motionenv import mocap as files
from motionenv.body import from_height
from motionenv.errors import FormatError, MotionError
from motionenv.mocap import npz, read, retarget
from motionenv.mocap.reading import describe, read_motion
from motionenv.types import Markers, Motion

#: What files of the collection need besides their path, and why.
NEEDS = {
    r"\.amc$": {"fps": 120},  # not in the format
    r"^cmu_bvh_misc/(?!arm)|01_01\.bvh$": {"unit": "cmu"},  # not in the format
    r"^cmu_bvh_misc/arm\.bvh$|sinusoidal": {"unit": "m"},  # toys of a few units
    r"sample28/(dynamic|standing)\.C3D$|561xxa01|phasespace_sample": {"unit": "mm"},  # no POINT:UNITS
}

#: Files that can't be read, and what is wrong with them.
FAULTS = {r"Empty\.trc$": "is empty", r"Truncated\.trc$": "line 2: is truncated inside its header"}

#: Files of which nothing but gaps is to be had: all points are coded as missing.
ALL_GAPS = r"parameterOverflow\.c3d$"


def found(table, name, default):
    return next((value for pattern, value in table.items() if re.search(pattern, name)), default)


def test_every_file_of_the_collection_reads_right_or_says_what_is_wrong(mocap):
    every = [p for p in sorted(mocap.rglob("*")) if p.suffix.lower() in (".amc", ".bvh", ".c3d", ".trc")]
    bandai = [p for p in every if "bandai_namco" in p.parts]
    paths = [p for p in every if "bandai_namco" not in p.parts] + bandai[::16]
    assert len(paths) > 150

    def check(path):
        name = path.relative_to(mocap).as_posix()
        options = found(NEEDS, name, {})
        fault = found(FAULTS, name, None)
        if options:
            with pytest.raises(FormatError, match=r"pass (unit|fps|the metres)"):
                files.read(path)
        if fault:
            with pytest.raises(FormatError, match=re.escape(fault)):
                files.read(path, **options)
            return
        got = files.read(path, **options)
        assert isinstance(got, Markers)
        assert len(set(got.names)) == len(got.names) > 0
        assert 20 <= got.fps <= 500 or path.stem in ("arm", "rest")
        size = np.abs(got.positions[np.isfinite(got.positions)])
        if re.search(ALL_GAPS, name):
            assert np.isnan(got.positions).mean() > 0.5
        else:
            assert np.percentile(size, 99) < 20, name  # metres: a person on a stage, or a toy
            assert np.percentile(size, 99) > 0.1, name

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(check, paths))


def test_the_suffix_picks_the_reader_in_any_case(tmp_path):
    path = tmp_path / "a.NPZ"
    npz.write(Motion(np.zeros((3, 25)), from_height(), 100.0), path)
    assert isinstance(files.read(path), Motion)


@pytest.mark.parametrize(
    ("name", "person"),
    [
        ("07_01.amc", "07"),
        ("a/Пётр_01.bvh", "Пётр"),
        ("Иван_01.bvh", "Иван"),
        ("Zoe\u0308_2.c3d", "Zoë"),
        ("ann.trc", "ann"),
    ],
)
def test_a_persons_label_is_the_first_part_of_a_files_name(name, person):
    assert files.person_label(name) == person


def test_an_unknown_suffix_lists_what_can_be_read(tmp_path):
    with pytest.raises(
        FormatError, match=r"suffix '\.fbx'; supported are \.amc, \.bvh, \.c3d, \.trc, \.tsv, \.csv, \.npz"
    ):
        files.read(tmp_path / "a.fbx")


@pytest.mark.parametrize(
    ("name", "options"), [("a.npz", {"fps": 3}), ("a.bvh", {"asf": "b"}), ("a.amc", {"body_model": "z"})]
)
def test_options_that_mean_nothing_to_a_format_are_refused(tmp_path, name, options):
    with pytest.raises(FormatError, match=f"{next(iter(options))} can't be given for a"):
        files.read(tmp_path / name, **options)


def test_options_for_silent_files_are_ignored_by_formats_that_say_all(tmp_path):
    path = tmp_path / "a.npz"
    npz.write(Motion(np.zeros((3, 25)), from_height(), 100.0), path)
    assert files.read(path, fps=30, unit="mm", override=False).fps == 100.0


def test_options_for_silent_files_leave_amc_and_bvh_as_they_state(mocap):
    """ASF files state their unit, BVH files their rate; neither states the other."""
    amc = mocap / "cmu_asfamc" / "02" / "02_01.amc"
    kept = files.read(amc, fps=120, unit="m", override=False).positions
    np.testing.assert_array_equal(kept, files.read(amc, fps=120).positions)
    assert not np.allclose(kept, files.read(amc, fps=120, unit="m").positions)
    bvh = mocap / "cmu_bvh_misc" / "02_01.bvh"
    kept = files.read(bvh, fps=30, unit="cmu", override=False)
    assert kept.fps == files.read(bvh, unit="cmu").fps != 30
    assert files.read(bvh, fps=30, unit="cmu").fps == 30


SUFFIXES = ["amc", "bvh", "c3d", "trc", "tsv", "csv", "npz"]
JUNK = {
    "missing": (None, "can't be read: No such file"),
    "empty": (b"", "is empty"),
    "blank": (b" \r\n\t\n", "is empty"),
    "zeros": (bytes(5000), "is binary|isn't a C3D file|isn't an NPZ file"),
    "noise": (np.random.default_rng(1).bytes(5000), "is binary|isn't a C3D file|isn't an NPZ file"),
    "UTF-16": ("HIERARCHY\n".encode("utf-16"), "no MOTION|a C3D file|an NPZ|PathFileType|in 'a'|frame|no table"),
    "Latin-1": (b"HIERARCHY\nROOT H\xfcfte\n", "no MOTION|a C3D file|an NPZ|PathFileType|in 'a'|frame|no table"),
    "prose": (
        b"Once upon a time\nthere was a walk.\n",
        "no MOTION|a C3D file|an NPZ|PathFileType|in 'a'|frame|'Once'|no table",
    ),
}


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(("content", "problem"), JUNK.values(), ids=JUNK)
def test_junk_is_refused_by_every_reader(tmp_path, suffix, content, problem):
    path = tmp_path / f"a.{suffix}"
    if content is not None:
        path.write_bytes(content)
    (tmp_path / "a.asf").write_text(
        ":units\nlength 1\n:root\norder\nposition 0 0 0\norientation 0 0 0\n:bonedata\n:hierarchy\n"
    )
    options = {"fps": 120} if suffix == "amc" else {}
    with pytest.raises(FormatError, match=problem) as caught:
        files.read(path, **options)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_folder_is_no_file(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    path.mkdir()
    with pytest.raises(FormatError, match="can't be read: Is a directory"):
        files.read(path, **({"fps": 120} if suffix == "amc" else {}))


def test_long_captures_take_time_in_proportion(tmp_path):
    """Reading a minute of 31 joints at 120 fps takes about ten times as much CPU time as reading six seconds."""
    joints = "".join(f"JOINT j{i} {{\nOFFSET 0 5 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n" for i in range(30))
    head = "HIERARCHY\nROOT r {\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n" + joints + "}\n" * 31
    row = " ".join(["1.25"] * 93) + "\n"
    path = tmp_path / "long.bvh"

    def seconds(frames: int) -> float:
        path.write_text(f"{head}MOTION\nFrames: {frames}\nFrame Time: 0.00833333\n" + row * frames)
        began = time.process_time()
        assert files.read(path).positions.shape == (frames, 31, 3)
        return time.process_time() - began

    assert seconds(7200) < 30 * min(seconds(720) for _ in range(3))


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
