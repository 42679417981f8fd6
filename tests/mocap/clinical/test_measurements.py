"""Measurements: what files state, in their units, and what is estimated from the markers."""

import numpy as np
import pytest

from motionenv.mocap import read
from motionenv.mocap.clinical.measurements import Measurements, Side, completed, measurements_of
from motionenv.mocap.marker_sets import find_landmarks
from motionenv.types import Recording

STATED = {
    f"PROCESSING:{side}{key}": value
    for side in "LR"
    for key, value in {"LEGLENGTH": 900.0, "KNEEWIDTH": 100.0, "ANKLEWIDTH": 70.0, "STATICPLANTFLEX": 0.1}.items()
}


def test_lengths_come_in_metres_and_angles_in_radians():
    found = measurements_of(Recording(parameters=STATED | {"PROCESSING:MARKER DIAMETER": 14.0}, metres=0.001))
    assert found.given
    assert (found.left.leg_length, found.right.knee_width, found.marker_radius) == pytest.approx((0.9, 0.1, 0.007))
    assert found.left.plantar_flexion == pytest.approx(0.1)
    assert np.isnan(found.left.foot_rotation)


def test_static_offsets_in_degrees_are_recognised():
    degrees = measurements_of(Recording(parameters=STATED | {"PROCESSING:LSTATICPLANTFLEX": 12.7}, metres=0.001))
    assert degrees.left.plantar_flexion == pytest.approx(np.radians(12.7))
    assert degrees.right.plantar_flexion == pytest.approx(np.radians(0.1))


def test_each_kind_of_angle_has_its_unit():
    """Offsets of 1.2 degrees aren't 69; a torsion of 15 degrees doesn't make degrees of offsets in radians."""
    small = STATED | {f"PROCESSING:{side}STATICPLANTFLEX": 1.2 for side in "LR"}
    assert measurements_of(Recording(parameters=small, metres=0.001)).left.plantar_flexion == pytest.approx(
        np.radians(1.2)
    )
    mixed = STATED | {"PROCESSING:LTIBIALTORSION": 15.0, "PROCESSING:RTHIGHROTATION": -8.0}
    found = measurements_of(Recording(parameters=mixed, metres=0.001))
    assert found.left.plantar_flexion == pytest.approx(0.1)
    assert (found.left.tibial_torsion, found.right.thigh_rotation) == pytest.approx(np.radians((15.0, -8.0)))


def test_a_file_without_measurements_gives_none():
    assert np.isnan(measurements_of(None).left.leg_length)
    assert not measurements_of(Recording(parameters={"TRIAL:LLEGLENGTH": 900.0})).given


def test_what_is_stated_is_kept_and_the_rest_estimated():
    leg = {
        "left_asis": np.array([[0, 0, 1.0]]), "left_knee_lateral": np.array([[0, 0, 0.5]]),
        "left_ankle_lateral": np.array([[0, 0, 0.1]]),
    }  # fmt: skip
    found = completed(Measurements(left=Side(knee_width=0.2)), leg)
    assert found.left.leg_length == found.right.leg_length == pytest.approx(0.9)
    assert found.left.knee_width == 0.2
    assert found.right.knee_width == pytest.approx(0.9 / 0.53 * 9.52 / 170.18)


def test_estimates_are_near_what_was_measured_on_real_people(mocap):
    """Leg lengths were measured with a tape from ASIS to malleolus: within 12 %, widths within 15 %."""
    for name, leg, knee in (("PiG_Motion-FlatFoot-Full", 0.80, 0.105), ("PiG_Motion3_FF", 0.92, 0.102)):
        markers = read(mocap / f"btkdata/C3DSamples/PiG/{name}.c3d")
        found = completed(Measurements(), find_landmarks(markers).positions)
        assert found.left.leg_length == pytest.approx(leg, rel=0.12)
        assert found.left.knee_width == pytest.approx(knee, rel=0.15)
