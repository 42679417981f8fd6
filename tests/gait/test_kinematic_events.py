"""Events from the paths of the feet: against walkers whose steps are known, planted feet, and force plates."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.body.kinematics import forward
from motionenv.body.skeleton import NODES
from motionenv.gait import feet_of
from motionenv.gait.kinematic_events import candidates, directions, kinematic_events, walks_backwards
from motionenv.gait.plate_events import plate_events
from motionenv.mocap import read
from motionenv.models.synthesis import synthesize
from tests.gait.walkers import moved, on_belt, standing, times, truth, walker

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
    assert walks_backwards(back)
    assert not walks_backwards(feet)
    last = (len(feet.pelvis) - 1) / feet.fps
    for side in ("left", "right"):
        landed = np.sort(last - times(truth().events, "toe_off", side))[1:-1]
        found = times(kinematic_events(back), "initial_contact", side)
        assert max(np.abs(found - t).min() for t in landed) < 0.04


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
    assert not [e for e in right if 2.1 < e.time < 3.5]


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
