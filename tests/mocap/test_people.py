"""Two people in one file are kept apart, and rigid bodies aren't people."""

import ezc3d
import numpy as np
import pytest

from motionenv import load
from motionenv.body.kinematics import markers
from motionenv.errors import FormatError
from motionenv.gait import read_trial
from motionenv.mocap import MarkerMap, find_landmarks, read, read_motion, write_markers
from motionenv.mocap.people import choose
from motionenv.types import MARKERS, Markers

RIGID = {f"{body}:Marker{i}": [i, len(body), 1.0] for body in ("Chair", "Arm") for i in (1, 2, 3)}
EVENTS = {"Anna": 0.5, "Ben": 0.7}  # times of one contact of each [s]


@pytest.fixture(scope="module")
def anna() -> np.ndarray:
    """The 15 markers (frames, 15, 3) [m] of a walk of three seconds."""
    walk = load("walk/fpca").synthesize(seconds=3.0, fps=100.0, seed=1)
    return markers(walk.poses, walk.skeleton)


def points_of(anna, **people) -> dict[str, np.ndarray]:
    """Points by name of people, each with so many of the walker's markers, and a metre from the one before."""
    return {
        f"{who}:{name}" if who != "nobody" else name: anna[:, MARKERS.index(name)] + [0, place, 0]
        for place, (who, names) in enumerate(people.items())
        for name in names
    }


def save(folder, points, subjects=(), suffix=".c3d"):
    path = folder / f"two{suffix}"
    if suffix != ".c3d":
        write_markers(Markers(tuple(points), np.stack([*points.values()], axis=1), 100.0), path)
        return path
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(points)
    file.add_parameter("POINT", "UNITS", ["m"])
    data = np.ones((4, len(points), len(next(iter(points.values())))))
    data[:3] = np.moveaxis(np.stack([*points.values()]), -1, 0)
    file["data"]["points"] = data
    if subjects:
        file.add_parameter("SUBJECTS", "NAMES", list(subjects))
    for name, value in {
        "USED": [2], "CONTEXTS": ["Left"] * 2, "LABELS": ["Foot Strike"] * 2, "SUBJECTS": list(EVENTS),
        "TIMES": np.array([[0.0] * 2, [*EVENTS.values()]]),
    }.items():  # fmt: skip
        file.add_parameter("EVENT", name, value)
    file.write(str(path))
    return path


PELVIS = ("pelvis", "left_hip", "right_hip")


@pytest.mark.parametrize("first", ["Anna", "Ben"])
def test_the_wholest_person_is_read_and_another_can_be(tmp_path, anna, first):
    people = {"Anna": MARKERS, "Ben": PELVIS} if first == "Anna" else {"Ben": PELVIS, "Anna": MARKERS}
    points = points_of(anna, **people)
    path = save(tmp_path, points, subjects=("Ben", "Anna"))
    got = read(path)
    assert got.names == MARKERS
    np.testing.assert_allclose(got.positions, np.stack([points[f"Anna:{n}"] for n in MARKERS], axis=1), atol=1e-6)
    assert (got.recording.subject, [e.time for e in got.recording.events]) == ("Anna", [pytest.approx(0.5, abs=1e-6)])
    taken = "Anna is taken, and person= (--person) takes another"
    assert got.notes == (f"the file shows 2 people, Anna (16 landmarks), Ben (3 landmarks): {taken}",)
    other = read(path, person="ben")
    assert (other.names, other.recording.subject) == (PELVIS, "Ben")
    assert [e.time for e in other.recording.events] == [pytest.approx(0.7, abs=1e-6)]
    with pytest.raises(FormatError, match=r"shows no person 'Carl'; person= \(--person\) may be"):
        read(path, person="Carl")


def test_formats_whose_names_keep_their_prefix(tmp_path, anna):
    points = points_of(anna, Ben=PELVIS, Anna=MARKERS)
    path = save(tmp_path, points, suffix=".trc")
    got = read(path)
    assert got.names == tuple(name for name in points if name.startswith("Anna:"))
    assert "Anna is taken" in got.notes[0]
    assert find_landmarks(got).points.keys() >= set(MARKERS)
    assert read(path, person="Ben").names == tuple(f"Ben:{n}" for n in PELVIS)


