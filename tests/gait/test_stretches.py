"""What a walker does when."""

from dataclasses import replace

import numpy as np
import pytest

from motionenv.gait import feet_of, find_events, find_stretches, find_strides
from motionenv.gait.stretches import belt, on_treadmill
from motionenv.mocap import read
from tests.gait.walkers import around, moved, on_belt, standing, walker


def tiles(stretches, feet) -> bool:
    """Whether stretches cover a capture without gap or overlap."""
    edges = [0.0, *(s.end for s in stretches)]
    return edges[:-1] == [s.start for s in stretches] and edges[-1] == len(feet.pelvis) / feet.fps


@pytest.mark.parametrize("fps", [30.0, 100.0, 300.0])
@pytest.mark.parametrize("seconds", [1.2, 6.6])
def test_a_straight_walk_is_one_steady_stretch(fps, seconds):
    feet = walker(seconds, fps)
    found = find_stretches(feet)
    assert [s.kind for s in found] == ["steady"]
    assert tiles(found, feet)
    assert not on_treadmill(feet)


def test_standing_is_standing():
    assert [s.kind for s in find_stretches(standing())] == ["standing"]
    assert not on_treadmill(standing())


def test_a_treadmill_is_steady_throughout():
    feet = on_belt(walker(), 1.4 / 1.1)
    assert on_treadmill(feet)
    assert [s.kind for s in find_stretches(feet)] == ["steady"]


@pytest.mark.parametrize("drift", [-0.4, -0.1, 0.1, 0.3])
def test_who_drifts_on_a_treadmill_is_on_it(drift):
    """Strides are as long as on a floor, whatever the pelvis does: the belt carries the foot that stands."""
    feet = on_belt(walker(), 1.4 / 1.1 - drift)
    assert on_treadmill(feet)
    strides = find_strides(feet, find_events(feet), find_stretches(feet))
    assert {s.kind for s in strides} == {"steady"}
    assert [s.length for s in strides] == pytest.approx([1.4] * len(strides), rel=0.03)


def test_a_start_from_standing_is_cut_out():
    feet = walker(9.0)
    wait = moved(feet, lambda p: np.concatenate([np.repeat(p[:1], 300, 0), p[:600]]))
    found = find_stretches(wait)
    assert found[0].kind == "standing"
    assert found[0].end == pytest.approx(3.0, abs=0.4)
    assert found[-1].kind == "steady"
    assert tiles(found, wait)


def test_who_stops_soon_is_not_steady_while_he_stops():
    """At 1.3 m/s for 6 s, then to rest within 0.6 s: less than half a second lies between the two speeds."""
    t = np.arange(900) / 100
    speed = 1.3 * np.clip((6.6 - t) / 0.6, 0, 1)
    path = np.stack([np.cumsum(speed) / 100, 0 * t, 0 * t + 0.9], -1)
    feet = replace(walker(9.0), pelvis=path, heel={"left": path}, toe={"left": path})
    found = find_stretches(feet)
    assert [s.kind for s in found] == ["steady", "standing"]
    assert found[0].end < 6.4


def test_strides_of_a_real_walker_who_stops(mocap):
    """He turns and halts: the closing steps of half a stride are none of a steady walk."""
    feet = feet_of(read(mocap / "nimble/grf/CarmagoTest/MarkerData/levelground_ccw_fast_01_01.trc"))
    lengths = [s.length for s in find_strides(feet, find_events(feet), find_stretches(feet)) if s.kind == "steady"]
    assert len(lengths) >= 6
    assert min(lengths) > 0.8 * np.median(lengths)


def test_a_half_turn_between_two_straight_walks_is_turning():
    ahead = walker(4.0)
    radius = 0.3
    pelvis = ahead.pelvis[:, :2]
    arc = np.linspace(0, np.pi, 150)[1:, None]
    turn = pelvis[-1] + radius * np.concatenate([np.sin(arc), 1 - np.cos(arc)], 1)
    back = turn[-1] + (pelvis[0] - pelvis) * [1, 1]
    path = np.concatenate([pelvis, turn, back])
    points = np.concatenate([path, np.full((len(path), 1), 0.9)], 1)
    feet = replace(ahead, pelvis=points, heel={"left": points}, toe={"left": points})
    found = find_stretches(feet)
    assert found[0].kind == found[-1].kind == "steady"
    assert "turning" in [s.kind for s in found]
    middle = [s for s in found if s.kind != "steady"]
    assert middle[0].start < 4.75 < middle[-1].end
    assert tiles(found, feet)


def test_a_slow_turn_is_one_stretch():
    """80 degrees in 6.6 s."""
    feet = moved(walker(), around(6.0))
    found = find_stretches(feet)
    assert [s.kind for s in found] == ["steady"]
    assert tiles(found, feet)


def test_the_belt_moves_the_foot_that_stands():
    assert belt(walker()) is None
    np.testing.assert_allclose(belt(on_belt(walker(), 1.4 / 1.1)), [-1.4 / 1.1, 0], atol=0.02)


def test_who_kicks_on_the_spot_is_on_no_treadmill():
    feet = standing(4.0)
    swing = 0.4 * np.sin(np.arange(400) / 100 * 2 * np.pi) * (np.arange(400) > 100)
    for path in (feet.heel["left"], feet.toe["left"]):
        path[:, 0] += swing
    assert not on_treadmill(feet)


def test_unseen_pelvises():
    feet = walker()
    feet.pelvis[200:300] = np.nan
    assert [(s.kind, s.start, s.end) for s in find_stretches(feet)][1] == ("unseen", 2.0, 3.0)
    feet = walker()
    feet.pelvis[::2] = np.nan
    assert [s.kind for s in find_stretches(feet)] == ["steady"]
    feet.pelvis[:] = np.nan
    assert [s.kind for s in find_stretches(feet)] == ["unseen"]
    assert not on_treadmill(feet)


@pytest.mark.parametrize("frames", [1, 2, 3, 9, 12])
def test_very_short_captures(frames):
    feet = moved(walker(), lambda p: p[:frames])
    assert tiles(find_stretches(feet), feet)


def test_turning_the_laboratory_changes_nothing():
    turn = np.array([[-1.0, 0, 0], [0, -1, 0], [0, 0, 1]])
    feet = moved(walker(), around(8.0))
    assert find_stretches(moved(feet, lambda p: p @ turn.T + [3, 3, 0])) == find_stretches(feet)
