"""Events of a capture: from its file, its force plates and the paths of its feet."""

import re
from dataclasses import replace

import numpy as np
import pytest

from motionenv.body.kinematics import forward
from motionenv.body.skeleton import NODES
from motionenv.errors import MotionError
from motionenv.gait import feet_of, find_events
from motionenv.gait.events import backward_share, candidates, directions, kinematic_events, plate_events
from motionenv.mocap import read
from motionenv.models.synthesis import synthesize
from motionenv.types import ForcePlate, Recording
from tests.gait.walkers import moved, on_belt, standing, times, truth, walker


def test_without_a_recording_events_come_from_the_paths():
    found = find_events(walker())
    assert found.events == kinematic_events(walker())
    assert found.sources == {"kinematics": len(found.events)}
    assert list(found.times("toe_off", "left")) == sorted(found.times("toe_off", "left"))


def test_marked_events_of_part_of_the_capture_are_completed():
    """No event twice: marks that are up to 0.2 s from what the paths show stand for it."""
    feet, marked = walker(), [e for e in truth().events if e.time < 3]
    shifted = tuple(replace(e, time=e.time + 0.15 * (-1) ** i) for i, e in enumerate(marked[1:]))
    found = find_events(feet, Recording(events=shifted))
    assert set(shifted) <= set(found.events)
    for kind in ("initial_contact", "toe_off"):
        for side in ("left", "right"):
            assert np.diff(found.times(kind, side)).min() > 0.7
    assert found.sources == {"file": len(shifted), "kinematics": len(found.events) - len(shifted)}
    assert [e.time for e in found.events] == sorted(e.time for e in found.events)


def test_marks_with_exchanged_sides_are_left_out_and_told():
    exchanged = tuple(replace(e, side={"left": "right", "right": "left"}[e.side]) for e in truth().events)
    found = find_events(walker(), Recording(events=exchanged))
    assert found.sources.keys() == {"kinematics"}
    assert "wrong sides" in found.notes[0]
    assert find_events(walker(), Recording(events=exchanged), "file").events == exchanged
    assert find_events(walker(), Recording(events=truth().events)).notes == ()


@pytest.mark.parametrize("late", [-0.2, -0.1, 0.1, 0.2])
def test_marks_of_another_clock_are_left_out_and_told(late):
    """All are as early or late; marks that only disagree about contacts, as of who lands on the toes, are believed."""
    marks = [replace(event, time=event.time + late) for event in truth().events[2:-2]]
    found = find_events(walker(), Recording(events=marks))
    assert found.sources == {"kinematics": len(kinematic_events(walker()))}
    (note,) = found.notes
    said = re.fullmatch(r"the file's events are (.*) s from what the feet do, so they are left out", note)
    assert float(said[1]) == pytest.approx(late, abs=0.03)
    toes = [replace(e, time=e.time + (late if e.kind == "initial_contact" else 0.0)) for e in truth().events[2:-2]]
    assert find_events(walker(), Recording(events=toes)).sources["file"] == len(toes)


def test_methods_that_find_nothing_say_so():
    for method in ("file", "plates"):
        with pytest.raises(MotionError, match="no events from " + method):
            find_events(walker(), None, method)
    with pytest.raises(MotionError, match="auto, file, plates, kinematics"):
        find_events(walker(), None, "zeni")
    assert find_events(standing()).events == ()


