"""The body's nodes from skin markers: a body whose markers were put on by hand, and CMU's walkers."""

import numpy as np
import pytest

from motionenv.body import NODES
from motionenv.errors import GapError
from motionenv.mocap import read
from motionenv.mocap.body_nodes import body_nodes
from motionenv.mocap.clinical import Measurements
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.types import Markers

# A person who stands and faces x, forearms bent forwards: pelvis 0.24 m wide and 0.16 m deep.
STANDING = {
    "LASI": (0.16, 0.12, 1.0), "RASI": (0.16, -0.12, 1.0), "LPSI": (0, 0.05, 1.0), "RPSI": (0, -0.05, 1.0),
    "LSHO": (0.05, 0.2, 1.5), "RSHO": (0.05, -0.2, 1.5), "C7": (0.0, 0.0, 1.55), "CLAV": (0.1, 0.0, 1.5),
    "LELB": (0.05, 0.3, 1.2), "RELB": (0.05, -0.3, 1.2),
    "LWRA": (0.30, 0.24, 1.25), "LWRB": (0.30, 0.30, 1.25), "RWRA": (0.30, -0.24, 1.25), "RWRB": (0.30, -0.30, 1.25),
    "LKNE": (0.1, 0.15, 0.5), "RKNE": (0.1, -0.15, 0.5), "LANK": (0.08, 0.13, 0.09), "RANK": (0.08, -0.13, 0.09),
    "LFHD": (0.15, 0.08, 1.7), "RFHD": (0.15, -0.08, 1.7), "LBHD": (-0.03, 0.07, 1.7), "RBHD": (-0.03, -0.07, 1.7),
}  # fmt: skip
HEAD = {"LFHD", "RFHD", "LBHD", "RBHD"}


def standing(without=(), **changes) -> Markers:
    points = {name: at for name, at in (STANDING | changes).items() if name not in without}
    return Markers(list(points), np.tile(np.array(list(points.values()), dtype=float), (3, 1, 1)), 100.0)


def nodes(markers: Markers):
    return body_nodes(find_landmarks(markers), Measurements())


def at(found, name) -> np.ndarray:
    return found.positions[:, NODES.index(name)]


def test_joints_lie_inside_of_their_markers_and_are_mirror_images():
    found = nodes(standing())
    np.testing.assert_allclose(at(found, "left_wrist")[0], [0.30, 0.27, 1.25])
    np.testing.assert_allclose(at(found, "head")[0], [0.06, 0.0, 1.7], atol=1e-9)
    for name, marker in (("left_knee", "LKNE"), ("left_ankle", "LANK"), ("left_elbow", "LELB")):
        assert (np.abs(at(found, name)[:, 1]) < np.abs(STANDING[marker][1])).all()
    assert np.linalg.norm(at(found, "left_shoulder")[0] - STANDING["LSHO"]) == pytest.approx(0.047)
    for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist"):
        np.testing.assert_allclose(at(found, f"left_{joint}") * [1, -1, 1], at(found, f"right_{joint}"), atol=1e-9)


def test_an_upright_trunk_stands_on_a_pelvis_tilted_by_ten_degrees():
    """The level belt of `STANDING` is that of a pelvis tilted 10 degrees less than usual."""
    trunk = nodes(standing()).trunk[0]
    np.testing.assert_allclose(trunk[:, 1], [0, 1, 0], atol=1e-12)
    assert np.degrees(np.arctan2(trunk[0, 2], trunk[2, 2])) == pytest.approx(-10)


@pytest.mark.parametrize(
    ("without", "unknown"),
    [
        (HEAD, {"head"}),
        ({"LFHD"}, set()),
        ({"C7", "CLAV"}, {"neck"}),
        ({"LWRA", "LWRB"}, {"left_wrist", "left_elbow"}),
        ({"RKNE", "RANK"}, {"right_knee", "right_ankle"}),
    ],
)
def test_without_a_marker_only_what_hangs_on_it_is_unknown(without, unknown):
    found = nodes(standing(without))
    gone = {name for name in NODES if np.isnan(at(found, name)).all()}
    assert gone == unknown | {"sternum"}


def test_a_gap_hides_what_hangs_on_it_and_nothing_else():
    markers = standing()
    positions = markers.positions.copy()
    positions[1, markers.index("LELB")] = np.nan
    found = nodes(Markers(markers.names, positions, 100.0))
    gone = {name for name in NODES if np.isnan(at(found, name)[1]).any()}
    assert gone == {"left_elbow", "sternum"}
    assert np.isfinite(at(found, "left_elbow")[[0, 2]]).all()


def test_who_shows_no_leg_is_told_what_is_missing_of_which_set():
    with pytest.raises(GapError) as told:
        nodes(standing({"LASI", "LKNE", "RKNE"}))
    text = str(told.value)
    assert "nearest marker set is 'plug-in-gait'" in text
    assert all(f"{name} ({point})" in text for name, point in (("left_asis", "LASI"), ("left_knee_lateral", "LKNE")))
    assert "right_asis" not in text
    assert "motionenv mocap map" in text
    with pytest.raises(GapError, match="none of its points has a name that a marker set knows"):
        nodes(Markers(("M1", "M2"), np.ones((2, 2, 3)), 50))


def test_who_has_clusters_but_not_on_the_pelvis_is_told_so():
    names = [f"{side}{limb}{i}" for side in "LR" for limb in ("TH", "SK") for i in (1, 2, 3)]
    with pytest.raises(GapError, match=r"'clusters': 12 of .*, but not pelvis_cluster_1 \(PV1\), .*_3 \(PV3\)\. If"):
        nodes(Markers(names, np.random.default_rng(0).normal(size=(20, len(names), 3)), 50))


def test_limbs_of_a_real_walker_keep_their_length(mocap):
    found = nodes(read(mocap / "cmu_c3d" / "02_01.c3d"))
    for near, far in (("hip", "knee"), ("knee", "ankle"), ("elbow", "wrist")):
        length = np.linalg.norm(at(found, f"left_{near}") - at(found, f"left_{far}"), axis=-1)
        other = np.linalg.norm(at(found, f"right_{near}") - at(found, f"right_{far}"), axis=-1)
        assert np.nanstd(length) < 0.02
        assert np.nanmedian(length) == pytest.approx(np.nanmedian(other), rel=0.06)
