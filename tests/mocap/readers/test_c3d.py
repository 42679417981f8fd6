"""C3D files of many programs, compared with ezc3d and the package c3d, and files that ezc3d made."""

import struct
import warnings

import c3d as peer
import ezc3d
import numpy as np
import pytest

from motionenv.errors import FormatError
from motionenv.mocap.readers import asfamc, c3d, trc

POINTS = np.array([[[100.0, 200, 300], [110, 210, 310]], [[-100.0, 5, 1000], [-90, 6, 1001]]])  # point, frame, mm


def save(
    folder, labels=("A", "B"), points=POINTS, rate=100.0, parameters=(("UNITS", ["mm"]),), residuals=None, others=None,
    first=1, analogs=None,
):  # fmt: skip
    """A C3D file made by ezc3d, with `others`' parameters by group."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
    for name, value in parameters:
        file.add_parameter("POINT", name, value)
    data = np.ones((4, *points.shape[:2]))
    data[:3] = np.moveaxis(points, -1, 0)
    file["data"]["points"] = data
    if residuals is not None:
        file["data"]["meta_points"]["residuals"] = residuals
    for group, more in (others or {}).items():
        for name, value in more.items():
            file.add_parameter(group, name, value)
    if first != 1:
        file["header"]["points"]["first_frame"] = first - 1
    if analogs is not None:
        file["data"]["analogs"] = np.array(analogs).T[None]
    path = folder / "made.c3d"
    file.write(str(path))
    return path


def test_points_become_metres_frame_by_frame(tmp_path):
    got = c3d.read(save(tmp_path))
    assert got.names == ("A", "B")
    assert got.fps == 100
    assert got.parents is None
    np.testing.assert_allclose(got.positions, POINTS.transpose(1, 0, 2) / 1000, atol=1e-6)


def test_y_screen_or_the_caller_says_which_axis_is_up(tmp_path):
    path = save(tmp_path, parameters=(("UNITS", ["m"]), ("X_SCREEN", ["+X"]), ("Y_SCREEN", ["+Y"])))
    np.testing.assert_allclose(c3d.read(path).positions[0, 0], [300, 100, 200])
    np.testing.assert_allclose(c3d.read(path, up="z").positions[0, 0], [100, 200, 300])
    np.testing.assert_allclose(c3d.read(path, up="x").positions[0, 0], [200, 300, 100])
    path = save(tmp_path, parameters=(("UNITS", ["m"]), ("Y_SCREEN", ["-Z"])))
    with pytest.raises(FormatError, match="Y_SCREEN: .*pass up="):
        c3d.read(path)


def test_every_kind_of_gap_is_nan(tmp_path):
    points = np.tile(POINTS, (2, 1, 1))
    points[0, 1] = 0.0
    points[1, 0] = np.nan
    residuals = np.zeros((1, 4, 2))
    residuals[0, 2, 1] = -1
    got = c3d.read(save(tmp_path, "ABCD", points, residuals=residuals))
    gaps = np.isnan(got.positions)
    assert (gaps.all(-1) == gaps.any(-1)).all()
    np.testing.assert_array_equal(gaps.all(-1), [[False, True, False, False], [True, False, True, False]])


def test_subjects_are_cut_off_repeats_numbered_angles_left_out(tmp_path):
    labels = ["Ann:KNEE", "Ann:KNEE", "KneeAngle", "Ann:Force", "", "X "]
    parameters = (("UNITS", ["mm"]), ("ANGLES", ["KneeAngle"]), ("FORCES", ["Ann:Force"]))
    got = c3d.read(save(tmp_path, labels, np.tile(POINTS, (3, 1, 1)), parameters=parameters))
    assert got.names == ("KNEE", "KNEE_2", "unlabelled", "X")


@pytest.mark.parametrize("encoding", ["utf-8", "cp932"])
def test_japanese_names(tmp_path, encoding):
    name = "右膝".encode(encoding)
    path = save(tmp_path, ["_" * len(name), "B"])
    path.write_bytes(path.read_bytes().replace(b"_" * len(name), name))
    assert c3d.read(path).names == ("右膝", "B")


FIRST = 70_148  # 4612 + 65536


@pytest.mark.parametrize("header", [65535, FIRST & 65535])
@pytest.mark.parametrize(
    "fields",
    [
        {"ACTUAL_START_FIELD": [4612, 1], "ACTUAL_END_FIELD": [4661, 1]},
        {"ACTUAL_START_FIELD": [4612.0, 1.0]},
        {"ACTUAL_START_FIELD": [float(FIRST)]},
        {"ACTUAL_END_FIELD": [float(FIRST + 49)]},
        {"ACTUAL_END_FIELD": [4661, 1]},
    ],
    ids=lambda fields: str(fields),
)
def test_a_first_frame_above_65535(tmp_path, header, fields):
    """The header's number stands still, or begins again; events are 20 frames after the first."""
    times = np.array([[0.0], [(FIRST - 1 + 20) / 100]])
    event = {"USED": [1], "CONTEXTS": ["Left"], "LABELS": ["Foot Strike"], "TIMES": times}
    path = save(tmp_path, "A", np.ones((1, 50, 3)), others={"EVENT": event, "TRIAL": fields})
    path.write_bytes(broken(path.read_bytes(), 6, struct.pack("<2H", header, min(header + 49, 65535))))
    got = c3d.read(path)
    assert (len(got.positions), got.recording.first_frame) == (50, FIRST)
    assert got.recording.events[0].time == pytest.approx(0.2, abs=1e-4)
    assert not got.notes


