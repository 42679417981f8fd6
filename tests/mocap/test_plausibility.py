"""Captures that are misread, damaged or not of one person, made from walks of a model; and people who look odd."""

import re
from dataclasses import replace

import numpy as np
import pytest

import motionenv
from motionenv.errors import CaptureWarning, MotionError
from motionenv.gait import analyse
from motionenv.gait.feet import feet_of
from motionenv.mocap import MarkerMap, read, read_motion, retarget, to_markers, write_markers
from motionenv.mocap.clinical import clinical_angles
from motionenv.mocap.plausibility import check_plausible, find_doubts, mended
from motionenv.types import MARKERS, POSE, Markers, Motion

_NAMES = {
    "head": "Head", "left_shoulder": "LShoulder", "right_shoulder": "RShoulder", "left_elbow": "LElbow",
    "right_elbow": "RElbow", "left_wrist": "LWrist", "right_wrist": "RWrist", "left_hip": "LHip", "right_hip": "RHip",
    "left_knee": "LKnee", "right_knee": "RKnee", "left_ankle": "LAnkle", "right_ankle": "RAnkle",
}  # fmt: skip


def walk(seconds: float = 3.0, **how) -> Markers:
    """A walk of a model as a detector in space would name its joints, heels and toes; 100 frames per second."""
    motion = motionenv.synthesize("walk/fpca", seconds=seconds, fps=100.0, seed=3, **how)
    return points_of(motion)


def points_of(motion: Motion) -> Markers:
    joints, feet = motionenv.body.markers(motion.poses, motion.skeleton), feet_of(motion)
    names = [*_NAMES.values(), "LHeel", "RHeel", "LBigToe", "RBigToe"]
    ends = [feet.heel["left"], feet.heel["right"], feet.toe["left"], feet.toe["right"]]
    columns = [joints[:, MARKERS.index(name)] for name in _NAMES]
    return Markers(names, np.stack([*columns, *ends], 1), motion.fps, name="walk")


@pytest.fixture(scope="module")
def person() -> Markers:
    return walk()


def changed(markers: Markers, name: str, positions: np.ndarray) -> Markers:
    points = markers.positions.copy()
    points[:, markers.index(name)] = positions
    return replace(markers, positions=points)


def turned(markers: Markers, matrix) -> Markers:
    return replace(markers, positions=markers.positions @ np.asarray(matrix, dtype=float).T)


def of(markers: Markers, name: str) -> np.ndarray:
    return markers.positions[:, markers.index(name)].copy()


def test_a_walk_raises_no_doubt(person):
    assert find_doubts(person) == ()
    check_plausible(person)


@pytest.mark.parametrize("style", ["child", "giant", "crouch", "backwards", "tilted"])
def test_who_looks_odd_raises_no_doubt(person, style):
    points = person.positions.copy()
    if style in ("child", "giant"):
        points *= 0.45 if style == "child" else 1.35
    elif style == "crouch":  # pelvis and all above it lower by 20 cm, knees forward so that limbs keep their length
        points = crouched().positions
    elif style == "backwards":
        points = points[::-1]
    else:
        a = np.radians(12.0)
        points = points @ np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    assert find_doubts(replace(person, positions=points)) == ()


def crouched() -> Markers:
    """A walk in which hips and knees bend by 35 and 50 degrees more."""
    motion = motionenv.synthesize("walk/fpca", seconds=3.0, fps=100.0, seed=3)
    poses = motion.poses.copy()
    for side in ("left", "right"):
        poses[:, POSE.index(f"{side}_hip_flexion")] += np.radians(35.0)
        poses[:, POSE.index(f"{side}_knee_flexion")] += np.radians(50.0)
    return points_of(replace(motion, poses=poses))


@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        ([[0, 0, 1], [1, 0, 0], [0, 1, 0]], "vertical axis"),
        ([[1, 0, 0], [0, -1, 0], [0, 0, -1]], "vertical axis"),
    ],
)
def test_another_vertical_axis_is_doubted(person, matrix, says):
    assert any(says in doubt for doubt in find_doubts(turned(person, matrix)))


