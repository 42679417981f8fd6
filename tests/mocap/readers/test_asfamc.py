import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.errors import FormatError
from motionenv.mocap.readers import asfamc, bvh

ASF = """# made by hand
:version 1.10
:name TEST
:units
  mass 1.0
  length 0.0254
  angle deg
:documentation
  anything
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thigh
    direction 0 -1 0
    length 0.5
    axis 0 0 20 XYZ
    dof rx ry rz
    limits (-160 20)
           (-70 70)
           (-60 70)
  end
  begin
    id 2
    name shank
    direction 0 -1 0
    length 0.4
    axis 0 0 0 XYZ
    dof rx
    limits (-10 170)
  end
:hierarchy
  begin
    thigh shank
    root thigh
  end
"""
AMC = """#!OML:ASF somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 0 1 2 0 0 0
thigh 0 0 0
shank 0
2
root 0 1 2 0 90 0
thigh 0 0 0
shank 90
"""


def save(folder, amc=AMC, asf=ASF):
    (folder / "01.asf").write_text(asf, newline="")
    path = folder / "01_01.amc"
    path.write_text(amc, newline="")
    return path


def test_small_file_by_hand(tmp_path):
    got = asfamc.read(save(tmp_path), fps=120)
    assert got.names == ("root", "thigh", "shank")
    assert got.parents == (-1, 0, 1)
    # 0.0254 units to the inch: the file is in metres, y up; the source's z is the world's x
    np.testing.assert_allclose(got.positions[0], [[2, 0, 1], [2, 0, 0.5], [2, 0, 0.1]], atol=1e-12)
    # turned a quarter to the left (source x, which was left, is now back); knee flexed by +90° about its x axis
    np.testing.assert_allclose(got.positions[1], [[2, 0, 1], [2, 0, 0.5], [2, -0.4, 0.5]], atol=1e-12)
    np.testing.assert_allclose(got.rotations[0], np.tile(np.eye(3), (3, 1, 1)), atol=1e-15)


def test_windows_lines_comments_and_radians_make_no_difference(tmp_path):
    expected = asfamc.read(save(tmp_path), fps=120)
    radians = AMC.replace("DEGREES", "RADIANS").replace("90", repr(np.pi / 2)).replace("1\nroot", "# hello\n1\nroot", 1)
    got = asfamc.read(save(tmp_path, radians.replace("\n", "\r\n"), ASF.replace("\n", "\r\n")), fps=120)
    np.testing.assert_allclose(got.positions, expected.positions, atol=1e-12)


AXES = st.permutations("XYZ").map("".join)
ANGLE = st.floats(-180, 180).map(lambda v: round(v, 4))


@st.composite
def skeletons(draw):
    """Bones (name, parent, direction, length, axis angles, axis order, dof, values), the root's values first."""
    bones = []
    for i in range(draw(st.integers(1, 6))):
        dof = draw(st.lists(st.sampled_from(["rx", "ry", "rz"]), unique=True))
        bones.append(
            (
                f"bone{i}",
                draw(st.sampled_from(["root", *(b[0] for b in bones)])),
                draw(st.lists(st.floats(-1, 1).map(lambda v: round(v, 4)), min_size=3, max_size=3)),
                draw(st.floats(0.1, 9).map(lambda v: round(v, 4))),
                draw(st.lists(ANGLE, min_size=3, max_size=3)),
                draw(AXES),
                dof,
                draw(st.lists(ANGLE, min_size=len(dof), max_size=len(dof))),
            )
        )
    order = draw(st.permutations(["TX", "TY", "TZ", "RX", "RY", "RZ"]))
    return order, draw(st.lists(ANGLE, min_size=6, max_size=6)), bones


def written(order, root, bones):
    asf = [":units", "length 0.0254", "angle deg", ":root", "order " + " ".join(order), "axis XYZ"]
    asf += ["position 0 0 0", "orientation 0 0 0", ":bonedata"]
    amc = [":FULLY-SPECIFIED", ":DEGREES", "1", "root " + " ".join(map(str, root))]
    for name, _, direction, length, angles, axis, dof, values in bones:
        asf += ["begin", f"name {name}", "direction " + " ".join(map(str, direction)), f"length {length}"]
        asf += [f"axis {' '.join(map(str, angles))} {axis}", *(["dof " + " ".join(dof)] if dof else []), "end"]
        amc += [f"{name} {' '.join(map(str, values))}"] if dof else []
    asf += [":hierarchy", "begin", *(f"{b[1]} {b[0]}" for b in reversed(bones)), "end"]
    return "\n".join(amc) + "\n", "\n".join(asf) + "\n"