def test_a_first_frame_that_the_header_has_stays(tmp_path):
    """A trial that was cut keeps the frames that were recorded in TRIAL."""
    fields = {"ACTUAL_START_FIELD": [4612, 1], "ACTUAL_END_FIELD": [4661, 1]}
    assert (
        c3d.read(save(tmp_path, "A", np.ones((1, 50, 3)), first=11, others={"TRIAL": fields})).recording.first_frame
        == 11
    )


@pytest.mark.parametrize("first", [99.0, 0.2])
def test_events_that_mostly_lie_outside_are_told_and_not_used(tmp_path, first):
    """As of times in another unit: the one within the trial is at another time, too."""
    times = np.array([[0.0, 1.0, 0.0], [first, 5.0, 9.0]])
    event = {"USED": [3], "CONTEXTS": ["Left"] * 3, "LABELS": ["Foot Strike"] * 3, "TIMES": times}
    got = c3d.read(save(tmp_path, "A", np.ones((1, 50, 3)), others={"EVENT": event}))
    many = 3 if first == 99.0 else 2
    assert got.notes == (f"{many} of 3 events of the file lie outside of its frames, whose first is 1: none is used",)
    assert got.recording.events == ()


def test_names_from_windows_are_latin(tmp_path):
    path = save(tmp_path, ["H__FTE", "B"])
    path.write_bytes(path.read_bytes().replace(b"H__FTE", b"H\xfcfte_"))
    assert c3d.read(path).names == ("Hüfte_", "B")


@pytest.mark.parametrize("units", [[], [""], ["furlong"]])
def test_an_unknown_unit_is_asked_for_and_proposed_by_the_size_of_the_body(tmp_path, units):
    """The points are 700 mm apart."""
    path = save(tmp_path, parameters=(("UNITS", units),))
    with pytest.raises(FormatError, match=r'POINT:UNITS: .*in millimetres .* 0.70 m, .*pass unit="mm" \(--unit mm\)'):
        c3d.read(path)
    np.testing.assert_allclose(c3d.read(path, unit="mm").positions[0, 0], [0.1, 0.2, 0.3], atol=1e-7)


@pytest.mark.parametrize("written", ["mm", "MM ", "mm.", "[mm]", "milimeters", "Millimetres", "millimeter"])
def test_units_are_read_however_they_are_spelt(tmp_path, written):
    got = c3d.read(save(tmp_path, parameters=(("UNITS", [written]),)))
    np.testing.assert_allclose(got.positions[0, 0], [0.1, 0.2, 0.3], atol=1e-7)
    assert got.recording.metres == 0.001


