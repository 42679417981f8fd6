import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.readers import bvh

SMALL = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Leg
  {
    OFFSET 10 -10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -85 10
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 95 0 0 0 0 0 0 0
0 95 10 0 90 0 0 0 0
"""


def save(folder, text, name="a.bvh"):
    path = folder / name
    path.write_text(text, newline="")
    return path


def test_small_file_by_hand(tmp_path):
    got = bvh.read(save(tmp_path, SMALL))
    assert got.names == ("Hips", "Left Leg", "Left Leg_end")
    assert got.parents == (-1, 0, 1)
    assert got.fps == 30.0
    # y up (x left, z forward) becomes z up (x forward, y left), centimetres metres
    np.testing.assert_allclose(got.positions[0], [[0, 0, 0.95], [0, 0.1, 0.85], [0.1, 0.1, 0.0]], atol=1e-12)
    # a quarter turn about x, the axis to the left, takes what hung down to the back
    np.testing.assert_allclose(got.positions[1], [[0.1, 0, 0.95], [0, 0.1, 0.95], [-0.85, 0.1, 0.85]], atol=1e-12)
    np.testing.assert_allclose(got.rotations[0], np.tile(np.eye(3), (3, 1, 1)), atol=1e-15)
    np.testing.assert_allclose(got.rotations[1, 0] @ [0, 0, -1], [-1, 0, 0], atol=1e-12)


CHANNELS = ["xposition", "yposition", "zposition", "xrotation", "yrotation", "zrotation"]


@st.composite
def trees(draw):
    """Joints depth first: (name, parent, offset, channels), with 2 frames of channel values."""
    n = draw(st.integers(1, 7))
    parents = [-1]
    for i in range(1, n):
        chain = [i - 1]
        while parents[chain[-1]] >= 0:
            chain.append(parents[chain[-1]])
        parents.append(draw(st.sampled_from(chain)))
    number = st.floats(-300, 300, allow_nan=False).map(lambda v: round(v, 4))
    joints = []
    for i, parent in enumerate(parents):
        channels = draw(st.lists(st.sampled_from(CHANNELS), unique=True, min_size=parent < 0, max_size=6))
        joints.append((f"joint {i}", parent, draw(st.lists(number, min_size=3, max_size=3)), channels))
    width = sum(len(j[3]) for j in joints)
    row = st.lists(number, min_size=width, max_size=width)
    return joints, draw(st.lists(row, min_size=2, max_size=2))


def written(joints, rows):
    lines, depth = ["HIERARCHY"], []
    for i, (name, parent, offset, channels) in enumerate(joints):
        while depth and depth[-1] != parent:
            lines.append("}")
            depth.pop()
        depth.append(i)
        lines += [f"{'ROOT' if parent < 0 else 'JOINT'} {name} {{", "OFFSET " + " ".join(map(str, offset))]
        lines.append(" ".join(["CHANNELS", str(len(channels)), *(c[0].upper() + c[1:] for c in channels)]))
    lines += ["}" for _ in depth]
    lines += ["MOTION", f"Frames: {len(rows)}", "Frame Time: 0.008333"]
    return "\r\n".join([*lines, *(" ".join(map(str, row)) for row in rows)]) + "\r\n"


def brute_force(joints, row):
    """World rotations and positions one joint at a time, with scipy's rotations, in the file's y-up frame."""
    turns, places, at = [], [], 0
    for _, parent, offset, channels in joints:
        mine = dict(zip(channels, row[at:], strict=False))
        at += len(channels)
        place = [mine.get(f"{axis}position", o) for axis, o in zip("xyz", offset, strict=True)]
        turn = Rotation.identity()
        for channel in channels:
            if channel.endswith("rotation"):
                turn = turn * Rotation.from_euler(channel[0], mine[channel], degrees=True)
        turns.append(turn if parent < 0 else turns[parent] * turn)
        places.append(np.array(place) if parent < 0 else places[parent] + turns[parent].apply(place))
    return turns, places


@settings(max_examples=60, deadline=None)
@given(trees())
def test_random_hierarchies_against_scipy(tmp_path_factory, tree):
    joints, rows = tree
    got = bvh.read(save(tmp_path_factory.mktemp("bvh"), written(joints, rows)), unit="m")
    assert got.names == tuple(j[0] for j in joints)
    assert got.parents == tuple(j[1] for j in joints)
    assert got.fps == 120.0
    axes = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # the file's x, y, z as seen in the world
    for t, row in enumerate(rows):
        turns, places = brute_force(joints, row)
        np.testing.assert_allclose(got.positions[t], np.array(places) @ axes.T, atol=1e-9)
        expected = axes @ np.array([turn.as_matrix() for turn in turns]) @ axes.T
        np.testing.assert_allclose(got.rotations[t], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("written", "fps"),
    [("0.0333333", 30), ("0.008333", 120), (".0083333", 120), ("0.04", 25), ("0.0416667", 24), ("1e-2", 100)],
)
def test_frame_rate_is_whole_where_the_digits_allow(tmp_path, written, fps):
    assert bvh.read(save(tmp_path, SMALL.replace("0.0333333", written))).fps == fps


def test_a_frame_rate_that_is_not_whole_stays(tmp_path):
    assert bvh.read(save(tmp_path, SMALL.replace("0.0333333", "0.03336667"))).fps == pytest.approx(29.97, abs=1e-3)


@pytest.mark.parametrize("said", [1, 3])
def test_one_frame_more_or_less_than_the_file_says(tmp_path, said):
    got = bvh.read(save(tmp_path, SMALL.replace("Frames: 2", f"Frames: {said}")))
    np.testing.assert_array_equal(got.positions, bvh.read(save(tmp_path, SMALL)).positions)
    assert got.notes == (f"'Frames' says {said}, but there are 2: all are read",)
    assert bvh.read(save(tmp_path, SMALL)).notes == ()


def test_scale_channels(tmp_path):
    """They stand anywhere among the others. A scale of 1 changes nothing, one of 2 doubles what the joint carries."""
    text = SMALL.replace("CHANNELS 6 Xposition", "CHANNELS 9 Xscale Yscale Zscale Xposition")
    text = text.replace("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 4 Zrotation Xrotation Yrotation Yscale")
    rows = text.replace("0 95 0 0 0 0 0 0 0", "{0} {0} {0} 0 95 0 0 0 0 0 0 0 {1}")
    rows = rows.replace("0 95 10 0 90 0 0 0 0", "{0} {0} {0} 0 95 10 0 90 0 0 0 0 {1}")
    plain, same = (
        bvh.read(save(tmp_path, SMALL)),
        bvh.read(save(tmp_path, rows.replace("{0}", "1").replace("{1}", "1"))),
    )
    np.testing.assert_allclose(same.positions, plain.positions, atol=1e-15)
    twice = bvh.read(save(tmp_path, rows.replace("{0}", "2").replace("{1}", "1"))).positions
    np.testing.assert_allclose(twice - twice[:, :1], 2 * (plain.positions - plain.positions[:, :1]), atol=1e-12)
    longer = bvh.read(save(tmp_path, rows.replace("{0}", "1").replace("{1}", "2"))).positions
    np.testing.assert_allclose(longer[0, 2] - longer[0, 1], [0.1, 0, -1.7], atol=1e-12)


@pytest.mark.parametrize("up", "xyz")
def test_any_axis_may_be_vertical(tmp_path, up):
    """The same file with its axes renamed in turn is the same motion."""
    shift = {"y": 0, "z": 1, "x": 2}[up]
    turned = re.sub(r"[XYZ](?=position|rotation)", lambda axis: "XYZ"[("XYZ".index(axis[0]) + shift) % 3], SMALL)
    roll = lambda line: "OFFSET " + " ".join(map(str, np.roll(line[1].split(), shift)))
    turned = re.sub(r"OFFSET (.*)", roll, turned)
    got, same = bvh.read(save(tmp_path, turned), up=up), bvh.read(save(tmp_path, SMALL))
    np.testing.assert_allclose(got.positions, same.positions, atol=1e-12)
    with pytest.raises(MotionError, match="up must be x, y, z, -x, -y or -z, got 'w'"):
        bvh.read(save(tmp_path, SMALL), up="w")


def test_what_the_caller_says_goes_before_what_the_file_says(tmp_path):
    path = save(tmp_path, SMALL.replace("0.0333333", "0"))
    got = bvh.read(path, fps=60, unit="mm")
    assert got.fps == 60
    assert got.positions[0, 0, 2] == pytest.approx(0.095)


def test_six_channels_on_every_joint_replace_the_offsets(mocap):
    path = next(mocap.glob("bandai_namco/*-1/data/dataset-1_walk_normal_001.bvh"))
    got = bvh.read(path)
    assert got.fps == 30
    lowest = got.positions[:, [got.index("Foot_L"), got.index("Foot_R")], 2].min()
    assert 0.0 < lowest < 0.15
    assert 1.3 < np.median(got.positions[:, got.index("Head"), 2]) < 1.8
    thigh = got.positions[:, got.index("LowerLeg_L")] - got.positions[:, got.index("UpperLeg_L")]
    assert np.ptp(np.linalg.norm(thigh, axis=-1)) < 1e-3


def test_units_are_not_guessed(mocap):
    path = mocap / "cmu_bvh_misc" / "02_01.bvh"
    with pytest.raises(FormatError, match=r'0\.251 m long; .*56\.4 mm.* 1\.42 m, .*pass unit="cmu" \(--unit cmu\)'):
        bvh.read(path)
    got = bvh.read(path, unit="cmu")
    assert 1.3 < np.ptp(got.positions[0, :, 2]) < 1.9


BAD = {
    "no motion": (SMALL.split("MOTION")[0], "no MOTION section"),
    "another kind": ("MOTION\n" + SMALL, "must begin with HIERARCHY|HIERARCHY should be"),
    "brace missing": (SMALL.replace("}\nMOTION", "MOTION"), "brace still open"),
    "brace too many": (SMALL.replace("}\nMOTION", "}\n}\nMOTION"), r"line 16: .*outside of every joint"),
    "no offset": (SMALL.replace("OFFSET 10 -10 0", ""), "'Left Leg' has no OFFSET"),
    "offset not a number": (SMALL.replace("10 -10 0", "10 x 0"), "line 8: OFFSET must be a number, got 'x'"),
    "offset NaN": (SMALL.replace("10 -10 0", "10 nan 0"), "line 8: OFFSET must be finite"),
    "unknown channel": (
        SMALL.replace("Zrotation Xrotation Yrotation\n  J", "Wrotation Xrotation Yrotation\n J"),
        "line 5",
    ),
    "repeated channel": (SMALL.replace("3 Zrotation Xrotation", "3 Zrotation Zrotation"), "line 9: .*repeated"),
    "too many channels": (SMALL.replace("CHANNELS 3", "CHANNELS 1e12"), "line 9: .*0 to 9 channels"),
    "unknown word": (SMALL.replace("OFFSET 10", "OFSET 10"), "line 8: expected JOINT"),
    "joint outside": (SMALL.replace("ROOT", "JOINT"), "line 3: .*a ROOT must be outside"),
    "no joints": ("HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n", "has no ROOT"),
    "no channels": ("HIERARCHY\nROOT a {\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n", "has no channels"),
    "no frames line": (SMALL.replace("Frames: 2\n", ""), "line 17: expected 'Frames'"),
    "frames not whole": (SMALL.replace("Frames: 2", "Frames: 2.5"), "line 17: Frames must be a whole number"),
    "zero frames": (SMALL.replace("Frames: 2", "Frames: 0"), "line 17: Frames must be a whole number above 0"),
    "enormous": (SMALL.replace("Frames: 2", "Frames: 1000000000000"), "says 1000000000000, but there are 2"),
    "frames missing": (SMALL.replace("Frames: 2", "Frames: 4"), "'Frames' says 4, but there are 2"),
    "all frames missing": (SMALL.partition("0 95 0")[0].replace("Frames: 2", "Frames: 1"), "but there are 0"),
    "cut line": (SMALL[:-5], "line 20: expected 9 values, one per channel, got 7"),
    "value not a number": (SMALL.replace("0 95 10", "0 95 ten"), "line 20: a channel's value must be a number"),
    "value infinite": (SMALL.replace("0 95 10", "0 inf 10"), "line 20: a channel's value must be finite"),
    "value NaN": (SMALL.replace("0 95 10", "0 nan 10"), "line 20: a channel's value must be finite"),
    "frame time 0": (SMALL.replace("0.0333333", "0"), "'Frame Time' must be above 0, got '0'; pass fps="),
    "frame time negative": (SMALL.replace("0.0333333", "-0.1"), "'Frame Time' must be above 0"),
    "frame time NaN": (SMALL.replace("0.0333333", "nan"), "'Frame Time' must be above 0"),
    "frame time missing": (SMALL.replace("0.0333333", ""), "'Frame Time' must be above 0"),
    "a giant": (SMALL.replace("-85", "-8500"), "doesn't say its unit of length, and in centimetres"),
}


@pytest.mark.parametrize(("text", "problem"), BAD.values(), ids=BAD)
def test_bad_files_name_the_line(tmp_path, text, problem):
    path = save(tmp_path, text)
    with pytest.raises(FormatError, match=problem) as caught:
        bvh.read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("fps", [0, -1, np.nan, np.inf, "30", True])
def test_bad_fps_is_refused(tmp_path, fps):
    with pytest.raises(MotionError, match="fps must be"):
        bvh.read(save(tmp_path, SMALL), fps=fps)


@pytest.mark.parametrize("unit", ["parsec", 0, -1.0, np.nan, np.inf, True])
def test_bad_units_are_refused(tmp_path, unit):
    with pytest.raises(MotionError, match="unit must be one of m, "):
        bvh.read(save(tmp_path, SMALL), unit=unit)