def test_a_mirrored_person_bends_knees_backwards(person):
    doubts = find_doubts(turned(person, np.diag([1.0, -1.0, 1.0])))
    assert any("knees bend backwards" in doubt for doubt in doubts)


def test_limbs_of_two_people_are_doubted(person):
    other = walk(speed=0.7)
    mixed = person
    for name in ("LHip", "RHip"):
        mixed = changed(mixed, name, of(other, name) + np.array([1.5, 0.8, 0.0]))
    assert any("thigh" in doubt for doubt in find_doubts(mixed))


def test_exchanged_labels_are_doubted(person):
    knee, ankle = of(person, "LKnee"), of(person, "LAnkle")
    mixed = changed(changed(person, "LKnee", ankle), "LAnkle", knee)
    assert any("left thigh" in doubt for doubt in find_doubts(mixed))
    heel, toe = of(person, "RHeel"), of(person, "RBigToe")
    assert find_doubts(changed(changed(person, "RHeel", toe), "RBigToe", heel)) == (
        "the right foot points backwards, as if heel and toe were exchanged",
    )


def test_markers_that_exchange_places_are_named(person):
    left, right = of(person, "LKnee"), of(person, "RKnee")
    apart = np.linalg.norm(left - right, axis=-1)
    start = int(apart[100:200].argmax()) + 100
    left[start:], right[start:] = right[start:].copy(), left[start:].copy()
    doubts = find_doubts(changed(changed(person, "LKnee", left), "RKnee", right))
    assert f"LKnee and RKnee exchange places at {start / 100:.2f} s" in doubts


def test_speed_and_size_are_a_persons(person):
    assert any("faster than anybody" in doubt for doubt in find_doubts(replace(person, fps=2000.0)))
    assert any("not a person's" in doubt for doubt in find_doubts(turned(person, 3.0 * np.eye(3))))


def test_a_unit_that_is_misstated_is_replaced(person, tmp_path):
    path = tmp_path / "walk.trc"
    write_markers(person, path)
    text = path.read_text()
    assert "\tmm\t" in text
    path.write_text(text.replace("\tmm\t", "\tm\t"))
    with pytest.warns(CaptureWarning, match="read in mm"):
        found = read(path)
    np.testing.assert_allclose(found.positions, person.positions, atol=1e-5)
    assert find_doubts(found) == ()
    assert any("not a person's" in doubt for doubt in find_doubts(read(path, unit="m")))  # who gives a unit gets it


@pytest.mark.parametrize("up", ["x", "-x", "-y", "-z"])
def test_the_vertical_axis_is_found_by_the_body(person, tmp_path, up):
    """A file of one whose arms and path are longer than the body is high, with another axis up."""
    long = replace(person, positions=np.concatenate([person.positions, person.positions[:, :1] + [3.0, 2.0, 0.0]], 1),
                   names=(*person.names, "wand"))  # fmt: skip
    path = tmp_path / "walk.trc"
    sign = -1.0 if up.startswith("-") else 1.0
    back = {"x": [2, 0, 1], "y": [1, 2, 0], "z": [0, 1, 2]}[up[-1]]
    points = (long.positions * [1.0, sign, sign])[..., back]
    # `write_markers` writes a y-up file of z-up points: these come out with `up` as their axis
    write_markers(replace(long, positions=points[..., [0, 2, 1]] * [1.0, -1.0, 1.0]), path)
    with pytest.warns(CaptureWarning, match=f"stands along {up},"):
        found = read(path)
    assert find_doubts(found) == ()
    rise = of(found, "Head") - of(found, "LAnkle")
    assert np.median(rise[:, 2]) > 1.2
    np.testing.assert_allclose(found.positions, read(path, up=up).positions)


def test_a_marker_that_sticks_is_a_gap(person):
    heel = of(person, "LHeel")
    swing = int(np.argmax(np.diff(heel[:250, 0])))
    heel[swing : swing + 20] = heel[swing]
    found = mended(changed(person, "LHeel", heel), lambda **_: person, ())
    gaps = np.isnan(of(found, "LHeel")).all(-1)
    assert gaps[swing : swing + 20].all()
    assert gaps.sum() == 20
    assert "LHeel" in found.notes[0]
    assert "stuck" in found.notes[0]


