"""Strides against walkers whose steps are known, and curves over them."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.gait import Events, Stride, feet_of, find_events, find_stretches, find_strides, normalised
from motionenv.gait.strides import mean_and_sd
from motionenv.mocap import read
from motionenv.types import Event
from tests.gait.walkers import PERIOD, STRIDE, WIDTH, around, moved, on_belt, truth, walker


def strides_of(feet, events=None):
    return find_strides(feet, events or truth(), find_stretches(feet))


def test_figures_of_a_known_walker():
    found = strides_of(walker())
    assert {s.side for s in found} == {"left", "right"}
    assert len(found) >= 8
    for stride in found:
        assert stride.seconds == pytest.approx(PERIOD)
        assert stride.toe_off - stride.start == pytest.approx(0.62 * PERIOD)
        assert stride.opposite_contact - stride.start == pytest.approx(0.5 * PERIOD)
        assert stride.opposite_off - stride.start == pytest.approx(0.12 * PERIOD)
        assert stride.length == pytest.approx(STRIDE, abs=1e-3)
        assert stride.step_length == pytest.approx(STRIDE / 2, abs=1e-3)
        assert stride.step_width == pytest.approx(WIDTH, abs=1e-6)


def test_events_seen_in_the_paths_give_the_same_lengths():
    feet = walker()
    found = strides_of(feet, find_events(feet))
    assert len(found) >= 8
    np.testing.assert_allclose([s.length for s in found], STRIDE, atol=0.01)
    np.testing.assert_allclose([s.step_length for s in found], STRIDE / 2, atol=0.02)


def test_unequal_steps_have_their_side():
    """The left foot 5 cm further ahead: left steps are 5 cm longer, right ones 5 cm shorter."""
    feet = walker()
    feet.heel["left"][:, 0] += 0.05
    found = strides_of(feet)
    for side, length in (("left", STRIDE / 2 + 0.05), ("right", STRIDE / 2 - 0.05)):
        np.testing.assert_allclose([s.step_length for s in found if s.side == side], length, atol=1e-3)


def test_a_turned_laboratory_and_slower_time():
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    plain, turned = strides_of(walker()), strides_of(moved(walker(), lambda p: p @ turn.T + [9, 1, 0]))
    for a, b in zip(plain, turned, strict=True):
        np.testing.assert_allclose([a.length, a.step_length, a.step_width], [b.length, b.step_length, b.step_width])
    slow = strides_of(walker(seconds=9.9, period=1.5 * PERIOD), truth(seconds=9.9, period=1.5 * PERIOD))
    assert [s.seconds for s in slow] == pytest.approx([1.5 * PERIOD] * len(slow))
    assert [s.length for s in slow] == pytest.approx([STRIDE] * len(slow), abs=1e-3)


def test_feet_that_cross_have_negative_width():
    assert [s.step_width for s in strides_of(walker(width=-0.05))] == pytest.approx([-0.05] * 9, abs=1e-6)


def test_walking_backwards_the_left_foot_is_still_on_the_left():
    back = moved(walker(), lambda p: p[::-1])
    found = strides_of(back, find_events(back))
    assert len(found) >= 8
    np.testing.assert_allclose([s.step_width for s in found], WIDTH, atol=1e-6)


def test_on_a_circle_the_outer_steps_are_longer():
    """Chords of a circle of 8 m: the strides of a foot at r ± w/2 span the angle STRIDE / r."""
    feet = moved(walker(), around(8.0))
    found = strides_of(feet)
    assert len(found) >= 8
    for side, r in (("left", 8 - WIDTH / 2), ("right", 8 + WIDTH / 2)):
        chord = 2 * r * np.sin(STRIDE / 8 / 2)
        np.testing.assert_allclose([s.length for s in found if s.side == side], chord, atol=2e-3)


@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_lengths_on_a_treadmill_are_over_its_belt(heading):
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    feet = moved(on_belt(walker(), STRIDE / PERIOD), lambda p: p @ turn.T)
    for events in (truth(), find_events(feet)):
        found = strides_of(feet, events)
        assert len(found) >= 8
        np.testing.assert_allclose([s.length for s in found], STRIDE, atol=0.02)
        np.testing.assert_allclose([s.length / s.seconds for s in found], STRIDE / PERIOD, rtol=0.01)
        np.testing.assert_allclose([s.step_length for s in found], STRIDE / 2, atol=0.02)
        np.testing.assert_allclose([s.step_width for s in found], WIDTH, atol=1e-3)
        assert {(s.kind, s.turn) for s in found} == {("steady", 0.0)}


def test_a_belt_that_speeds_up():
    """From 0.8 of its speed to 1.2: each stride's own speed is that of the belt then."""
    feet = walker(13.2)
    clock = np.arange(len(feet.pelvis)) / feet.fps
    warped = 0.8 * clock + 0.2 * clock**2 / 13.2  # the walker's own time
    at = np.interp(warped, clock, np.arange(len(clock)))
    sped = moved(feet, lambda p: np.stack([np.interp(at, np.arange(len(p)), column) for column in p.T], -1))
    events = [replace(e, time=float(np.interp(e.time, warped, clock))) for e in truth(13.2).events]
    belted = moved(sped, lambda p: p - (STRIDE / PERIOD * warped)[:, None] * [1, 0, 0])
    found = strides_of(belted, Events(tuple(e for e in events if e.time < 13.1), {}))
    assert len(found) > 15
    np.testing.assert_allclose([s.length for s in found], STRIDE, rtol=0.02)