def test_options_for_silent_files_leave_what_a_file_states(tmp_path):
    path = save(tmp_path)
    assert c3d.read(path, unit="m", fps=50).fps == 50
    kept = c3d.read(path, unit="m", fps=50, override=False)
    assert kept.fps == 100
    np.testing.assert_allclose(kept.positions[0, 0], [0.1, 0.2, 0.3], atol=1e-7)
    silent = save(tmp_path, parameters=())
    np.testing.assert_allclose(c3d.read(silent, unit="cm", override=False).positions[0, 0], [1, 2, 3], atol=1e-6)


def test_a_missing_frame_rate_is_asked_for(tmp_path):
    path = save(tmp_path, rate=123.25)
    path.write_bytes(path.read_bytes().replace(struct.pack("<f", 123.25), bytes(4)))  # ezc3d crashes on writing 0
    with pytest.raises(FormatError, match="pass fps="):
        c3d.read(path)
    assert c3d.read(path, fps=50).fps == 50


@pytest.mark.parametrize(
    "name", ["pc_int.c3d", "pc_real.c3d", "DEC_INT.C3D", "Dec_real.c3d", "sgi_int.c3d", "sgi_real.c3d"]
)
def test_every_encoding_against_another_library(mocap, name):
    path = mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / name
    got = c3d.read(path)
    with open(path, "rb") as file:
        reader = peer.Reader(file)
        frames = np.array([points for _, points, _ in reader.read_frames()])
    expected = np.where(frames[..., 3:4] < 0, np.nan, frames[..., :3] / 1000)
    assert got.fps == reader.point_rate
    assert got.names == tuple(label.strip() for label in reader.point_labels[: frames.shape[1]])
    np.testing.assert_allclose(got.positions, expected, atol=1e-6)


def test_encodings_of_one_trial_agree(mocap):
    folder = mocap / "btkdata" / "C3DSamples" / "c3d.org"
    ways = [folder / "sample01" / f"Eb015{kind}.c3d" for kind in ("pi", "pr", "vi", "vr", "si", "sr")]
    ways += [folder / "sample08" / f"TEST{letter}PI.c3d" for letter in "ABCD"]
    first, *others = [c3d.read(path) for path in ways]
    assert first.positions.shape == (450, 26, 3)
    for other in others:
        np.testing.assert_allclose(other.positions, first.positions, atol=1e-6)
        assert other.recording.events == first.recording.events
        for plate, same in zip(first.recording.plates, other.recording.plates, strict=True):
            np.testing.assert_allclose(plate.force, same.force, atol=1e-3)


def test_the_floor_says_what_is_up_where_the_file_does_not(mocap):
    """These files are y up and say neither that nor their unit; the iliac spines are above the knees, and they
    above the ankles."""
    folder = mocap / "btkdata" / "C3DSamples"
    for name in ("c3d.org/sample28/dynamic.C3D", "others/561xxa01_anonym.C3D"):
        got = c3d.read(folder / name, unit="mm")
        asis, knee, ankle = (np.nanmean(got.positions[:, got.index(n), 2]) for n in ("r asis", "r knee 1", "r mall"))
        assert 0.75 < asis < 1.0
        assert 0.4 < knee < 0.5
        assert 0.05 < ankle < 0.2
        assert 300 < np.nanmax(got.recording.plates[0].force[:, 2]) < 800


def test_frames_that_the_header_lost_are_found(tmp_path):
    """Its 16 bits overflow; the file's length and POINT:FRAMES agree."""
    points = np.random.default_rng(3).uniform(100, 900, (2, 300, 3))
    path = save(tmp_path, points=points)
    for first, last in ((1, 0), (1, 0xFFFF), (0, 0)):
        path.write_bytes(broken(path.read_bytes(), 6, struct.pack("<2H", first, last)))
        np.testing.assert_allclose(c3d.read(path).positions, points.transpose(1, 0, 2) / 1000, atol=1e-6)


@pytest.mark.parametrize("told", [True, False], ids=["TRIAL", "length"])
def test_more_frames_than_16_bits_count(tmp_path, told):
    """TRIAL's fields have two words each, the lower first. Without them the length tells, but for its padding."""
    fields = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [70_000 - 65_536, 1]}
    points = np.tile(np.arange(70_000.0)[:, None] + 1, (1, 1, 3))
    path = save(tmp_path, "A", points, others={"TRIAL": fields} if told else None)
    assert struct.unpack("<H", path.read_bytes()[8:10]) == (65535,)
    got = c3d.read(path).positions
    assert len(got) == 70_000 if told else 70_000 <= len(got) < 70_000 + 512 / 16
    np.testing.assert_allclose(got[:70_000, 0, 0], (np.arange(70_000) + 1) / 1000, rtol=1e-6)
    assert np.isnan(got[70_000:]).all()


