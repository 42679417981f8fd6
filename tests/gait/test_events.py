"""Events of a capture from its file, its plates and its paths, in this order."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.gait import feet_of, find_events
from motionenv.gait.kinematic_events import kinematic_events
from motionenv.mocap import read
from motionenv.types import Recording
from tests.gait.walkers import standing, truth, walker


def test_without_a_recording_events_come_from_the_paths():
    found = find_events(walker())
    assert found.events == kinematic_events(walker())
    assert found.sources == {"kinematics": len(found.events)}
    assert list(found.times("toe_off", "left")) == sorted(found.times("toe_off", "left"))


def test_marked_events_of_part_of_the_capture_are_completed():
    """No event twice: marks that are up to 0.2 s from what the paths show stand for it."""
    feet, marked = walker(), [e for e in truth().events if e.time < 3]
    shifted = tuple(replace(e, time=e.time + 0.15) for e in marked)
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
