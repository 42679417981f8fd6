"""Events against the force plates of the same file; names, numbers and outputs as other programs wrote them."""

import ezc3d
import numpy as np
import pytest

from motionenv.mocap.readers import c3d

#: Events in the order of the inventory of the collection.
EVENTS = {
    "PiG/PiG_Motion-FlatFoot-Full": 12, "PiG/PiG_Motion-FlatFoot-Hole": 10, "PiG/PiG_Motion-FlatFoot-One": 8,
    "PiG/PiG_Motion3_FF": 12, "PiG/PiG_Motion3_FF_N18": 12, "PiG/PiG_Motion3_noFF": 12,
    "c3d.org/sample04/sub_labels": 8, "c3d.org/sample09/PlugInC3D": 8, "others/FunctionalWalk": 11,
}  # fmt: skip


@pytest.mark.parametrize(("name", "count"), EVENTS.items())
def test_contacts_are_where_the_force_plates_say(mocap, name, count):
    """Each time that a plate is loaded from unloaded for long is within 0.12 s of an initial contact in the file."""
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / f"{name}.c3d")
    events = got.recording.events
    assert len(events) == count
    times = [event.time for event in events]
    assert times == sorted(times)
    assert times[0] >= 0
    assert times[-1] <= (len(got.positions) - 1) / got.fps
    contacts = np.array([event.time for event in events if event.kind == "initial_contact"])
    for plate in got.recording.plates:
        loaded = plate.force[:, 2] > 50
        begins = np.flatnonzero(loaded[1:] & ~loaded[:-1]) / plate.fps
        held = [b for b in begins if loaded[int(b * plate.fps) + 1 :][: int(0.3 * plate.fps)].all()]
        for begin in held:
            assert np.abs(contacts - begin).min() < 0.12, (name, begin)


def test_events_of_the_header_where_the_parameters_have_none(mocap):
    got = c3d.read(mocap / "btkdata" / "C3DSamples" / "c3d.org" / "sample02" / "sgi_real.c3d").recording
    told = [(round(event.time, 2), event.kind, event.side) for event in got.events]
    assert told == [
        (0.38, "initial_contact", "right"), (0.84, "initial_contact", "left"), (0.92, "toe_off", "right"),
        (1.4, "toe_off", "left"),
    ]  # fmt: skip


def test_the_subjects_numbers_and_outputs(mocap):
    folder = mocap / "btkdata" / "C3DSamples"
    got = c3d.read(folder / "PiG" / "PiG_Motion-FlatFoot-Full.c3d").recording
    assert (got.subject, got.first_frame, got.metres) == ("BELT_C", 148, 0.001)
    assert got.parameters["PROCESSING:LLEGLENGTH"] == 800
    assert got.parameters["PROCESSING:BODYMASS"] == 47.5
    assert not any(key.startswith(("POINT:", "ANALOG:")) for key in got.parameters)
    knee = got.outputs["LKneeAngles"]
    assert knee.shape == (315, 3)
    assert 40 < np.nanmax(knee[:, 0]) < 80  # degrees
    named = c3d.read(folder / "c3d.org" / "sample04" / "sub_labels.c3d")
    assert named.recording.subject == "Matt"
    assert {"LHipAngles", "RKneeMoment"} <= set(named.recording.outputs)
    assert not set(named.recording.outputs) & set(named.names)


@pytest.mark.parametrize(
    ("context", "label", "told"),
    [
        ("Left", "Foot Strike", ("initial_contact", "left")),
        ("RIGHT", "foot off", ("toe_off", "right")),
        ("", "RHS", ("initial_contact", "right")),
        ("General", "LTO", ("toe_off", "left")),
        ("Left", "Initial Contact", ("initial_contact", "left")),
        ("", "Left Heel Strike", ("initial_contact", "left")),
        ("", "Toe Off (right)", ("toe_off", "right")),
        ("Right", "HS", ("initial_contact", "right")),
        ("General", "Foot Strike", None),
        ("Left", "Event", None),
        ("", "STRT", None),
        ("", "RMS", None),
    ],
)
def test_events_by_many_names(tmp_path, context, label, told):
    """At frame 31 of a trial that begins with frame 11, and one outside of it, which is dropped."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A"]
    file.add_parameter("POINT", "UNITS", ["mm"])
    file["header"]["points"]["first_frame"] = 10
    file["data"]["points"] = np.ones((4, 1, 50))
    file.add_parameter("EVENT", "USED", [2])
    file.add_parameter("EVENT", "CONTEXTS", [context, context])
    file.add_parameter("EVENT", "LABELS", [label, label])
    file.add_parameter("EVENT", "TIMES", np.array([[0.0, 1.0], [0.3, 0.0]]))
    path = tmp_path / "events.c3d"
    file.write(str(path))
    got = c3d.read(path).recording
    assert got.first_frame == 11
    assert [(event.kind, event.side) for event in got.events] == ([told] if told else [])
    assert all(event.time == pytest.approx(0.2) for event in got.events)