def test_no_frames_and_no_points_are_refused_by_name(tmp_path):
    raw = save(tmp_path).read_bytes()
    for key in (b"FRAMES", b"USED"):
        at = raw.index(key) + len(key) + 4
        raw = broken(raw, at, b"\0\0") if raw[at - 2] == 2 else raw
    path = tmp_path / "made.c3d"
    path.write_bytes(broken(raw, 6, struct.pack("<2H", 1, 0)))
    with pytest.raises(FormatError, match="block 1: has no frames"):
        c3d.read(path)
    path.write_bytes(broken(raw, 2, b"\0\0"))
    with pytest.raises(FormatError, match="block 1: has no points"):
        c3d.read(path)


def test_one_frame_is_a_static_trial(mocap):
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / "PiG" / "PiG_Calibration-FlatFoot-One.c3d")
    assert len(got.positions) == 1
    assert np.isfinite(got.positions[0, got.index("LASI")]).all()


def test_c3d_and_trc_of_one_trial_agree(mocap):
    """The laboratory is z up; its C3D says so, its TRC can't."""
    folder = mocap / "btkdata"
    one = c3d.read(folder / "C3DSamples" / "others" / "Res16bits.c3d")
    other = trc.read(folder / "TRCSamples" / "Res16bits.trc", up="z")
    assert one.fps == other.fps
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-6)


def test_cmu_is_z_up_and_the_markers_sit_about_the_joints(mocap):
    markers = c3d.read(mocap / "cmu_c3d" / "02_01.c3d")
    joints = asfamc.read(mocap / "cmu_asfamc" / "02" / "02_01.amc", fps=120)
    assert markers.fps == 120
    assert len(markers.positions) == len(joints.positions)
    pairs = {
        "LKNE": "lfemur",
        "RKNE": "rfemur",
        "LANK": "ltibia",
        "RANK": "rtibia",
        "LELB": "lhumerus",
        "RELB": "rhumerus",
    }
    for marker, joint in pairs.items():
        apart = markers.positions[:, markers.index(marker)] - joints.positions[:, joints.index(joint)]
        assert np.sqrt((apart**2).sum(-1).mean()) < 0.12, marker


def test_cmu_forearms_end_with_the_bone_called_wrist(mocap):
    """From elbow to wrist it is as far between markers as between the ends of "humerus" and "wrist", not "radius"."""
    markers = c3d.read(mocap / "cmu_c3d" / "02_01.c3d")
    joints = asfamc.read(mocap / "cmu_asfamc" / "02" / "02_01.amc", fps=120)
    m = {name: markers.positions[:, markers.index(name)] for name in ("LELB", "LWRA", "LWRB")}
    j = {name: joints.positions[:, joints.index(name)] for name in ("lhumerus", "lradius", "lwrist")}
    skin = np.linalg.norm((m["LWRA"] + m["LWRB"]) / 2 - m["LELB"], axis=-1).mean()
    assert abs(np.linalg.norm(j["lwrist"] - j["lhumerus"], axis=-1).mean() - skin) < 0.02
    assert abs(np.linalg.norm(j["lradius"] - j["lhumerus"], axis=-1).mean() - skin) > 0.06


def broken(raw, at, new):
    return raw[:at] + new + raw[at + len(new) :]