def turn(order, degrees):
    """First-named axis applied first: scipy's lower case."""
    return Rotation.from_euler(order.lower(), degrees, degrees=True) if order else Rotation.identity()


@settings(max_examples=60, deadline=None)
@given(skeletons())
def test_random_skeletons_against_scipy(tmp_path_factory, skeleton):
    order, root, bones = skeleton
    got = asfamc.read(save(tmp_path_factory.mktemp("amc"), *written(*skeleton)), fps=120)
    values = dict(zip(order, root, strict=True))
    spins = [o for o in order if o[0] == "R"]
    turns = {"root": turn("".join(s[1] for s in spins), [values[s] for s in spins])}
    ends = {"root": np.array([values["TX"], values["TY"], values["TZ"]])}
    for name, parent, direction, length, angles, axis, dof, motion in bones:
        frame = turn(axis, angles)
        turns[name] = turns[parent] * frame * turn("".join(d[1] for d in dof), motion) * frame.inv()
        ends[name] = ends[parent] + turns[name].apply(np.array(direction) * length)
    for name, end in ends.items():
        np.testing.assert_allclose(got.positions[0, got.index(name)], end[[2, 0, 1]], atol=1e-9)
        expected = turns[name].as_matrix()[np.ix_([2, 0, 1], [2, 0, 1])]
        np.testing.assert_allclose(got.rotations[0, got.index(name)], expected, atol=1e-12)


TWINS = {
    "root": "Hips", "lhipjoint": "LeftUpLeg", "lfemur": "LeftLeg", "ltibia": "LeftFoot", "lfoot": "LeftToeBase",
    "rhipjoint": "RightUpLeg", "rfemur": "RightLeg", "rtibia": "RightFoot", "rfoot": "RightToeBase",
    "lowerback": "Spine", "upperback": "Spine1", "lowerneck": "Neck1", "upperneck": "Head",
    "lclavicle": "LeftArm", "lhumerus": "LeftForeArm", "lradius": "LeftHand",
    "rclavicle": "RightArm", "rhumerus": "RightForeArm", "rradius": "RightHand",
}  # fmt: skip


def test_amc_and_bvh_twins_agree(mocap):
    """Trial 01_01 as AMC and as BVH: the same points within 1 mm.

    The BVH begins with a rest pose that the AMC hasn't, and its conversion lost the bones that branch at their end:
    Neck and both shoulders have OFFSET 0 where the thorax was, LeftFingerBase and LThumb where the wrist was. So
    the AMC's points beyond the thorax are compared without it, and those beyond the wrist aren't.
    """
    amc = asfamc.read(mocap / "fairmotion_tests" / "01_01.amc", fps=120)
    twin = bvh.read(mocap / "fairmotion_tests" / "01_01.bvh", unit="cmu")
    assert len(twin.positions) == len(amc.positions) + 1
    thorax = amc.positions[:, amc.index("thorax")] - amc.positions[:, amc.index("upperback")]
    for bone, joint in TWINS.items():
        a, b = amc.positions[:, amc.index(bone)], twin.positions[1:, twin.index(joint)]
        if bone.endswith(("neck", "clavicle", "humerus", "radius")):
            a = a - thorax
        assert np.sqrt(((a - b) ** 2).sum(-1).mean()) < 1e-3, bone


def test_all_cmu_walkers_walk_where_they_look(mocap):
    paths = sorted(mocap.glob("cmu_asfamc/*/*.amc"))
    assert len(paths) == 59
    for path in paths:
        got = asfamc.read(path, fps=120)
        feet = got.positions[:, [got.index("ltibia"), got.index("rtibia")], 2]
        assert 0.0 < feet.min() < 0.2, path
        assert 1.3 < np.median(got.positions[:, got.index("head"), 2]) < 2.0, path
        left = got.positions[:, got.index("lhipjoint")] - got.positions[:, got.index("rhipjoint")]
        ahead = np.cross(left, [0, 0, 1])[:, :2]
        path_length = np.diff(got.positions[:, 0, :2], axis=0)
        assert (path_length * ahead[1:]).sum() > 0, path


def test_the_frame_rate_is_asked_for(tmp_path):
    with pytest.raises(FormatError, match="pass fps= \\(--fps\\), 120 for the CMU"):
        asfamc.read(save(tmp_path))


