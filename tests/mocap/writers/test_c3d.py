"""C3D files read by ezc3d itself, by the package c3d, and by our reader."""

import itertools
import warnings

import c3d as c3d_package
import ezc3d
import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.mocap import write, write_markers
from motionenv.mocap.readers import c3d
from motionenv.types import MARKERS, POSE, Event, Markers, Motion, Recording

#: x, y and z of Plug-in Gait's points of angles (Vicon's reference guide, "Plug-in Gait kinematic variables").
ANGLES = {
    "HipAngles": ["hip_flexion", "hip_adduction", "hip_rotation"],
    "KneeAngles": ["knee_flexion", "knee_adduction", "knee_rotation"],
    "AnkleAngles": ["ankle_dorsiflexion", "ankle_adduction", "ankle_rotation"],
    "PelvisAngles": ["pelvis_tilt", "pelvis_obliquity", "pelvis_rotation"],
    "FootProgressAngles": [None, None, "foot_progression"],
}
EVENTS = (
    Event(1.03, "toe_off", "right"),
    Event(0.25, "initial_contact", "left"),
    Event(62.5, "initial_contact", "right"),
)


class Angles:
    """All clinical angles [degrees], each unlike the others."""

    def __init__(self, frames: int):
        parts = [part for three in ANGLES.values() for part in three if part]
        self.names = tuple(f"{side}_{part}" for side in ("left", "right") for part in parts)
        self.values = np.random.default_rng(5).normal(0, 30, (frames, len(self.names)))


def with_gap(motion):
    """The left knee's angle unknown in frames 3 to 7: nobody knows where the ankle is. Nothing at all in frame 9."""
    poses = motion.poses.copy()
    poses[3:8, POSE.index("left_knee_flexion")] = np.nan
    poses[9] = np.nan
    return Motion(poses, motion.skeleton, motion.fps)


def test_ezc3d_reads_the_markers(walk, tmp_path):
    motion = with_gap(walk)
    write(motion, tmp_path / "a.c3d")
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
        write(motion, tmp_path / "a.c3d")
        found = c3d.read(tmp_path / "a.c3d")
        assert found.names == MARKERS
        assert found.fps == pytest.approx(motion.fps, rel=1e-6)
        np.testing.assert_allclose(found.positions, markers(motion.poses, motion.skeleton), atol=1e-6)