BAD = {
    "empty": (lambda raw: b"", "is empty"),
    "text": (lambda raw: b"HIERARCHY\nROOT", "block 1: isn't a C3D file"),
    "header only": (lambda raw: raw[:512], "byte 512: is truncated: the parameters should start in block 2"),
    "half": (lambda raw: raw[: len(raw) // 2], "is truncated: its header gives"),
    "one byte short": (lambda raw: raw[:-1].ljust(len(raw) - 512, b"\0")[: len(raw) - 512], "is truncated"),
    "processor": (lambda raw: broken(raw, 515, b"\x07"), "block 2: the processor type must be"),
    "no data": (lambda raw: broken(raw, 16, b"\xff\xff"), "is truncated: its header gives"),
    "labels lost": (lambda raw: broken(raw, 516, b"\x7f" * 1024), "POINT:LABELS: the parameter section is damaged"),
    "parameters gone": (lambda raw: broken(raw, 516, bytes(1024)), "POINT:UNITS: the unit of length is missing"),
}


@pytest.mark.parametrize(("breaking", "problem"), BAD.values(), ids=BAD)
def test_broken_files_name_the_block(mocap, tmp_path, breaking, problem):
    raw = (mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "pc_real.c3d").read_bytes()
    path = tmp_path / "broken.c3d"
    path.write_bytes(breaking(raw))
    with pytest.raises(FormatError, match=problem) as caught:
        c3d.read(path)
    assert str(path) in str(caught.value)


def test_random_damage_gives_an_answer_or_an_error_of_ours(mocap, tmp_path):
    raw = (mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "pc_real.c3d").read_bytes()
    rng = np.random.default_rng(20240607)
    shapes, errors = [], []
    path = tmp_path / "damaged.c3d"
    for i in range(300):
        data = np.frombuffer(raw, dtype=np.uint8).copy()
        # most of the damage where the structure is: header and parameters
        where = rng.integers(0, 13 * 512 if i % 3 else len(data), size=rng.integers(1, 30))
        data[where] = rng.integers(0, 256, size=where.shape)
        path.write_bytes(data.tobytes())
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                shapes.append(c3d.read(path, fps=50, unit="mm", up="z").positions.shape)
            except FormatError as error:
                errors.append(str(error))
    assert len(shapes) > 150  # with ezc3d about 60 of them
    assert any("truncated" in error for error in errors)


def ezc3d_reads_right(path) -> bool:
    """It doesn't know SGI, and takes analog values for points where ANALOG:RATE is missing."""
    name = path.as_posix()
    return not any(part in name for part in ("/sgi_", "Eb015s", "MACsample", "sample28", "561xxa01", "phasespace"))


def test_points_and_force_plates_of_every_file_against_ezc3d(mocap):
    """Where FORCE_PLATFORM:ZERO has frames of no load, ezc3d doesn't subtract them, and may have forces point down."""
    compared = 0
    for path in sorted(p for p in mocap.rglob("*") if p.suffix.lower() == ".c3d"):
        if not ezc3d_reads_right(path):
            continue
        got, other = c3d.read(path, up="z"), ezc3d.c3d(str(path), extract_forceplat_data=True)
        points = other["data"]["points"][:3].transpose(2, 1, 0)
        lost = (other["data"]["meta_points"]["residuals"][0].T < 0) | (points == 0).all(-1)
        points = np.where(lost[..., None], np.nan, points) * got.recording.metres
        labels = [label.rpartition(":")[2].strip() for label in other["parameters"]["POINT"]["LABELS"]["value"]]
        for i, name in enumerate(labels):
            if labels.count(name) == 1 and name in got.names:
                np.testing.assert_allclose(
                    got.positions[:, got.index(name)], points[:, i], atol=1e-9, err_msg=path.name
                )
        zero = other["parameters"].get("FORCE_PLATFORM", {}).get("ZERO", {"value": [1, 0]})["value"]
        if zero[0] >= 1 and zero[1] >= zero[0]:
            continue
        for plate, same in zip(got.recording.plates, other["data"]["platform"], strict=True):
            force, centre = same["force"].T, same["center_of_pressure"].T * got.recording.metres
            flip = -1 if (plate.force[:, 2] * force[:, 2]).sum() < 0 else 1
            baseline = np.median(flip * force - plate.force, axis=0)  # which ezc3d leaves in
            np.testing.assert_allclose(plate.force + baseline, flip * force, atol=1e-6, err_msg=path.name)
            seen = np.isfinite(plate.centre[:, 0]) & (np.abs(baseline).max() < 1e-6)
            np.testing.assert_allclose(plate.centre[seen], centre[seen], atol=1e-3, err_msg=path.name)
            np.testing.assert_array_equal(np.isfinite(plate.centre[:, 0]), np.abs(plate.force[:, 2]) >= 10)
            compared += 1
    assert compared > 20


#: Events in the order of the inventory of the collection.
EVENTS = {
    "PiG/PiG_Motion-FlatFoot-Full": 12, "PiG/PiG_Motion-FlatFoot-Hole": 10, "PiG/PiG_Motion-FlatFoot-One": 8,
    "PiG/PiG_Motion3_FF": 12, "PiG/PiG_Motion3_FF_N18": 12, "PiG/PiG_Motion3_noFF": 12,
    "c3d.org/sample04/sub_labels": 8, "c3d.org/sample09/PlugInC3D": 8, "others/FunctionalWalk": 11,
}  # fmt: skip


@pytest.mark.parametrize(("name", "count"), EVENTS.items())
def test_contacts_are_where_the_force_plates_say(mocap, name, count):
    """Each time that a plate is loaded from unloaded for long is within 0.12 s of an initial contact in the file."""
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / f"{name}.c3d")
    events = got.recording.events
    assert len(events) == count
    times = [event.time for event in events]
    assert times == sorted(times)
    assert times[0] >= 0
    assert times[-1] <= (len(got.positions) - 1) / got.fps
    contacts = np.array([event.time for event in events if event.kind == "initial_contact"])
    for plate in got.recording.plates:
        loaded = plate.force[:, 2] > 50
        begins = np.flatnonzero(loaded[1:] & ~loaded[:-1]) / plate.fps
        held = [b for b in begins if loaded[int(b * plate.fps) + 1 :][: int(0.3 * plate.fps)].all()]
        for begin in held:
            assert np.abs(contacts - begin).min() < 0.12, (name, begin)


def test_events_of_the_header_where_the_parameters_have_none(mocap):
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "sgi_real.c3d").recording
    told = [(round(event.time, 2), event.kind, event.side) for event in got.events]
    assert told == [
        (0.38, "initial_contact", "right"), (0.84, "initial_contact", "left"), (0.92, "toe_off", "right"),
        (1.4, "toe_off", "left"),
    ]  # fmt: skip


