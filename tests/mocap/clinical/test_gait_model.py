"""The Conventional Gait Model's geometry, against closed forms."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motionenv.mocap.clinical.gait_model import chord, davis_hip, frame, harrington_hip, middle, pelvis, sacrum, unit
from motionenv.mocap.clinical.measurements import Measurements, Side

PELVIS = {
    "left_asis": np.array([[0.16, 0.12, 1.0]]), "right_asis": np.array([[0.16, -0.12, 1.0]]),
    "left_psis": np.array([[0.0, 0.05, 1.0]]), "right_psis": np.array([[0.0, -0.05, 1.0]]),
}  # fmt: skip
vectors = st.lists(st.floats(-1, 1), min_size=3, max_size=3).map(np.array)


@settings(max_examples=50)
@given(vectors, vectors, vectors, st.floats(0.02, 0.08))
def test_the_chord_meets_its_definition(proximal, lateral, wand, distance):
    """At the distance from the marker, at a right angle, in the plane, away from the wand (Davis et al. 1991)."""
    proximal = lateral + 0.4 * np.array([0, 0, 1.0]) + 0.1 * proximal
    wand = wand + np.array([0, 1.5, 0])
    assume(np.linalg.norm(np.cross(proximal - lateral, wand - lateral)) >= 0.05)
    centre = chord(proximal[None], lateral[None], wand[None], distance)[0]
    assert np.linalg.norm(centre - lateral) == pytest.approx(distance)
    assert (centre - lateral) @ (centre - proximal) == pytest.approx(0, abs=1e-12)
    normal = unit(np.cross(proximal - lateral, wand - lateral))
    assert (centre - lateral) @ normal == pytest.approx(0, abs=1e-12)
    line = unit(proximal - lateral)
    outside = (wand - lateral) - line * (line @ (wand - lateral))
    assert (centre - lateral) @ outside < 0


def test_a_turned_chord_turns_about_the_line_to_the_proximal_centre():
    proximal, lateral, wand = np.array([[0, 0, 1.0]]), np.zeros((1, 3)), np.array([[0, 1.0, 0.5]])
    straight, turned = (chord(proximal, lateral, wand, 0.1, turn)[0] for turn in (0.0, np.pi / 2))
    np.testing.assert_allclose(straight, [0, -0.1 * np.sqrt(0.99), 0.01], atol=1e-12)
    np.testing.assert_allclose(turned, [0.1 * np.sqrt(0.99), 0, 0.01], atol=1e-12)


def test_hips_are_where_harringtons_regression_puts_them():
    """Harrington et al. (2007), table 2, in mm: x = -0.24 PD - 9.9, y = -0.30 PW - 10.9, z = 0.33 PW + 7.3."""
    found = {side: harrington_hip(pelvis(PELVIS), PELVIS, side, 0.24) for side in ("left", "right")}
    back, down, aside = 0.24 * 160 + 9.9, 0.30 * 240 + 10.9, 0.33 * 240 + 7.3
    for side, sign in (("left", 1), ("right", -1)):
        np.testing.assert_allclose(found[side][0], np.array([160 - back, sign * aside, 1000 - down]) / 1000)


def test_hips_are_where_daviss_regression_puts_them():
    """Worked by hand for legs of 0.9 m: C = 0.0882, ASIS to trochanter 0.06736 + 0.007 m."""
    person = Measurements(Side(leg_length=0.9), Side(leg_length=0.9))
    left = davis_hip(pelvis(PELVIS), person, "left", 0.24)[0]
    np.testing.assert_allclose(left, [0.16 - 0.04682, 0.12 - 0.04229, 1 - 0.09658], atol=2e-5)


def test_the_sacrum_stands_in_for_hidden_psis_frame_by_frame():
    both = {
        "left_psis": np.array([[0, 1.0, 0], [np.nan] * 3]), "right_psis": np.array([[0, -1.0, 0], [0, -1.0, 0]]),
        "sacrum": np.array([[5.0, 0, 0], [6.0, 0, 0]]),
    }  # fmt: skip
    np.testing.assert_array_equal(sacrum(both), [[0, 0, 0], [6, 0, 0]])
    assert sacrum({}) is None
    assert pelvis({"sacrum": both["sacrum"]}) is None


def test_frames_are_rotations_with_z_along_and_y_towards():
    made = frame(np.array([[0.0, 0.2, 2.0]]), np.array([[0.0, 3.0, 1.0]]))[0]
    np.testing.assert_allclose(made.T @ made, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(made[:, 2], unit(np.array([0, 0.2, 2.0])))
    assert np.linalg.det(made) == pytest.approx(1)
    assert made[1, 1] > 0.9


def test_the_middle_of_nothing_is_unknown():
    assert middle(np.array([np.nan, 3.0, 1.0])) == 2.0
    assert np.isnan(middle(np.array([np.nan])))
