"""MOT files through the kinematics of OpenSim's Rajagopal2015: written out here with SciPy, and by OpenSim itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionenv.body import NODES, from_height, markers
from motionenv.errors import GapError
from motionenv.mocap import write
from motionenv.types import MARKERS, POSE, Motion

PELVIS_ORIGIN = np.array([0.056276, 0.07849, 0.0]) / 1.70  # of Rajagopal2015.osim from between its hips, per height
SIGN = {"r": [1, 1, 1], "l": [1, -1, -1]}  # of the axes z, x, y of its hips and shoulders
KNOWN = [name for name in MARKERS if name not in ("head",)]  # OpenSim's model has no neck


def read(path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Header and columns, strictly by OpenSim's documentation of motion files."""
    lines = path.read_text().splitlines()
    end = lines.index("endheader")
    header = dict(line.split("=") for line in lines[1:end] if "=" in line)
    names, *rows = [line.split("\t") for line in lines[end + 1 :]]
    table = np.array(rows, dtype=float)
    assert lines[0] == "Coordinates"
    assert table.shape == (int(header["nRows"]), int(header["nColumns"])) == (len(rows), len(names))
    return header, dict(zip(names, table.T, strict=True))


def ground(points) -> np.ndarray:
    """World points in OpenSim's axes: x forward, y up, z right."""
    return np.asarray(points) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).T


def turn(columns, names, signs=(1, 1, 1)) -> Rotation:
    """Body-fixed rotations about z, x and y."""
    return Rotation.from_euler("ZXY", np.stack([columns[n] for n in names], axis=1) * signs, degrees=True)


def joints(columns, skeleton) -> dict[str, np.ndarray]:
    """Markers (frames, 3) [m] in the ground by the model's tree, with the body's lengths."""
    offset = dict(zip(NODES, ground(skeleton.offsets), strict=True))
    pelvis = turn(columns, ["pelvis_tilt", "pelvis_list", "pelvis_rotation"])
    origin = np.stack([columns[f"pelvis_t{a}"] for a in "xyz"], axis=1)
    between = 0.5 * (offset["left_hip"] + offset["right_hip"])
    root = origin - pelvis.apply(PELVIS_ORIGIN * skeleton.height + between)
    torso = pelvis * turn(columns, ["lumbar_extension", "lumbar_bending", "lumbar_rotation"])
    at = {"pelvis": root, "sternum": root + torso.apply(offset["sternum"])}
    for s, side in (("r", "right"), ("l", "left")):
        for carrier, ball, upper, hinge, lower in (
            (pelvis, "hip", ("hip_flexion", "hip_adduction", "hip_rotation"), "knee_angle", ("knee", "ankle")),
            (torso, "shoulder", ("arm_flex", "arm_add", "arm_rot"), "elbow_flex", ("elbow", "wrist")),
        ):
            at[f"{side}_{ball}"] = root + carrier.apply(offset[f"{side}_{ball}"])
            first = carrier * turn(columns, [f"{n}_{s}" for n in upper], SIGN[s])
            at[f"{side}_{lower[0]}"] = at[f"{side}_{ball}"] + first.apply(offset[f"{side}_{lower[0]}"])
            bend = columns[f"{hinge}_{s}"] * (-1 if hinge == "knee_angle" else 1)
            second = first * Rotation.from_euler("Z", bend[:, None], degrees=True)
            at[f"{side}_{lower[1]}"] = at[f"{side}_{lower[0]}"] + second.apply(offset[f"{side}_{lower[1]}"])
    return at


def expected(motion) -> dict[str, np.ndarray]:
    """The markers in the ground, by quarter turns such that the motion faces x most."""
    mean = np.arctan2(np.sin(motion.poses[:, 5]).sum(), np.cos(motion.poses[:, 5]).sum())
    turned = Rotation.from_euler("z", -np.round(mean / (np.pi / 2)) * np.pi / 2).apply
    points = markers(motion.poses, motion.skeleton)
    return {name: ground(turned(points[:, i])) for i, name in enumerate(MARKERS)}