@pytest.mark.parametrize("digits", [2, 3])
def test_feet_that_repeat_their_place_in_stance_have_no_gaps(person, digits):
    rounded = replace(person, positions=np.round(person.positions, digits))
    assert (np.diff(of(rounded, "LHeel"), axis=0) == 0).all(-1).sum() > 20
    assert mended(rounded, lambda **_: rounded, ()).notes == ()


def test_who_stands_still_has_no_gaps(person):
    still = replace(person, positions=np.repeat(person.positions[:1], 100, axis=0))
    assert mended(still, lambda **_: still, ()).notes == ()


def test_a_plane_has_flexion_only(person):
    flat = replace(person, positions=person.positions * [1.0, 0.0, 1.0])
    assert find_doubts(flat) == ("all points lie in one plane, so only angles seen from the side are known",)
    seen, whole = clinical_angles(flat), clinical_angles(retarget(person))
    known = {name for name in seen.names if np.isfinite(seen[name]).any()}
    assert {name.partition("_")[2] for name in known} == {"hip_flexion", "knee_flexion", "ankle_dorsiflexion"}
    for side in ("left", "right"):
        name = f"{side}_knee_flexion"
        np.testing.assert_allclose(seen[name], whole[name], atol=4.0)
    behind = replace(flat, positions=flat.positions * [-1.0, 1.0, 1.0])  # the same film from the other side
    np.testing.assert_allclose(clinical_angles(behind).values, seen.values, atol=1e-9)


def test_doubts_reach_whoever_asks(person, tmp_path):
    flat = replace(person, positions=person.positions * [1.0, 0.0, 1.0])
    path = tmp_path / "flat.trc"
    write_markers(flat, path)
    with pytest.warns(CaptureWarning, match="flat.trc is not plausible: all points lie in one plane"):
        read_motion(path)
    with pytest.raises(MotionError, match="not plausible: all points lie in one plane"):
        check_plausible(flat)
    assert analyse(flat).doubts == find_doubts(flat)


def test_a_model_of_people_is_plausible():
    for seed in range(5):
        assert find_doubts(motionenv.synthesize("walk/fpca", seconds=2.0, seed=seed)) == ()


def test_captures_without_legs_say_nothing(person):
    arms = replace(person, names=[f"p{i}" for i in range(len(person.names))])
    assert find_doubts(arms) == ()
    assert to_markers(person).positions.shape == (300, 15, 3)


def test_legs_with_exchanged_sides_are_doubted(person):
    names = [name.replace("L", "R", 1) if name[0] == "L" else name.replace("R", "L", 1) for name in person.names]
    legs = [n if p[1:] in ("Knee", "Ankle", "Heel", "BigToe") else p for p, n in zip(person.names, names, strict=True)]
    assert any("legs' sides" in doubt for doubt in find_doubts(replace(person, names=tuple(legs))))


def test_a_recording_that_stood_still_has_a_gap(person):
    """All points repeat their place and then jump. Somebody who stands still, and then goes on, doesn't jump."""
    points = person.positions.copy()
    points[100:150] = points[100]
    (note,) = mended(replace(person, positions=points), lambda **_: person, ()).notes
    assert note == "no point moves at 1.01 to 1.49 s, then all jump: gaps there"
    waits = np.concatenate([person.positions[:100], np.tile(person.positions[100], (50, 1, 1)), person.positions[100:]])
    still = mended(replace(person, positions=waits), lambda **_: person, ())
    assert still.notes == ()
    np.testing.assert_array_equal(still.positions, waits)


def test_a_unit_that_two_readings_explain_is_not_chosen(person):
    """Inches called millimetres: in centimetres it would be a child. Analysis says what is wrong with the size."""
    inches = replace(person, positions=person.positions / 25.4)
    of = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
    again = lambda unit: replace(inches, positions=inches.positions * of[unit])
    assert mended(inches, again, ("unit",)).notes == ()
    assert any("not a person's" in doubt for doubt in find_doubts(inches))