def test_the_skeleton_is_found_or_asked_for(tmp_path, mocap):
    path = save(tmp_path)
    (tmp_path / "02.asf").write_text(ASF.replace("0.5", "0.7"))
    assert asfamc.read(path, fps=120).positions[0, 1, 2] == pytest.approx(0.5)
    assert asfamc.read(path, asf=tmp_path / "02.asf", fps=120).positions[0, 1, 2] == pytest.approx(0.3)
    (tmp_path / "01.asf").rename(tmp_path / "03.asf")
    with pytest.raises(FormatError, match=r"beside it: 02\.asf, 03\.asf\); pass asf="):
        asfamc.read(path, fps=120)
    for name in ("02.asf", "03.asf"):
        (tmp_path / name).unlink()
    with pytest.raises(FormatError, match=r"beside it: none\); pass asf="):
        asfamc.read(path, fps=120)


BAD_AMC = {
    "no frames": (":DEGREES\n", "has no frames"),
    "missing bone": (AMC.replace("thigh 0 0 0\nshank 0\n", "shank 0\n"), "line 7: frame 1 ends without thigh"),
    "cut off": (AMC.replace("shank 90\n", ""), "line 10: frame 2 ends without shank"),
    "unknown bone": (AMC.replace("shank 0", "tail 0"), "line 7: values for 'tail', that the ASF"),
    "bone twice": (AMC.replace("shank 0", "thigh 0 0 0"), "line 7: values for 'thigh', outside of a frame, or twice"),
    "before a frame": ("root 0 0 0 0 0 0\n" + AMC, "line 1: values for 'root', outside"),
    "frame repeated": (AMC.replace("\n2\n", "\n1\n"), "line 8: expected frame 2, got '1'"),
    "frame skipped": (AMC.replace("\n2\n", "\n3\n"), "line 8: expected frame 2, got '3'"),
    "not a frame": (AMC.replace("\n1\n", "\none\n"), "line 4: expected a frame's number, got 'one'"),
    "too few values": (AMC.replace("thigh 0 0 0\nshank 90", "thigh 0 0\nshank 90"), "line 10: 'thigh' needs 3 finite"),
    "not a number": (AMC.replace("shank 90", "shank x"), "line 11: shank must be a number, got 'x'"),
    "NaN": (AMC.replace("shank 90", "shank nan"), "line 11: 'shank' needs 1 finite values"),
    "infinite": (AMC.replace("shank 90", "shank 1e999"), "line 11: 'shank' needs 1 finite values"),
}
BAD_ASF = {
    "empty": (" \n", "is empty"),
    "no bones": (ASF.split(":bonedata")[0], "no :bonedata section"),
    "no hierarchy": (ASF.split(":hierarchy")[0], "no :hierarchy section"),
    "no length of units": (ASF.replace("  length 0.0254\n", ""), "doesn't specify its 'length'; pass unit="),
    "zero length of units": (ASF.replace("0.0254", "0"), "'length' must be above 0"),
    "bone without end": (ASF.replace("end\n:hierarchy", ":hierarchy"), "last bone has no 'end'"),
    "bone without name": (ASF.replace("name shank", ""), "line 28: a bone has no name"),
    "bone twice": (ASF.replace("name shank", "name thigh"), "'thigh' occurs twice"),
    "no direction": (ASF.replace("    direction 0 -1 0\n", "", 1), "'direction' with 3 values is missing"),
    "direction not a number": (ASF.replace("direction 0 -1 0", "direction 0 -x 0", 1), "line 19: direction must be"),
    "axis without order": (ASF.replace("0 0 20 XYZ", "0 0 20"), "needs three angles and their order"),
    "unknown dof": (ASF.replace("dof rx ry rz", "dof rx l"), "line 22: degrees of freedom must be among rx ry rz"),
    "unknown child": (ASF.replace("root thigh", "root hip"), "line 39: bone 'hip' isn't in :bonedata"),
    "two parents": (ASF.replace("root thigh", "root thigh shank"), "line 39: shank has two parents"),
    "a loop": (ASF.replace("root thigh", "shank thigh"), "no chain leads from the root to shank, thigh"),
    "turned root": (ASF.replace("orientation 0 0 0", "orientation 0 9 0"), "root orientation other than"),
}


@pytest.mark.parametrize(("text", "problem"), BAD_AMC.values(), ids=BAD_AMC)
def test_bad_motion_files_name_the_line(tmp_path, text, problem):
    path = save(tmp_path, amc=text)
    with pytest.raises(FormatError, match=problem) as caught:
        asfamc.read(path, fps=120)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(("text", "problem"), BAD_ASF.values(), ids=BAD_ASF)
def test_bad_skeleton_files_name_the_line(tmp_path, text, problem):
    path = save(tmp_path, asf=text)
    with pytest.raises(FormatError, match=problem) as caught:
        asfamc.read(path, fps=120)
    assert str(path.with_name("01.asf")) in str(caught.value)