def check(found, motion):
    truth = expected(motion)
    for name in KNOWN:
        np.testing.assert_allclose(found[name], truth[name], atol=1e-6, err_msg=name)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_models_joints_are_where_the_bodys_are_in_any_pose(seed, any_motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("mot") / "a.mot"
    motion = any_motion(seed)
    write(motion, path)
    check(joints(read(path)[1], motion.skeleton), motion)


def test_a_walk_in_degrees_faces_x_and_stands_on_the_ground(walk, tmp_path):
    write(walk, tmp_path / "a.mot")
    header, columns = read(tmp_path / "a.mot")
    check(joints(columns, walk.skeleton), walk)
    assert (header["inDegrees"], header["version"]) == ("yes", "1")
    np.testing.assert_allclose(columns["time"], np.arange(len(walk.poses)) / 120, atol=1e-8)
    assert np.abs(columns["pelvis_rotation"]).max() < 45
    assert columns["pelvis_tx"][-1] - columns["pelvis_tx"][0] > 2
    assert 0.8 < np.median(columns["pelvis_ty"]) / walk.skeleton.height * 1.7 < 1.05  # Rajagopal2015 stands at 0.94
    knees = np.stack([columns["knee_angle_r"], columns["knee_angle_l"]])
    assert knees.min() > -10
    assert 40 < knees.max() < 90


def test_signs_are_the_models(tmp_path):
    """One angle at a time, and what Rajagopal2015 calls it."""
    entries = (
        ("root_tilt", "pelvis_tilt", -1), ("root_obliquity", "pelvis_list", 1), ("root_heading", "pelvis_rotation", 1),
        *((f"{side}_{ours}", f"{theirs}_{side[0]}", sign) for side in ("left", "right") for ours, theirs, sign in (
            ("hip_flexion", "hip_flexion", 1), ("hip_abduction", "hip_adduction", -1),
            ("hip_rotation", "hip_rotation", 1), ("knee_flexion", "knee_angle", 1),
            ("shoulder_flexion", "arm_flex", 1), ("shoulder_abduction", "arm_add", -1),
            ("shoulder_rotation", "arm_rot", 1), ("elbow_flexion", "elbow_flex", 1),
        )),
    )  # fmt: skip
    poses = np.zeros((len(entries), 25))
    for frame, (ours, _, _) in enumerate(entries):
        poses[frame, POSE.index(ours)] = 0.3
    write(Motion(poses, from_height(), 100.0), tmp_path / "a.mot")
    columns = read(tmp_path / "a.mot")[1]
    for frame, (_, theirs, sign) in enumerate(entries):
        rest = [c[frame] for n, c in columns.items() if n not in (theirs, "time") and "pelvis_t" not in n[:8]]
        assert columns[theirs][frame] == pytest.approx(sign * np.degrees(0.3), abs=1e-6)
        if not theirs.startswith("pelvis"):
            np.testing.assert_allclose(rest, 0, atol=1e-6)


def test_angles_are_continuous_where_a_walker_turns_round_and_round(tmp_path):
    poses = np.zeros((400, 25))
    poses[:, 5] = np.linspace(0, 6 * np.pi, 400)
    poses[:, 3:5] = 0.3, 0.2
    poses[:, 17] = np.unwrap(poses[:, 5]) % (2 * np.pi)  # a source that jumps by a turn
    write(Motion(poses, from_height(), 100.0), tmp_path / "a.mot")
    columns = read(tmp_path / "a.mot")[1]
    angles = np.stack([c for n, c in columns.items() if (n != "time" and "pelvis_t" not in n) or n == "pelvis_tilt"])
    assert np.abs(np.diff(angles)).max() < 10
    check(joints(columns, from_height()), Motion(poses, from_height(), 100.0))


def test_missing_limbs_are_left_out_and_gaps_refused(walk, tmp_path):
    poses = walk.poses.copy()
    poses[:, 6:17] = np.nan
    lower = Motion(poses, walk.skeleton, walk.fps)
    write(lower, tmp_path / "lower.mot")
    write(walk, tmp_path / "whole.mot")
    columns, whole = read(tmp_path / "lower.mot")[1], read(tmp_path / "whole.mot")[1]
    assert set(whole) - set(columns) == {
        f"{n}_{s}" for n in ("arm_flex", "arm_add", "arm_rot", "elbow_flex") for s in "lr"
    }
    for name, column in columns.items():
        np.testing.assert_array_equal(column, whole[name])
    poses[7, 20] = np.nan
    with pytest.raises(
        GapError, match=r"left_knee_flexion of frame 7 is nan, and so are values of 1 frames: MOT can't"
    ):
        write(Motion(poses, walk.skeleton, walk.fps), tmp_path / "gap.mot")


#: Carrier, coordinates of the ball joint, its name, the upper segment, the hinge, the lower segment, its coordinate.
CHAINS = (
    ("pelvis", "hip_flexion hip_adduction hip_rotation", "hip", "femur", "knee", "tibia", ("knee_angle", "z", -1)),
    ("torso", "arm_flex arm_add arm_rot", "shoulder", "humerus", "elbow", "ulna", ("elbow_flex", "z", 1)),
)


def transform_axis(name: str, coordinate: str, axis: str, factor: int) -> str:
    function = "<LinearFunction><coefficients>{} 0</coefficients></LinearFunction>" if coordinate else "<Constant/>"
    vector = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}[axis]
    inner = f"<coordinates>{coordinate}</coordinates><axis>{vector}</axis>{function.format(factor)}"
    return f'<TransformAxis name="{name}">{inner}</TransformAxis>'


