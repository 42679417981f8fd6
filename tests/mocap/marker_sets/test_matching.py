"""Marker sets are recognised in real files, and under the names that laboratories make of them."""

import numpy as np
import pytest

from motionenv.body import NODES
from motionenv.errors import MotionError
from motionenv.mocap import read
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks, marker_set, marker_sets, recognise
from motionenv.types import Markers

RIGS = ("cmu", "cmu-bvh", "mixamo", "bandai-namco", "xsens", "markers")
PIG = [n for w in marker_set("plug-in-gait").points.values() for n in w[0]]


def test_every_set_says_where_its_names_come_from():
    sets = marker_sets()
    assert len({known.name for known in sets}) == len(sets) == 19
    assert all(known.title and known.source for known in sets)


@pytest.mark.parametrize("known", marker_sets(), ids=lambda known: known.name)
def test_a_file_with_the_names_of_a_set_is_recognised(known):
    names = sorted({name for ways in known.points.values() for name in ways[0]})
    found, points = recognise(names)
    assert found.name == known.name
    assert set(points) == set(known.points)


@pytest.mark.parametrize("name", RIGS)
def test_rigs_have_every_node_of_the_body(name):
    assert set(NODES) <= set(marker_set(name).points)


@pytest.mark.parametrize("known", marker_sets(), ids=lambda known: known.name)
def test_left_and_right_are_named_alike(known):
    for landmark, ways in known.points.items():
        if landmark.startswith("left_"):
            other = known.points[landmark.replace("left_", "right_")]
            assert [sorted(way.values()) for way in ways] == [sorted(way.values()) for way in other]
            assert all(a != b for a, b in zip(ways, other, strict=True))


@pytest.mark.parametrize(
    ("file", "options", "expected", "least"),
    [
        ("cmu_asfamc/02/02_01.amc", {"fps": 120}, "cmu", 16),
        ("cmu_bvh_misc/02_01.bvh", {"unit": "cmu"}, "cmu-bvh", 16),
        ("bandai_namco/*/data/dataset-1_walk_normal_001.bvh", {"unit": "cm"}, "bandai-namco", 16),
        ("cmu_c3d/02_01.c3d", {}, "cmu-markers", 30),
        ("btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d", {}, "plug-in-gait", 16),
        ("btkdata/TRCSamples/Gait.trc", {}, "helen-hayes", 30),
        ("nimble/grf/Subject4/MarkerData/walking1.trc", {}, "opensim", 20),
        ("nimble/osim/Tiziana2019/markers.trc", {}, "anatomical", 20),
        ("bmc/data/walk1.trc", {}, "anatomical", 20),
        ("pose2sim/from_history/Balancing_for_IK.trc", {}, "openpose", 18),
    ],
)
def test_real_files_are_recognised(mocap, file, options, expected, least):
    found = find_landmarks(read(next(iter(sorted(mocap.glob(file)))), **options))
    assert found.marker_set == expected
    assert len(found.positions) >= least


@pytest.mark.parametrize(
    "renamed", ["Matt:{}", "matt_{}", "{}_v2", "Subject01{}", "{:.1}.{}", "  {} "], ids=lambda pattern: pattern
)
def test_prefixes_suffixes_and_case_do_not_matter(renamed):
    names = [renamed.format(n[0], n[1:]) if renamed.count("{") > 1 else renamed.format(n).swapcase() for n in PIG]
    found, points = recognise(names)
    assert found.name == "plug-in-gait"
    assert len(points) == len(marker_set("plug-in-gait").points)


@pytest.mark.parametrize("renamed", ["{1}_{0}", "{1} {2}", "{2}{1}", "{2}_{1}", "{1}-{0}"], ids=lambda pattern: pattern)
def test_the_side_may_stand_at_either_end(renamed):
    word = {"L": "Left", "R": "Right"}
    names = [renamed.format(n[0], n[1:], word[n[0]]) if n[0] in word else n for n in PIG]
    found, points = recognise(names)
    assert found.name == "plug-in-gait"
    assert len(points) == len(marker_set("plug-in-gait").points)


def test_a_map_places_landmarks_by_weights():
    positions = np.arange(12.0).reshape(2, 2, 3)
    markers = Markers(("Anna:KneeL in", "Anna:KneeL out"), positions, 50)
    chosen = MarkerMap.parse('[points]\nleft_knee = { "kneel_in" = 0.25, "kneel_out" = 0.75 }')
    found = find_landmarks(markers, chosen)
    np.testing.assert_allclose(found.positions["left_knee"], 0.25 * positions[:, 0] + 0.75 * positions[:, 1])
    assert found.points["left_knee"] == {"Anna:KneeL in": 0.25, "Anna:KneeL out": 0.75}


def test_points_that_no_frame_shows_are_no_landmarks():
    positions = np.ones((4, 2, 3))
    positions[:, 1] = np.nan
    assert set(find_landmarks(Markers(("LASI", "RASI"), positions, 50)).positions) == {"left_asis"}


def test_unknown_sets_and_maps_of_other_files_are_refused():
    markers = Markers(("A", "B"), np.zeros((3, 2, 3)), 50)
    with pytest.raises(MotionError, match=r"the marker set must be one of anatomical, .*xsens, got 'vicon'"):
        find_landmarks(markers, "vicon")
    with pytest.raises(MotionError, match=r"no point of the marker map 'plug-in-gait' is in the file, which has A, B"):
        find_landmarks(markers, "plug-in-gait")


def test_exchanged_names_of_left_and_right_are_exchanged_back(mocap):
    """A real file of that kind, and a good one made into one."""
    assert "exchange" in find_landmarks(read(mocap / "bmc/data/walk1.trc")).notes[0]
    good = read(mocap / "btkdata/C3DSamples/PiG/PiG_Motion3_FF.c3d")
    right = find_landmarks(good)
    assert right.notes == ()
    swap = {"L": "R", "R": "L"}
    wrong = Markers([swap.get(n[0], n[0]) + n[1:] for n in good.names], good.positions, good.fps)
    found = find_landmarks(wrong)
    assert "exchange" in found.notes[0]
    for landmark, positions in right.positions.items():
        np.testing.assert_array_equal(found.positions[landmark], positions)