def test_strides_in_turns_and_starts_say_so():
    feet = moved(walker(), around(1.2))
    found = strides_of(feet)
    assert len(found) >= 8
    assert {s.kind for s in found} == {"turning"}
    assert [s.turn for s in found] == pytest.approx([np.degrees(STRIDE / 1.2)] * len(found), rel=0.15)
    straight = strides_of(walker())
    assert {s.kind for s in straight} == {"steady"}
    assert [s.turn for s in straight] == pytest.approx([0.0] * len(straight), abs=0.5)


def test_two_strides_whose_contact_between_was_missed_are_none():
    events = [e for e in truth().events if not (e.kind == "initial_contact" and e.side == "left" and 2 < e.time < 3.2)]
    found = strides_of(walker(), Events(tuple(events), {}))
    assert max(s.seconds for s in found) < 1.2 * PERIOD
    assert len(found) == len(strides_of(walker())) - 2


def test_one_leg_has_strides_but_no_steps():
    found = strides_of(walker(sides=("left",)), truth(sides=("left",)))
    assert {s.side for s in found} == {"left"}
    assert [s.length for s in found] == pytest.approx([STRIDE] * len(found), abs=1e-3)
    assert np.isnan([[s.step_length, s.opposite_contact, s.opposite_off] for s in found]).all()


def test_running_has_no_double_support():
    found = strides_of(walker(stance=0.36), truth(stance=0.36))
    assert found
    assert np.isnan([s.opposite_off for s in found]).all()
    assert [s.step_length for s in found] == pytest.approx([STRIDE / 2] * len(found), abs=1e-3)
    assert [s.toe_off - s.start for s in found] == pytest.approx([0.36 * PERIOD] * len(found))


def test_events_that_contradict_each_other_tell_nothing():
    """The other foot lands after this one has left, but leaves before it lands."""
    feet = walker()
    marks = [(1.1, "initial_contact", "right"), (2.2, "initial_contact", "right"), (1.5, "toe_off", "right"),
             (1.3, "toe_off", "left"), (1.9, "initial_contact", "left")]  # fmt: skip
    stride = strides_of(feet, Events(tuple(Event(*mark) for mark in marks), {}))[0]
    assert stride.length == pytest.approx(STRIDE, abs=1e-3)
    assert np.isnan([stride.toe_off, stride.opposite_contact, stride.opposite_off, stride.step_length]).all()


def test_strides_outside_steady_stretches_and_implausible_ones_are_left_out():
    feet = walker()
    feet.pelvis[300:360] = np.nan
    assert not [s for s in strides_of(feet) if s.start < 3.6 and s.end > 3.0]
    doubled = Events((Event(1.1, "initial_contact", "right"), Event(1.3, "initial_contact", "right")), {})
    assert strides_of(walker(), doubled) == ()


def test_a_real_walk_measured_by_hand(mocap):
    """Heel markers at the file's own contacts, differenced by hand."""
    markers = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    feet = feet_of(markers)
    found = [s for s in strides_of(feet, find_events(feet, markers.recording)) if s.side == "left"]
    heel = markers.positions[:, next(i for i, n in enumerate(markers.names) if n.endswith("LHEE")), :2]
    marked = [e.time for e in markers.recording.events if (e.kind, e.side) == ("initial_contact", "left")]
    for stride in found:
        assert min(abs(stride.start - t) for t in marked) < 1e-9
        a, b = (heel[round(t * markers.fps)] for t in (stride.start, stride.end))
        assert stride.length == pytest.approx(np.hypot(*(b - a)), abs=1e-3)
        assert 0.5 < (stride.toe_off - stride.start) / stride.seconds < 0.7


def test_lines_pass_exactly_and_ends_are_the_contacts():
    values = np.stack([np.arange(100.0), -2 * np.arange(100.0)], -1)
    cut = normalised(values, 50.0, [Stride("left", 0.25, 1.35)])
    frames = np.linspace(12.5, 67.5, 101)
    np.testing.assert_allclose(cut[0], np.stack([frames, -2 * frames], -1))


def test_gaps_and_what_lies_outside_are_unknown():
    values = np.arange(100.0)[:, None]
    values[40] = np.nan
    cut = normalised(values, 100.0, [Stride("left", 0.2, 0.7), Stride("left", 0.9, 1.2), Stride("left", 0.5, 0.99)])
    frames = np.linspace(20, 70, 101)
    np.testing.assert_array_equal(np.isnan(cut[0, :, 0]), (frames > 39) & (frames < 41))
    np.testing.assert_array_equal(np.isfinite(cut[1, :, 0]), np.linspace(90, 120, 101) <= 99)
    assert cut[2, -1, 0] == 99
    assert normalised(values, 100.0, []).shape == (0, 101, 1)
    assert normalised(values[:1], 100.0, [Stride("left", 0.0, 0.5)])[0, 0, 0] == 0


def test_a_stride_with_a_contact_within_begins_there():
    values = np.arange(100.0)[:, None]
    cut = normalised(values, 100.0, [Stride("left", 0.2, 0.7, contact=0.35)])[0, :, 0]
    np.testing.assert_allclose(cut[:71], np.linspace(35, 70, 71))
    np.testing.assert_allclose(cut[71:], np.linspace(20, 35, 31)[1:])


def test_mean_and_sd_know_what_is_missing():
    curves = np.random.default_rng(0).standard_normal((5, 101))
    curves[:4, 0], curves[:, 1] = np.nan, np.nan
    mean, sd = mean_and_sd(curves)
    np.testing.assert_allclose(mean[2:], curves[:, 2:].mean(0))
    np.testing.assert_allclose(sd[2:], curves[:, 2:].std(0, ddof=1))
    assert (mean[0], np.isnan(sd[0]), np.isnan(mean[1])) == (curves[4, 0], True, True)