def joint(child: str, parent: str, place, turns, moves=(("", "x", 0), ("", "y", 0), ("", "z", 0))) -> str:
    """A CustomJoint of an .osim file; `turns` and `moves` are coordinate, axis and factor."""
    turns = [*turns, *[("", axis, 0) for axis in "zxy" if axis not in [t[1] for t in turns]]]
    names = [f"{kind}{i}" for kind in ("rotation", "translation") for i in (1, 2, 3)]
    axes = "".join(transform_axis(name, *row) for name, row in zip(names, (*turns, *moves), strict=True))
    coordinates = "".join(f'<Coordinate name="{row[0]}"/>' for row in (*turns, *moves) if row[0])
    frame = (
        f'<PhysicalOffsetFrame name="at"><socket_parent>{parent}</socket_parent>'
        f"<translation>{' '.join(map(repr, map(float, place)))}</translation></PhysicalOffsetFrame>"
    )
    return (
        f'<CustomJoint name="to_{child}"><socket_parent_frame>at</socket_parent_frame>'
        f"<socket_child_frame>/bodyset/{child}</socket_child_frame><coordinates>{coordinates}</coordinates>"
        f"<frames>{frame}</frames><SpatialTransform>{axes}</SpatialTransform></CustomJoint>"
    )


def opensim_model(skeleton) -> tuple[str, dict[str, tuple[str, np.ndarray]]]:
    """An .osim file with Rajagopal2015's joints and the body's lengths, and per marker its body and place in it."""
    offset = dict(zip(NODES, ground(skeleton.offsets), strict=True))
    root = -(PELVIS_ORIGIN * skeleton.height + 0.5 * (offset["left_hip"] + offset["right_hip"]))
    pelvis = [("pelvis_tilt", "z", 1), ("pelvis_list", "x", 1), ("pelvis_rotation", "y", 1)]
    lumbar = [("lumbar_extension", "z", 1), ("lumbar_bending", "x", 1), ("lumbar_rotation", "y", 1)]
    made = {
        "pelvis": joint("pelvis", "/ground", np.zeros(3), pelvis, [(f"pelvis_t{a}", a, 1) for a in "xyz"]),
        "torso": joint("torso", "/bodyset/pelvis", root, lumbar),
    }
    stations = {"sternum": ("torso", offset["sternum"])}
    for s, side in (("r", "right"), ("l", "left")):
        for carrier, names, ball, upper, middle, lower, hinge in CHAINS:
            turns = [(f"{n}_{s}", axis, f) for n, axis, f in zip(names.split(), "zxy", SIGN[s], strict=True)]
            place = offset[f"{side}_{ball}"] + (root if carrier == "pelvis" else 0)
            first, second = f"{upper}_{s}", f"{lower}_{s}"
            made[first] = joint(first, f"/bodyset/{carrier}", place, turns)
            bend = (f"{hinge[0]}_{s}", *hinge[1:])
            made[second] = joint(second, f"/bodyset/{first}", offset[f"{side}_{middle}"], [bend])
            end = {"knee": "ankle", "elbow": "wrist"}[middle]
            stations |= {f"{side}_{middle}": (second, np.zeros(3)), f"{side}_{end}": (second, offset[f"{side}_{end}"])}
    inertia = "<mass>1</mass><mass_center>0 0 0</mass_center><inertia>1 1 1 0 0 0</inertia>"
    bodies = "".join(f'<Body name="{name}">{inertia}</Body>' for name in made)
    joints_set = f"<JointSet><objects>{''.join(made.values())}</objects></JointSet>"
    sets = f"<BodySet><objects>{bodies}</objects></BodySet>{joints_set}"
    return f'<OpenSimDocument Version="40000"><Model name="body">{sets}</Model></OpenSimDocument>', stations


@pytest.mark.integration
def test_opensim_moves_its_joints_to_the_bodys(walk, tmp_path):
    o = pytest.importorskip("opensim", reason="pip install opensim")
    o.Logger.setLevelString("Off")
    write(walk, tmp_path / "a.mot")
    table = o.TimeSeriesTable(str(tmp_path / "a.mot"))
    storage = o.Storage(str(tmp_path / "a.mot"))
    assert storage.isInDegrees()
    assert storage.getSize() == table.getNumRows() == len(walk.poses)
    text, stations = opensim_model(walk.skeleton)
    (tmp_path / "body.osim").write_text(text)
    model = o.Model(str(tmp_path / "body.osim"))
    state = model.initSystem()
    truth, labels, coordinates = expected(walk), table.getColumnLabels(), model.getCoordinateSet()
    assert {coordinates.get(i).getName() for i in range(coordinates.getSize())} == set(labels)
    for frame in range(0, len(walk.poses), 49):
        for label, value in zip(labels, table.getRowAtIndex(frame).to_numpy(), strict=True):
            moves = label in ("pelvis_tx", "pelvis_ty", "pelvis_tz")
            coordinates.get(label).setValue(state, value if moves else np.radians(value), False)
        model.realizePosition(state)
        for name, (body, place) in stations.items():
            found = model.getBodySet().get(body).findStationLocationInGround(state, o.Vec3(*place)).to_numpy()
            np.testing.assert_allclose(found, truth[name][frame], atol=1e-6, err_msg=name)