def test_the_subjects_numbers_and_outputs(mocap):
    folder = mocap / "btkdata" / "C3DSamples"
    got = c3d.read(folder / "PiG" / "PiG_Motion-FlatFoot-Full.c3d").recording
    assert (got.subject, got.first_frame, got.metres) == ("BELT_C", 148, 0.001)
    assert got.parameters["PROCESSING:LLEGLENGTH"] == 800
    assert got.parameters["PROCESSING:BODYMASS"] == 47.5
    assert not any(key.startswith(("POINT:", "ANALOG:")) for key in got.parameters)
    knee = got.outputs["LKneeAngles"]
    assert knee.shape == (315, 3)
    assert 40 < np.nanmax(knee[:, 0]) < 80  # degrees
    named = c3d.read(folder / "c3d.org" / "sample04" / "sub_labels.c3d")
    assert named.recording.subject == "Matt"
    assert {"LHipAngles", "RKneeMoment"} <= set(named.recording.outputs)
    assert not set(named.recording.outputs) & set(named.names)


@pytest.mark.parametrize(
    ("context", "label", "told"),
    [
        ("Left", "Foot Strike", ("initial_contact", "left")),
        ("RIGHT", "foot off", ("toe_off", "right")),
        ("", "RHS", ("initial_contact", "right")),
        ("General", "LTO", ("toe_off", "left")),
        ("Left", "Initial Contact", ("initial_contact", "left")),
        ("", "Left Heel Strike", ("initial_contact", "left")),
        ("", "Toe Off (right)", ("toe_off", "right")),
        ("Right", "HS", ("initial_contact", "right")),
        ("General", "Foot Strike", None),
        ("Left", "Event", None),
        ("", "STRT", None),
        ("", "RMS", None),
    ],
)
def test_events_by_many_names(tmp_path, context, label, told):
    """At frame 31 of a trial that begins with frame 11, and one outside of it, which is dropped."""
    times = np.array([[0.0, 1.0], [0.3, 0.0]])
    event = {"USED": [2], "CONTEXTS": [context, context], "LABELS": [label, label], "TIMES": times}
    got = c3d.read(save(tmp_path, "A", np.ones((1, 50, 3)), others={"EVENT": event}, first=11)).recording
    assert got.first_frame == 11
    assert [(event.kind, event.side) for event in got.events] == ([told] if told else [])
    assert all(event.time == pytest.approx(0.2) for event in got.events)


