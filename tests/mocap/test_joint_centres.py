"""Joint centres from skin markers: a body whose markers were put on by hand, and CMU's walkers."""

import numpy as np
import pytest

from motionenv.mocap import read
from motionenv.mocap.joint_centres import has_markers, with_joint_centres
from motionenv.types import Markers

# A person who stands and faces x, forearms bent forwards: pelvis 0.24 m wide and 0.16 m deep.
STANDING = {
    "LASI": (0.16, 0.12, 1.0), "RASI": (0.16, -0.12, 1.0), "LPSI": (0, 0.05, 1.0), "RPSI": (0, -0.05, 1.0),
    "LSHO": (0.05, 0.2, 1.5), "RSHO": (0.05, -0.2, 1.5), "C7": (0.0, 0.0, 1.55),
    "LELB": (0.05, 0.3, 1.2), "RELB": (0.05, -0.3, 1.2),
    "LWRA": (0.30, 0.24, 1.25), "LWRB": (0.30, 0.30, 1.25), "RWRA": (0.30, -0.24, 1.25), "RWRB": (0.30, -0.30, 1.25),
    "LKNE": (0.1, 0.15, 0.5), "RKNE": (0.1, -0.15, 0.5), "LANK": (0.08, 0.13, 0.09), "RANK": (0.08, -0.13, 0.09),
}  # fmt: skip


def standing(**changes) -> Markers:
    points = STANDING | changes
    positions = np.tile(np.array(list(points.values()), dtype=float), (3, 1, 1))
    return Markers(list(points), positions, 100.0)


def at(markers, name) -> np.ndarray:
    return markers.positions[:, markers.index(name)]


def test_hips_are_where_the_regression_puts_them():
    """Harrington et al. (2007), table 2, in mm: x = -0.24 PD - 9.9, y = -0.30 PW - 10.9, z = 0.33 PW + 7.3."""
    found = with_joint_centres(standing())
    middle = np.array([0.16, 0.0, 1.0])
    back, down, aside = 0.24 * 160 + 9.9, 0.30 * 240 + 10.9, 0.33 * 240 + 7.3
    for side, sign in (("L", 1), ("R", -1)):
        expected = middle + np.array([-back, sign * aside, -down]) / 1000
        np.testing.assert_allclose(at(found, f"{side}HJC"), np.tile(expected, (3, 1)), atol=1e-9)


def test_other_joints_lie_inside_of_their_markers_and_are_mirror_images():
    found = with_joint_centres(standing())
    np.testing.assert_allclose(at(found, "LWJC")[0], [0.30, 0.27, 1.25])
    for marker, joint, apart in (("KNE", "KJC", 0.058), ("ANK", "AJC", 0.042), ("SHO", "SJC", 0.047)):
        np.testing.assert_allclose(np.linalg.norm(at(found, f"L{joint}") - at(found, f"L{marker}"), axis=-1), apart)
    assert (at(found, "LKJC")[:, 1] < at(found, "LKNE")[:, 1]).all()
    assert (at(found, "LSJC")[:, 2] < at(found, "LSHO")[:, 2]).all()
    assert (np.abs(at(found, "LEJC")[:, 1]) < np.abs(at(found, "LELB")[:, 1])).all()
    for joint in ("HJC", "KJC", "AJC", "SJC", "EJC", "WJC"):
        np.testing.assert_allclose(at(found, f"L{joint}") * [1, -1, 1], at(found, f"R{joint}"), atol=1e-9)


def test_a_sacrum_or_cmus_names_will_do_for_the_pelvis():
    plain = with_joint_centres(standing())
    points = {name: where for name, where in STANDING.items() if "PSI" not in name} | {"SACR": (0, 0, 1.0)}
    sacral = Markers(list(points), np.tile(np.array(list(points.values())), (3, 1, 1)), 100.0)
    waist = {"LASI": "LFWT", "RASI": "RFWT", "LPSI": "LBWT", "RPSI": "RBWT"}
    renamed = Markers([waist.get(n, n) for n in STANDING], standing().positions, 100.0)
    for other in (sacral, renamed):
        assert has_markers(other.names)
        np.testing.assert_allclose(at(with_joint_centres(other), "RHJC"), at(plain, "RHJC"), atol=1e-12)


@pytest.mark.parametrize("name", ["LASI", "LPSI", "C7", "RWRB"])
def test_without_a_marker_there_are_no_centres(name):
    assert has_markers(STANDING)
    assert not has_markers([n for n in STANDING if n != name])


def test_a_gap_hides_what_hangs_on_it_and_nothing_else():
    markers = standing()
    positions = markers.positions.copy()
    positions[1, markers.index("LELB")] = np.nan
    found = with_joint_centres(Markers(markers.names, positions, 100.0))
    gone = {n for n in found.names[len(STANDING) :] if np.isnan(at(found, n)).any()}
    assert gone == {"LEJC"}
    assert np.isfinite(at(found, "LEJC")[[0, 2]]).all()


def test_limbs_of_a_real_walker_keep_their_length(mocap):
    found = with_joint_centres(read(mocap / "cmu_c3d" / "02_01.c3d"))
    for near, far in (("HJC", "KJC"), ("KJC", "AJC"), ("EJC", "WJC")):
        length = np.linalg.norm(at(found, f"L{near}") - at(found, f"L{far}"), axis=-1)
        other = np.linalg.norm(at(found, f"R{near}") - at(found, f"R{far}"), axis=-1)
        assert np.nanstd(length) < 0.02
        assert np.nanmedian(length) == pytest.approx(np.nanmedian(other), rel=0.06)