def test_people_without_a_prefix_or_a_colon(tmp_path, anna):
    unnamed = read(save(tmp_path, points_of(anna, Ben=PELVIS, nobody=MARKERS)))
    assert unnamed.names == MARKERS
    assert "unnamed (16 landmarks), Ben (3 landmarks): unnamed is taken" in unnamed.notes[0]
    assert read(save(tmp_path, points_of(anna, nobody=MARKERS, Ben=PELVIS)), person="Ben").names == PELVIS
    points = {name.replace(":", "_"): p for name, p in points_of(anna, Ben=PELVIS, Anna=MARKERS).items()}
    assert read(save(tmp_path, points, subjects=("Ben", "Anna"))).names == MARKERS


def test_rigid_bodies_keep_their_prefix_and_are_nobody(tmp_path, anna):
    still = {name: np.tile(place, (len(anna), 1)) for name, place in RIGID.items()}
    got = read(save(tmp_path, {**still, **points_of(anna, Anna=MARKERS)}, subjects=("Chair", "Arm")))
    assert got.names == (*RIGID, *MARKERS)
    assert got.notes == ()
    wanted = MarkerMap.parse('[points]\nleft_elbow_lateral = "Arm:Marker1"\nleft_wrist = "Leg:Marker1"')
    assert find_landmarks(got, wanted).points == {"left_elbow_lateral": {"Arm:Marker1": 1.0}}


@pytest.mark.parametrize("way", ["{who}_{name}", "{who} {name}", "{who}.{name}"])
def test_other_separators_part_people_whose_names_are_known_only_so(anna, way):
    points = {
        way.format(who=who, name=name): anna[:, i] + [0, place, 0]
        for place, who in enumerate(("Anna", "Ben")) for i, name in enumerate(MARKERS)
    }  # fmt: skip
    choice = choose("a.c3d", list(points), np.stack([*points.values()], axis=1), "ben")
    assert (choice.names, choice.others) == (MARKERS, ("Anna",))


def test_names_that_occur_twice_are_those_of_two_people(anna):
    """But a few that do are a person's, with points that are there twice."""
    both = np.concatenate([anna, anna + np.array([0, 1, 0])], axis=1)
    choice = choose("a.c3d", [*MARKERS, *MARKERS], both, None)
    assert (choice.kept, choice.others) == (tuple(range(15)), ("2",))
    assert choose("a.c3d", [*MARKERS, *MARKERS], both, "2").kept == tuple(range(15, 30))
    few = choose("a.c3d", [*MARKERS, *MARKERS[:2]], both[:, :17], None)
    assert (few.others, len(few.kept)) == ((), 17)


def test_one_person_in_two_groups_or_twice_in_one_place_is_one(anna):
    """The upper and the lower body; the same points again; a point that only replaces another's later."""
    half = len(anna) // 2
    later = np.where(np.arange(len(anna))[:, None] < half, np.nan, anna[:, 0] + 1)
    early = np.where(np.arange(len(anna))[:, None] < half, anna[:, 0], np.nan)
    for points in (
        {**points_of(anna, Upper=MARKERS[:9]), **points_of(anna, Lower=MARKERS[9:])},
        {**points_of(anna, Anna=MARKERS), **points_of(anna, Copy=MARKERS)},
        {**points_of(anna, Anna=MARKERS), "Anna:head": early, "Hat:head": later},
    ):
        choice = choose("a.c3d", list(points), np.stack([*points.values()], axis=1), None)
        assert (choice.others, choice.notes, len(choice.kept)) == ((), (), len(points))


def test_the_note_reaches_motion_report_and_terminal(tmp_path, anna, run):
    path = save(tmp_path, points_of(anna, Ben=PELVIS, Anna=MARKERS))
    said = "the file shows 2 people"
    assert said in read_motion(path).notes[0]
    trial = read_trial(path)
    assert (trial.person, "Anna" in trial.notes[0]) == ("Anna", True)
    assert said in run("mocap", "info", path).out
    assert said in run("mocap", "convert", path, "--out", tmp_path / "a.bvh").err
    assert "3 points" in run("mocap", "info", path, "--person", "Ben").out
    assert said in run("report", path, "--out", tmp_path / "r.html").err
    assert said in (tmp_path / "r.html").read_text(encoding="utf-8")