def test_a_foot_is_where_the_plate_feels_it(mocap):
    """In mid-stance the centre of pressure is below the foot that is on the plate, and the plate carries the weight."""
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / "PiG" / "PiG_Motion3_FF.c3d")
    heels = got.positions[:, [got.index("LHEE"), got.index("RHEE")]]
    for plate in got.recording.plates:
        loaded = np.flatnonzero(plate.force[:, 2] > 300)
        middle = loaded[len(loaded) // 2]
        heel = heels[round(middle / plate.fps * got.fps)]
        assert np.linalg.norm(heel[:, :2] - plate.centre[middle, :2], axis=-1).min() < 0.2
        assert abs(plate.centre[middle, 2]) < 0.01
        assert plate.force[middle, 2] > 400


def save_plate(folder, kind, rows, units, corners, origin, points=None, **more):
    """A C3D file with some points and one force plate."""
    channels = len(rows[0])
    analog = {"RATE": [100.0], "LABELS": list("abcdefgh")[:channels], "UNITS": units}
    plate = {
        "USED": [1], "TYPE": [kind], "CHANNEL": np.arange(1.0, channels + 1)[:, None], "CORNERS": corners.T[..., None],
        "ORIGIN": np.array(origin)[:, None], "ZERO": [1, 0], **more,
    }  # fmt: skip
    others = {"ANALOG": analog, "FORCE_PLATFORM": plate}
    points = np.ones((1, len(rows), 3)) if points is None else points
    return save(folder, "ABC"[: len(points)], points, others=others, analogs=rows)


@pytest.mark.parametrize("sign", [1, -1], ids=["of the ground", "on the plate"])
@pytest.mark.parametrize("kind", [1, 2])
def test_a_force_at_a_known_place_on_a_plate_in_the_floor(tmp_path, kind, sign):
    """A plate of 0.6 m x 0.4 m, whose transducer is 40 mm below; z of its frame is down."""
    force = np.array([15.0, -20.0, 700.0])  # world, on the foot
    at = np.array([[0.30, 0.15, 0.0], [0.40, 0.25, 0.0], [0.45, 0.30, 0.0]])  # world
    middle, axes = np.array([0.4, 0.3, 0.0]), np.diag([1.0, -1.0, -1.0])
    stored = sign * axes @ force
    places = (at - middle) @ axes  # the plate's frame
    arms = np.add(places, [0, 0, -0.04])  # from the transducer
    third = np.cross(arms, stored) * 1000 if kind == 2 else places * 1000
    rows = [[*stored, *values] for values in third]
    corners = np.array([[700.0, 100, 0], [100, 100, 0], [100, 500, 0], [700, 500, 0]])  # +x+y, -x+y, -x-y, +x-y
    units = ["N"] * 3 + (["Nmm"] * 3 if kind == 2 else ["mm", "mm", "Nmm"])
    (plate,) = c3d.read(save_plate(tmp_path, kind, rows, units, corners, [0.0, 0.0, -40.0])).recording.plates
    np.testing.assert_allclose(plate.force, np.tile(force, (3, 1)), atol=1e-3)
    np.testing.assert_allclose(plate.centre, at, atol=1e-6)
    np.testing.assert_allclose(plate.corners, corners / 1000)
    assert plate.fps == 100


#: A plate of 0.6 m x 0.4 m in the floor, z of its frame down, and the transducer 40 mm below its surface.
PLATE = np.array([[700.0, 100, 0], [100, 100, 0], [100, 500, 0], [700, 500, 0]])
DEPTH, SENSORS = 0.04, (0.25, 0.15)
MIXING = np.eye(6) + 0.1 * np.sin(np.arange(36.0)).reshape(6, 6)


def stored_stance(kind: int, sign: int):
    """World force and centre of pressure of a stance between two seconds and half a second of nothing; the channels."""
    loaded = np.zeros(310, dtype=bool)
    loaded[200:260] = True
    share = np.clip((np.arange(310) - 200) / 60, 0, 1)
    force = np.stack([-90 * np.cos(np.pi * share), 25 + 0 * share, 780 - 150 * np.sin(np.pi * share) ** 2], -1)
    force *= loaded[:, None]
    at = np.stack([0.25 + 0.2 * share, 0.22 + 0.03 * share, 0 * share], -1)
    x, y, z = sign * force.T * [[1], [-1], [-1]]  # the plate's frame
    px, py = at[:, 0] - 0.4, -(at[:, 1] - 0.3)
    if kind == 1:
        return force, at, np.stack([x, y, z, 1000 * px * loaded, 1000 * py * loaded, 0 * x], -1)
    moment = np.cross(np.stack([px, py, 0 * px - DEPTH], -1), np.stack([x, y, z], -1))
    if kind == 3:
        a, b = SENSORS
        with np.errstate(all="ignore"):
            right, front = np.nan_to_num(-moment[:, 1] / z / a), np.nan_to_num(moment[:, 0] / z / b)
        corners = [z / 4 * (1 + i * right) * (1 + j * front) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        return force, at, np.stack([x / 2, x / 2, y / 2, y / 2, *corners], -1)
    channels = np.concatenate([np.stack([x, y, z], -1), 1000 * moment], -1)
    return force, at, channels if kind == 2 else channels @ np.linalg.inv(MIXING).T


@pytest.mark.parametrize("order", ["listed", "turned", "turned half", "from the other side", "across"])
@pytest.mark.parametrize("sign", [1, -1], ids=["of the ground", "on the plate"])
@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_a_plate_that_drifts_with_corners_in_any_order(tmp_path, kind, sign, order):
    """Drift lasts four times as long as the step, and may point either way; markers on the foot tell the corners."""
    force, at, rows = stored_stance(kind, sign)
    channels = [0, 1, 2] if kind == 1 else slice(None)
    noise = 0.3 * np.random.default_rng(1).standard_normal(rows.shape)
    rows[:, channels] += (13.0 + noise)[:, channels]
    units = {1: ["N"] * 3 + ["mm", "mm", "Nmm"], 3: ["N"] * 8}.get(kind, ["N"] * 3 + ["Nmm"] * 3)
    origin = [*(1000 * np.array(SENSORS) if kind == 3 else (0, 0)), -1000 * DEPTH]
    more = {"CAL_MATRIX": MIXING[..., None]} if kind == 4 else {}
    foot = np.stack([1000 * at[[230] * 310] + [x, 10, 50] for x in (-120, 30, 90)])
    orders = {
        "listed": [0, 1, 2, 3], "turned": [1, 2, 3, 0], "turned half": [2, 3, 0, 1],
        "from the other side": [3, 2, 1, 0], "across": [0, 2, 1, 3],
    }  # fmt: skip
    corners = PLATE[orders[order]]
    path = save_plate(tmp_path, kind, rows, units, corners, origin, foot, **more)
    (plate,) = c3d.read(path).recording.plates
    np.testing.assert_allclose(plate.force, force, atol=3)
    np.testing.assert_allclose(plate.centre[205:255, :2], at[205:255, :2], atol=4e-3)
    assert np.isnan(plate.centre[:199]).all()


@pytest.mark.parametrize("level", [700.0, -700.0])
def test_the_weight_of_who_stands_throughout_is_no_drift(tmp_path, level):
    rows = np.zeros((300, 6))
    rows[:, 2] = level + 8 * np.sin(np.arange(300) / 20)
    (plate,) = c3d.read(save_plate(tmp_path, 2, rows, ["N"] * 6, PLATE, [0.0, 0, -40])).recording.plates
    np.testing.assert_allclose(plate.force[:, 2], np.abs(rows[:, 2]), atol=1e-3)


def test_who_stands_for_long_and_steps_off(tmp_path):
    rows = np.zeros((300, 6))
    rows[:210, 2] = -600
    (plate,) = c3d.read(save_plate(tmp_path, 2, rows, ["N"] * 6, PLATE, [0.0, 0, -40])).recording.plates
    np.testing.assert_allclose(plate.force[:, 2], -rows[:, 2], atol=1e-3)
