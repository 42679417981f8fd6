import struct
from concurrent.futures import ThreadPoolExecutor

import c3d as peer
import ezc3d
import numpy as np
import pytest

from motionenv.errors import FormatError
from motionenv.mocap.readers import asfamc, c3d, trc

POINTS = np.array([[[100.0, 200, 300], [110, 210, 310]], [[-100.0, 5, 1000], [-90, 6, 1001]]])  # point, frame, mm


def save(folder, labels=("A", "B"), points=POINTS, rate=100.0, parameters=(("UNITS", ["mm"]),), residuals=None):
    """A C3D file made by ezc3d."""
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
    labels = ["Ann:KNEE", "Bob:KNEE", "KneeAngle", "Ann:Force", "", "X "]
    parameters = (("UNITS", ["mm"]), ("ANGLES", ["KneeAngle"]), ("FORCES", ["Ann:Force"]))
    got = c3d.read(save(tmp_path, labels, np.tile(POINTS, (3, 1, 1)), parameters=parameters))
    assert got.names == ("KNEE", "KNEE_2", "unlabelled", "X")


def test_names_from_windows_are_latin(tmp_path):
    path = save(tmp_path, ["H__FTE", "B"])
    path.write_bytes(path.read_bytes().replace(b"H__FTE", b"H\xfcfte_"))
    assert c3d.read(path).names == ("Hüfte_", "B")


@pytest.mark.parametrize("units", [[], [""], ["furlong"]])
def test_an_unknown_unit_is_asked_for(tmp_path, units):
    path = save(tmp_path, parameters=(("UNITS", units),))
    with pytest.raises(FormatError, match=r"POINT:UNITS: .*pass unit="):
        c3d.read(path)
    np.testing.assert_allclose(c3d.read(path, unit="mm").positions[0, 0], [0.1, 0.2, 0.3], atol=1e-7)


def test_a_missing_frame_rate_is_asked_for(tmp_path):
    path = save(tmp_path, rate=123.25)
    path.write_bytes(path.read_bytes().replace(struct.pack("<f", 123.25), bytes(4)))  # ezc3d crashes on writing 0
    with pytest.raises(FormatError, match="pass fps="):
        c3d.read(path)
    assert c3d.read(path, fps=50).fps == 50


@pytest.mark.parametrize("name", ["pc_int.c3d", "pc_real.c3d", "DEC_INT.C3D", "Dec_real.c3d"])
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
    ways = [folder / "sample01" / f"Eb015{kind}.c3d" for kind in ("pi", "pr", "vi", "vr")]
    ways += [folder / "sample08" / f"TEST{letter}PI.c3d" for letter in "ABCD"]
    first, *others = [c3d.read(path).positions for path in ways]
    assert first.shape == (450, 26, 3)
    for other in others:
        np.testing.assert_allclose(other, first, atol=1e-6)


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


def test_sgi_files_get_an_error_that_says_what_to_do(mocap):
    path = mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "sgi_real.c3d"
    with pytest.raises(FormatError, match=r"block 2: is in SGI/MIPS byte order.*save it again"):
        c3d.read(path)


def broken(raw, at, new):
    return raw[:at] + new + raw[at + len(new) :]


BAD = {
    "empty": (lambda raw: b"", "is empty"),
    "text": (lambda raw: b"HIERARCHY\nROOT", "block 1: isn't a C3D file"),
    "header only": (lambda raw: raw[:512], "byte 512: is truncated: the parameters should start in block 2"),
    "half": (lambda raw: raw[: len(raw) // 2], "is truncated: its header gives"),
    "one byte short": (lambda raw: raw[:-1].ljust(len(raw) - 512, b"\0")[: len(raw) - 512], "is truncated"),
    "processor": (lambda raw: broken(raw, 515, b"\x07"), "block 2: the processor type must be"),
    "no points": (lambda raw: broken(raw, 2, b"\0\0"), "block 1: has no data"),
    "frames backwards": (lambda raw: broken(raw, 6, b"\xff\0"), "block 1: has no data"),
    "enormous": (lambda raw: broken(raw, 2, b"\xff\xff\xff\xff\0\0\xff\xff"), "is truncated: its header gives"),
    "parameters gone": (lambda raw: broken(raw, 516, bytes(1024)), "the data hold|the file is damaged"),
}


@pytest.mark.parametrize(("breaking", "problem"), BAD.values(), ids=BAD)
def test_broken_files_name_the_block(mocap, tmp_path, breaking, problem):
    raw = (mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "pc_real.c3d").read_bytes()
    path = tmp_path / "broken.c3d"
    path.write_bytes(breaking(raw))
    with pytest.raises(FormatError, match=problem) as caught:
        c3d.read(path)
    assert str(path) in str(caught.value)


def test_random_damage_gives_an_answer_or_an_error_and_never_a_crash(mocap, tmp_path, monkeypatch):
    monkeypatch.setattr(c3d, "_SECONDS", 4)  # on one of these files ezc3d runs forever
    raw = (mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "pc_real.c3d").read_bytes()
    rng = np.random.default_rng(20240607)
    paths = []
    for i in range(150):
        data = np.frombuffer(raw, dtype=np.uint8).copy()
        # most of the damage where the structure is: header and parameters
        where = rng.integers(0, 13 * 512 if i % 3 else len(data), size=rng.integers(1, 30))
        data[where] = rng.integers(0, 256, size=where.shape)
        paths.append(tmp_path / f"{i}.c3d")
        paths[-1].write_bytes(data.tobytes())

    def outcome(path):
        try:
            return c3d.read(path, fps=50, unit="mm", up="z").positions.shape
        except FormatError as error:
            return str(error)

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(outcome, paths))
    assert len(outcomes) == 150
    assert sum(isinstance(o, tuple) for o in outcomes) > 10
    for way in ("ezc3d crashed", "ezc3d reports", "didn't finish", "truncated"):
        assert any(way in o for o in outcomes if isinstance(o, str)), way