def test_each_method_of_a_real_file(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    feet, recording = feet_of(markers), markers.recording
    assert find_events(feet, recording, "file").events == tuple(sorted(recording.events, key=lambda e: e.time))
    assert find_events(feet, recording).sources["file"] == len(recording.events)
    assert find_events(feet, recording, "plates").sources == {"plates": 6}
    without = replace(recording, events=())
    assert find_events(feet, without).sources["plates"] == 6


# The right foot of `walker` lands at x = 1.4 at 1.1 s and leaves with the toe at 1.6 at 1.782 s.
ON, OFF = 1.1, 1.782
CORNERS = np.array([[1.3, 0.1, 0], [1.7, 0.1, 0], [1.7, -0.3, 0], [1.3, -0.3, 0]])


def plate(corners=CORNERS, on=ON, off=OFF, newtons=700.0, fps=1000.0, x=(1.4, 1.6)) -> ForcePlate:
    t = np.arange(round(6.6 * fps)) / fps
    loaded = (t >= on) & (t < off)
    force = np.stack([0 * t, 0 * t, np.where(loaded, newtons, 3.0)], -1)
    centre = np.stack([np.interp(t, [on, off], x), 0 * t - 0.06, 0 * t], -1)
    return ForcePlate(corners, force, np.where(loaded[:, None], centre, np.nan), fps)


def test_a_step_on_a_plate():
    contact, off = plate_events([plate()], walker())
    assert (contact.kind, contact.side, contact.time) == ("initial_contact", "right", pytest.approx(ON, abs=1e-3))
    assert (off.kind, off.side, off.time) == ("toe_off", "right", pytest.approx(OFF, abs=1e-3))


@pytest.mark.parametrize("roll", range(4))
@pytest.mark.parametrize("turn", [False, True])
def test_corners_may_come_in_any_order(roll, turn):
    corners = np.roll(CORNERS[::-1] if turn else CORNERS, roll, axis=0)
    assert len(plate_events([plate(corners)], walker())) == 2


def test_a_turned_plate():
    """A plate of 40 × 50 cm at 30 degrees: its bounding box holds the heel, the plate doesn't."""
    turn = np.array([[np.cos(0.52), -np.sin(0.52), 0], [np.sin(0.52), np.cos(0.52), 0], [0, 0, 1]])
    change = lambda p: p @ turn.T + [0.4, 2.0, 0]
    one = plate()
    turned = ForcePlate(change(one.corners), one.force, change(one.centre), one.fps)
    assert len(plate_events([turned], moved(walker(), change))) == 2
    aside = CORNERS @ turn.T + (CORNERS.mean(0) - CORNERS.mean(0) @ turn.T) + [0.06, -0.16, 0]
    assert [e.kind for e in plate_events([plate(aside)], walker())] == ["toe_off"]


def test_who_lands_beside_the_plate_tells_the_toe_off_only():
    short = CORNERS + np.array([0.2, 0, 0])
    assert [e.kind for e in plate_events([plate(short)], walker())] == ["toe_off"]


def test_who_rolls_over_the_edge_tells_the_contact_only():
    """The toe marker, on the metatarsal heads, leaves from within the plate, the tip of the shoe from beyond it."""
    ends_early = np.where(CORNERS == 1.7, 1.6, CORNERS)
    assert [e.kind for e in plate_events([plate(ends_early)], walker())] == ["initial_contact"]


def test_sprinting_over_plates(mocap):
    """Stances of 0.12 s; the file's events were marked from these plates."""
    markers = read(mocap / "nimble/c3d/JA1Gait35.c3d")
    found = plate_events(markers.recording.plates, feet_of(markers))
    assert len(found) >= 7
    for event in found:
        assert np.abs(times(markers.recording.events, event.kind, event.side) - event.time).min() < 0.01


def test_touches_standing_and_forces_without_a_foot_are_no_steps():
    assert plate_events([plate(newtons=100)], walker()) == ()
    assert plate_events([plate(off=ON + 0.1)], walker()) == ()
    assert plate_events([plate(off=ON + 3)], walker()) == ()
    assert plate_events([plate(CORNERS + np.array([9.0, 0, 0]), x=(10.4, 10.6))], walker()) == ()
    assert plate_events([], walker()) == ()


def test_plates_and_marked_events_agree(mocap):
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    found = plate_events(markers.recording.plates, feet_of(markers))
    assert len(found) == 6
    for event in found:
        assert np.abs(times(markers.recording.events, event.kind, event.side) - event.time).min() < 0.03


KINDS = [(kind, side) for kind in ("initial_contact", "toe_off") for side in ("left", "right")]


def apart(found, wanted, margin=0.3, seconds=6.6) -> float:
    """Largest distance [s] between events that must pair one to one, `margin` away from the capture's ends."""
    worst = 0.0
    for kind, side in KINDS:
        a, b = times(found, kind, side), times(wanted, kind, side)
        a, b = (x[(x > margin) & (x < seconds - margin)] for x in (a, b))
        assert len(a) == len(b) > 0, (kind, side, a, b)
        worst = max(worst, float(np.abs(a - b).max()))
    return worst


@pytest.mark.parametrize("fps", [50.0, 100.0, 250.0])
def test_events_of_a_known_walker(fps):
    assert apart(kinematic_events(walker(fps=fps)), truth().events) < 0.03


def test_a_capture_that_begins_on_the_ground_has_no_contact_there():
    """A foot that stands when a capture begins peaks there, too: 5 % of the crops say so still, by up to 0.1 s."""
    crops = wrong = 0
    for seed in range(3):
        walk = synthesize("walk/fpca", 8, 100, seed=seed)
        whole = kinematic_events(feet_of(walk))
        for start in range(60, 200, 7):
            found = kinematic_events(feet_of(replace(walk, poses=walk.poses[start : start + 500])))
            errors = [
                min(abs(event.time + start / 100 - other.time) for other in whole
                    if (other.kind, other.side) == (event.kind, event.side)) for event in found
            ]  # fmt: skip
            assert max(errors) < 0.15
            crops, wrong = crops + 1, wrong + (max(errors) > 0.03)
    assert wrong / crops < 0.1  # 0.22 before


def test_the_candidates_are_too_early():
    """As Zeni's contacts are for real walkers, which is why they are moved."""
    feet = walker()
    contacts = candidates(feet, feet.heel["right"], directions(feet)) / feet.fps
    early = times(truth().events, "initial_contact", "right")[1:-1, None] - contacts
    assert 0.02 < np.abs(early).min(1).max() < 0.12


def test_contacts_of_feet_that_slide_follow_the_candidates():
    """Lifted feet don't rest: these slide by 0.7 m/s, so nothing shows where they stop."""
    sliding = moved(walker(), lambda path: path + 0.7 * np.arange(len(path))[:, None] / 100 * [1, 0, 0])
    assert times(kinematic_events(sliding), "initial_contact", "right").size == 0
    for feet in (sliding, walker()):
        assert apart(kinematic_events(feet, after=0.04), truth().events) < 0.03


@pytest.mark.parametrize(("stance", "stride", "period"), [(0.36, 2.4, 0.7), (0.7, 0.9, 1.4)])
def test_runners_and_slow_walkers(stance, stride, period):
    found = kinematic_events(walker(stance=stance, stride=stride, period=period))
    assert apart(found, truth(stance=stance, period=period).events) < 0.035


def test_a_treadmill_changes_nothing_but_the_belt():
    plain = walker()
    belted = on_belt(plain, 1.4 / 1.1)
    assert apart(kinematic_events(belted), kinematic_events(plain)) < 0.012
    np.testing.assert_allclose(directions(belted)[50:-50], np.broadcast_to([1.0, 0], (560, 2)), atol=1e-6)


def test_turning_and_moving_the_laboratory_changes_nothing():
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    plain, turned = walker(), moved(walker(), lambda p: p @ turn.T + [4, -7, 0.02])
    for a, b in zip(kinematic_events(plain), kinematic_events(turned), strict=True):
        assert (a.kind, a.side) == (b.kind, b.side)
        assert a.time == pytest.approx(b.time, abs=1e-6)


def test_a_mirror_exchanges_the_sides():
    feet = walker()
    mirror = moved(feet, lambda p: p * [1, -1, 1])
    exchanged = replace(
        mirror,
        heel={"left": mirror.heel["right"], "right": mirror.heel["left"]},
        toe={"left": mirror.toe["right"], "right": mirror.toe["left"]},
    )
    for kind in ("initial_contact", "toe_off"):
        ours, theirs = kinematic_events(feet), kinematic_events(exchanged)
        np.testing.assert_allclose(times(ours, kind, "left"), times(theirs, kind, "right"), atol=1e-9)


def test_who_walks_backwards_lands_on_the_toes():
    """A film of a walk, run backwards: contact where the toe left the ground, departure where the heel met it."""
    feet = walker()
    back = moved(feet, lambda p: p[::-1])
    assert backward_share(back) > 0.5
    assert backward_share(feet) < 0.5
    last = (len(feet.pelvis) - 1) / feet.fps
    for side in ("left", "right"):
        landed = np.sort(last - times(truth().events, "toe_off", side))[1:-1]
        found = times(kinematic_events(back), "initial_contact", side)
        assert max(np.abs(found - t).min() for t in landed) < 0.04


@pytest.mark.parametrize(
    "clip", ["dataset-1_run_active_001", "dataset-1_walk_normal_001", "dataset-1_walk-back_active_001"]
)
def test_runners_who_lift_their_feet_do_not_walk_backwards(mocap, clip):
    """In swing, a runner's toe is behind the ankle. The clip's name says where it goes."""
    folder = mocap / "bandai_namco/Bandai-Namco-Research-Motiondataset-1/data"
    assert (backward_share(feet_of(read(folder / f"{clip}.bvh"))) > 0.5) == ("back" in clip)


def test_who_stands_takes_no_steps():
    assert kinematic_events(standing()) == ()
    assert (directions(standing()) == 0).all()


@pytest.mark.parametrize("frames", [1, 2, 3, 9, 12])
def test_captures_too_short_for_a_step(frames):
    short = moved(walker(), lambda p: p[:frames])
    assert all(0 <= event.time <= frames / short.fps for event in kinematic_events(short))


def test_a_contact_after_the_end_is_not_guessed():
    """The right foot lands at 2.2 s; cut before, there is none, and toes on the ground at the end aren't leaving it."""
    cut = kinematic_events(moved(walker(), lambda p: p[:213]))
    assert times(cut, "initial_contact", "right").max() < 1.3
    assert times(cut, "toe_off", "left").max() < 1.4


def test_events_in_gaps_are_not_made_up():
    feet = walker()
    for path in (feet.heel["right"], feet.toe["right"]):
        path[200:360] = np.nan
    right = [e for e in kinematic_events(feet) if e.side == "right"]
    assert right
    assert not [e for e in right if 1.9 < e.time < 3.7]


@pytest.mark.parametrize("first", range(90, 150, 6))
def test_a_marker_that_drops_out_makes_no_contact(first):
    """Wherever the heel is lost, on its way or on the ground, what is found has been seen in the whole path."""
    whole, feet = walker(), walker()
    feet.heel["right"][first : first + 110] = np.nan
    kept = times(kinematic_events(whole), "initial_contact", "right")
    found = times(kinematic_events(feet), "initial_contact", "right")
    assert len(found) >= 2
    assert max(np.abs(kept - t).min() for t in found) < 0.02


def test_some_lost_frames_change_nothing():
    feet = walker()
    for first in range(7, 600, 23):
        feet.heel["right"][first : first + 3] = np.nan
    assert apart(kinematic_events(feet), kinematic_events(walker())) < 0.03


def test_synthesised_walkers_have_their_foot_planted_between_contact_and_toe_off():
    motion = synthesize("walk/fpca", seconds=6, fps=100, seed=3)
    nodes, _ = forward(motion.poses, motion.skeleton)
    events = kinematic_events(feet_of(motion))
    for side in ("left", "right"):
        ankle = nodes[:, NODES.index(f"{side}_ankle")]
        speed = np.linalg.norm(np.gradient(ankle[:, :2], axis=0), axis=-1) * motion.fps
        contacts, offs = (times(events, kind, side) for kind in ("initial_contact", "toe_off"))
        assert len(contacts) >= 4
        for t in contacts:
            off = offs[offs > t]
            if len(off):
                planted = slice(round((t + 0.1) * 100), round((0.5 * t + 0.5 * off[0]) * 100))
                assert speed[planted].max() < 0.5
                assert 0.45 < off[0] - t < 0.9


PLATES = ["PiG/PiG_Motion-FlatFoot-Full", "PiG/PiG_Motion3_FF", "others/FunctionalWalk"]


@pytest.mark.parametrize("walk", PLATES)
def test_events_are_those_of_the_force_plates(mocap, walk):
    markers = read(mocap / f"btkdata/C3DSamples/{walk}.c3d")
    feet = feet_of(markers)
    ours = kinematic_events(feet)
    for event in plate_events(markers.recording.plates, feet):
        assert np.abs(times(ours, event.kind, event.side) - event.time).min() < 0.0125