@pytest.mark.parametrize(("frames", "first"), [(65535, 1), (65536, 1), (140_000, 500), (65540, 65535)])
def test_more_frames_than_16_bits_count(frames, first, tmp_path):
    positions = np.random.default_rng(2).normal(0, 1, (frames, 1, 3))
    positions[4:9] = np.nan
    path = tmp_path / "a.c3d"
    write_markers(Markers(("A",), positions, 100.0, recording=Recording(first_frame=first)), path)
    np.testing.assert_allclose(ezc3d.c3d(str(path))["data"]["points"][:3, 0].T, positions[:, 0], rtol=1e-6)
    found = c3d.read(path)
    np.testing.assert_allclose(found.positions, positions, rtol=1e-6)
    assert found.recording.first_frame == first
    with open(path, "rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns that there is no analogue data
        reader = c3d_package.Reader(file)
        assert (reader.first_frame, reader.last_frame) == (first, first + frames - 1)
        assert sum(1 for _ in reader.read_frames()) == frames


@pytest.mark.parametrize("first", [65_535, 65_536, 70_148, 5_000_000])
def test_a_first_frame_above_16_bits_is_kept_with_its_events(first, tmp_path):
    positions = np.random.default_rng(2).normal(0, 1, (300, 1, 3))
    recording = Recording(first_frame=first, events=(Event(0.5, "initial_contact", "left"),))
    path = tmp_path / "a.c3d"
    write_markers(Markers(("A",), positions, 100.0, recording=recording), path)
    field = ezc3d.c3d(str(path))["parameters"]["TRIAL"]["ACTUAL_START_FIELD"]["value"]
    assert [int(word) & 65535 for word in field] == [first & 65535, first >> 16]
    found = c3d.read(path)
    np.testing.assert_allclose(found.positions, positions, rtol=1e-6)
    assert found.recording.first_frame == first
    assert found.recording.events[0].time == pytest.approx(0.5, abs=0.005)


def parameters(file, group: str) -> dict:
    return {name: p["value"] for name, p in file["parameters"][group].items() if name != "__METADATA__"}


def check_angles(file, angles):
    point = parameters(file, "POINT")
    assert set(point["ANGLES"]) == {f"{s}{name}" for s in "LR" for name in ANGLES}
    assert point["ANGLE_UNITS"] == ["deg"]
    for (letter, side), (name, three) in itertools.product((("L", "left"), ("R", "right")), ANGLES.items()):
        found = file["data"]["points"][:3, point["LABELS"].index(letter + name)].T
        columns = [angles.values[:, angles.names.index(f"{side}_{p}")] if p else 0 * found[:, 0] for p in three]
        truth = np.stack(columns, axis=1)
        truth[np.isnan(truth).any(1)] = np.nan
        np.testing.assert_allclose(found, truth, atol=1e-4)


def test_events_and_clinical_angles_of_a_walk(walk, tmp_path):
    angles = Angles(len(walk.poses))
    angles.values[20:30, angles.names.index("left_knee_rotation")] = np.nan
    write(walk, tmp_path / "a.c3d", EVENTS, angles)
    file = ezc3d.c3d(str(tmp_path / "a.c3d"))
    check_angles(file, angles)
    event = parameters(file, "EVENT")
    assert (event["USED"].tolist(), event["ICON_IDS"].tolist(), event["GENERIC_FLAGS"].tolist()) == (
        [3],
        [1, 2, 1],
        [0] * 3,
    )
    assert event["CONTEXTS"] == ["Left", "Right", "Right"]
    assert event["LABELS"] == ["Foot Strike", "Foot Off", "Foot Strike"]
    np.testing.assert_allclose(event["TIMES"], [[0, 0, 1], [0.25, 1.03, 2.5]], atol=1e-5)
    found = c3d.read(tmp_path / "a.c3d")
    assert found.names == MARKERS  # angles aren't positions
    np.testing.assert_allclose(found.positions, markers(walk.poses, walk.skeleton), atol=1e-6)


def capture(frames=50) -> Markers:
    positions = np.random.default_rng(2).normal(0, 1, (frames, 3, 3))
    positions[4:9, 1] = np.nan
    measured = {"PROCESSING:LLEGLENGTH": 0.9, "PROCESSING:BODYMASS": 71.0, "POINT:RATE": 5.0}
    recording = Recording("Максим", 148, (Event(0.1, "toe_off", "left"),), (), measured, 1.0)
    return Markers(("LASI", "RASI", "*12"), positions, 100.0, recording=recording)


def test_a_laboratorys_own_points_come_back_with_events_and_angles(tmp_path):
    """In the file's unit, with its first frame, from which the times of events count."""
    held, angles = capture(), Angles(50)
    write_markers(held, tmp_path / "a.c3d", EVENTS, angles)
    file = ezc3d.c3d(str(tmp_path / "a.c3d"))
    check_angles(file, angles)
    assert file["header"]["points"]["first_frame"] == 147  # ezc3d counts from 0
    np.testing.assert_allclose(parameters(file, "EVENT")["TIMES"], [[0, 0, 1], [1.72, 2.5, 3.97]], atol=1e-5)
    assert parameters(file, "EVENT")["SUBJECTS"] == ["Максим"] * 3
    assert parameters(file, "SUBJECTS")["NAMES"] == ["Максим"]
    assert {k: v[0] for k, v in parameters(file, "PROCESSING").items()} == pytest.approx(
        {"LLEGLENGTH": 0.9, "BODYMASS": 71}
    )
    assert parameters(file, "POINT")["UNITS"] == ["m"]
    found = c3d.read(tmp_path / "a.c3d")
    assert found.names == held.names
    np.testing.assert_allclose(found.positions, held.positions, atol=1e-6)


def test_the_package_c3d_reads_points_events_and_angles(tmp_path):
    held, angles = capture(), Angles(50)
    write_markers(held, tmp_path / "a.c3d", EVENTS, angles)
    with open(tmp_path / "a.c3d", "rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns that there is no analogue data
        reader = c3d_package.Reader(file)
        points = np.stack([points for _, points, _ in reader.read_frames()])
        labels = [label.strip() for label in reader.point_labels]
        event = reader.get("EVENT")
        assert [context.strip() for context in event.get("CONTEXTS").string_array] == ["Left", "Right", "Right"]
        np.testing.assert_allclose(event.get("TIMES").float_array, [[0, 1.72], [0, 2.5], [1, 3.97]], atol=1e-5)
        assert event.get("USED").int16_value == 3
        assert (reader.first_frame, reader.last_frame) == (148, 197)
    known = np.isfinite(held.positions[:, 1]).all(1)
    np.testing.assert_array_equal(points[:, 1, 3] >= 0, known)
    np.testing.assert_allclose(points[known, 1, :3], held.positions[known, 1], atol=1e-6)
    knee = [angles.names.index(f"right_{name}") for name in ANGLES["KneeAngles"]]
    np.testing.assert_allclose(points[:, labels.index("RKneeAngles"), :3], angles.values[:, knee], atol=1e-4)


def test_a_capture_keeps_its_own_events(tmp_path):
    write_markers(capture(), tmp_path / "A.C3D")
    event = parameters(ezc3d.c3d(str(tmp_path / "A.C3D")), "EVENT")
    np.testing.assert_allclose(event["TIMES"][:, 0], [0, 1.57], atol=1e-5)


@pytest.mark.parametrize("repeated", [1, 60])
def test_any_number_of_points_and_long_names(repeated, tmp_path):
    """A parameter has at most 255 texts of 255 bytes, and 32,767 bytes: further ones are in LABELS2, LABELS3, ..."""
    names = tuple(f"P{i}" * repeated for i in range(600))
    many = Markers(names, np.random.default_rng(1).normal(size=(3, 600, 3)), 50.0)
    write_markers(many, tmp_path / "b.c3d")
    found = c3d.read(tmp_path / "b.c3d")
    assert found.names == names
    np.testing.assert_allclose(found.positions, many.positions, atol=1e-6)
    file = ezc3d.c3d(str(tmp_path / "b.c3d"))
    held = [parameters(file, "POINT").get(f"LABELS{i}", []) for i in ("", *range(2, 10))]
    assert tuple(itertools.chain(*held)) == names
    np.testing.assert_allclose(file["data"]["points"][:3].T, 1000 * many.positions, atol=1e-3)


def refused(problem: str, path, *, held=None, events=(), angles=None):
    with pytest.raises(MotionError, match=problem):
        write_markers(held or capture(), path, events, angles)
    assert not path.exists()


def test_what_does_not_fit_is_named(tmp_path):
    path, angles = tmp_path / "a.c3d", Angles(50)
    refused("at most 255 events, got 256", path, events=[EVENTS[0]] * 256)
    for letters in (256, 40_000):
        long = Markers(("x" * letters,), np.zeros((50, 1, 3)), 100.0)
        refused(f"texts of at most 255 bytes, but one of POINT:LABELS has {letters}", path, held=long)
    crowd = Markers([str(i) for i in range(65536)], np.zeros((1, 65536, 3)), 100.0)
    refused("at most 65535 points, got 65536", path, held=crowd)
    refused("events must have finite times, got Event.time=nan", path, events=[Event(np.nan, "toe_off", "left")])
    refused(r"angles.values must have shape \(50, 26\).*got \(49, 26\)", path, angles=Angles(49))
    taken = Markers(("RHipAngles",), np.zeros((50, 1, 3)), 100.0)
    refused("a point with the name of an angle, RHipAngles", path, held=taken, angles=angles)
    angles.names = tuple(f"my_{name}" for name in angles.names)
    refused(
        "angles has no known name: expected left_ or right_ before .*hip_flexion.*; got my_left", path, angles=angles
    )


def test_only_known_joints_become_points(walk, tmp_path):
    angles = Angles(len(walk.poses))
    kept = [i for i, name in enumerate(angles.names) if "hip" in name and "right" in name]
    angles.names, angles.values = tuple(angles.names[i] for i in kept), angles.values[:, kept]
    write(walk, tmp_path / "a.c3d", angles=angles)
    assert parameters(ezc3d.c3d(str(tmp_path / "a.c3d")), "POINT")["ANGLES"] == ["RHipAngles"]
