"""Force plates: who steps where, and when."""

import numpy as np
import pytest

from motionenv.gait import feet_of
from motionenv.gait.plate_events import plate_events
from motionenv.mocap import read
from motionenv.types import ForcePlate
from tests.gait.walkers import moved, times, walker

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