def with_leg_markers() -> Markers:
    """The walk with wands and lateral markers on the left leg, 4 cm beside the lines from hip to ankle."""
    joints = walk()
    hip, knee, ankle = (of(joints, name) for name in ("LHip", "LKnee", "LAnkle"))
    aside = np.array([0.0, 0.04, 0.0])
    beside = {"LTHI": 0.5 * (hip + knee), "LKNE": knee, "LTIB": 0.5 * (knee + ankle), "LANK": ankle}
    points = np.concatenate([joints.positions, np.stack([place + aside for place in beside.values()], 1)], 1)
    return replace(joints, names=(*joints.names, *beside), positions=points)


LEG_NAMES = {
    **{f"left_{joint}": f"L{joint.title()}" for joint in ("hip", "heel")},
    **{f"right_{joint}": f"R{joint.title()}" for joint in ("hip", "knee", "ankle", "heel")},
    "left_toe": "LBigToe", "right_toe": "RBigToe", "left_thigh": "LTHI", "left_shank": "LTIB",
    "left_knee_lateral": "LKNE", "left_ankle_lateral": "LANK",
}  # fmt: skip
LEG_MAP = MarkerMap({landmark: ({name: 1.0},) for landmark, name in LEG_NAMES.items()})


@pytest.mark.parametrize(
    ("one", "other", "says"),
    [
        ("LTHI", "LKNE", "the left knee is nearer to the hip than the thigh is"),
        ("LTIB", "LANK", "the left ankle is nearer to the knee than the shank is"),
        ("LHeel", "LANK", "the left heel is nearer to the toe than the ankle is"),
        ("LHeel", "RHeel", "the left heel and toe are"),
        ("LBigToe", "RBigToe", "the right heel and toe are"),
        ("LTIB", "RAnkle", "the left shank and ankle are"),
    ],
)
def test_markers_of_legs_that_are_exchanged_throughout_are_doubted(one, other, says):
    whole = with_leg_markers()
    assert find_doubts(whole, LEG_MAP) == ()
    mixed = changed(changed(whole, one, of(whole, other)), other, of(whole, one))
    assert any(doubt.startswith(says) for doubt in find_doubts(mixed, LEG_MAP))


def test_a_size_is_doubted_by_markers_where_joints_cannot_be_placed():
    """Legs of 3 cm are shorter than what lies between a knee's marker and its centre."""
    small = turned(with_leg_markers(), np.eye(3) / 25.4)
    assert any("not a person's" in doubt for doubt in find_doubts(small, LEG_MAP))


def test_a_marker_that_jumps_is_named_with_its_time(person):
    heel = of(person, "LHeel")
    heel[150] += [0.2, 0.0, 0.3]
    (doubt,) = find_doubts(changed(person, "LHeel", heel))
    assert re.fullmatch(r"LHeel jumps by 0\.3\d m at 1\.50 s", doubt)


@pytest.mark.parametrize("every", [1, 10])
def test_repeated_frames_are_doubted_and_standing_is_not(person, every):
    """Films of 50 frames a second that are sampled at 100 repeat every frame; others some of them."""
    kept = np.sort(np.concatenate([np.arange(300), np.arange(0, 300, every)]))
    repeats = replace(person, positions=person.positions[kept])
    (doubt,) = find_doubts(repeats)
    assert doubt.startswith(f"{300 // every} of {len(kept)} frames repeat the one before")
    still = replace(person, positions=np.repeat(person.positions[:1], 100, axis=0))
    assert find_doubts(still) == ()


@pytest.mark.parametrize("start", [0, 40])
def test_a_marker_that_sticks_nearly_all_along_is_a_gap(person, start):
    heel = of(person, "LHeel")
    heel[start:] = heel[start]
    found = mended(changed(person, "LHeel", heel), lambda **_: person, ())
    assert np.isnan(of(found, "LHeel")[start:]).all()
    assert np.isfinite(of(found, "LHeel")[:start]).all()
    assert "LHeel" in found.notes[0]
