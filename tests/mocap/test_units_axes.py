"""Units by definition, axes by the right hand, hierarchies against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.errors import MotionError
from motionenv.mocap.units_axes import (
    MARKER_UNITS,
    METRES,
    box,
    file_metres,
    forward,
    metres_per,
    unit_proposal,
    upright,
    vertical_axis,
)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        ("m", 1), ("Metres", 1), (" cm ", 0.01), ("centimeters", 0.01), ("MM", 0.001), ("inch", 0.0254), ("in", 0.0254),
        ("cmu", 0.0254 / 0.45), (0.3048, 0.3048), (np.float32(2), 2),
    ],
)  # fmt: skip
def test_units_have_their_metres(unit, metres):
    assert metres_per(unit) == pytest.approx(metres)


@pytest.mark.parametrize("unit", ["furlong", "", 0, -1, np.inf, np.nan, True, None])
def test_other_units_are_told_which_there_are(unit):
    says = r"unit must be one of m, dm, cm, mm, inch, cmu or the metres per file unit \(above 0\), got "
    with pytest.raises(MotionError, match=says):
        metres_per(unit)


@pytest.mark.parametrize(
    ("written", "unit"),
    [
        ("milimeters", "mm"), ("MM ", "mm"), ("mm.", "mm"), ("Millimetres", "mm"), ("milimetros", "mm"),
        ("[cm]", "cm"), ("centimeter", "cm"), ("decimeters", "dm"), ("metre", "m"), ("Inches", "inch"),
    ],
)  # fmt: skip
def test_units_of_files_are_known_however_they_are_spelt(written, unit):
    assert file_metres(written) == METRES[unit]


@pytest.mark.parametrize(
    "written", ["", "238", "0.001", "0.1 mm", "kilometers", "nanometers", "micrometers", "pixels", "V"]
)
def test_what_names_no_unit_is_none(written):
    assert file_metres(written) is None


def test_numbers_are_units_as_text_too():
    assert metres_per("0.0564") == 0.0564


def person(tall: float) -> np.ndarray:
    """Points on an upright body of a width of a third of its height, over three frames, with a gap."""
    points = np.random.default_rng(1).uniform([0, 0, 0], [tall / 3, tall / 3, tall], (3, 30, 3))
    points[:, 0], points[:, 1] = 0, (tall / 3, tall / 3, tall)
    points[1, 5] = np.nan
    return points


@pytest.mark.parametrize(
    ("unit", "units"), [("mm", MARKER_UNITS), ("m", MARKER_UNITS), ("cm", METRES), ("cmu", METRES)]
)
def test_a_body_says_its_unit(unit, units):
    says = unit_proposal(person(1.73) / METRES[unit], tuple(units))
    assert "1.73 m, which fits a person" in says
    assert f'pass unit="{unit}" (--unit {unit})' in says


def test_two_people_get_the_nearest_unit():
    assert 'span 3.20 m, which is nearest to a person: pass unit="mm"' in unit_proposal(person(3200.0), MARKER_UNITS)


def test_a_body_of_no_usual_unit_gets_a_number():
    assert "unit=0.17 (--unit 0.17) makes the points span 1.7 m" in unit_proposal(person(10.0), ("m", "mm"))
    assert unit_proposal(np.full((2, 3, 3), np.nan)).startswith("pass unit= (--unit), one of m, dm, cm, mm")


@pytest.mark.parametrize("up", "xyz")
def test_people_stand_along_the_vertical(up):
    shift = "xyz".index(up) - 2
    standing = np.roll(person(1.8), shift, axis=-1)
    np.testing.assert_allclose(np.sort(box(standing)), [0.6, 0.6, 1.8])
    assert vertical_axis(standing, "?") == up
    assert vertical_axis(standing / 10, "y") == "y"
    assert vertical_axis(np.full((2, 3, 3), np.nan), "y") == "y"


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_the_vertical_axis_becomes_z_and_hands_stay_hands(up, axis):
    axes = upright(np.eye(3), up)
    np.testing.assert_array_equal(axes[axis], [0, 0, 1])
    assert np.linalg.det(axes) == pytest.approx(1)


def test_of_y_up_files_z_is_forward_and_x_left():
    np.testing.assert_array_equal(upright([[0, 0, 1], [1, 0, 0]], "y"), [[1, 0, 0], [0, 1, 0]])
    with pytest.raises(MotionError, match="up must be x, y, z, -x, -y or -z, got 'Y'"):
        upright(np.zeros(3), "Y")


def test_a_hierarchy_is_chained_as_scipy_does_it():
    """Two roots, three joints; in the file's y-up world first, then turned."""
    rng, parents = np.random.default_rng(0), (-1, 0, 1, 0, -1)
    offsets, local = rng.standard_normal((6, 5, 3)), Rotation.random(30, rng=0).as_matrix().reshape(6, 5, 3, 3)
    before = local.copy()
    positions, rotations = forward(parents, offsets, local)
    np.testing.assert_array_equal(local, before)
    for t in range(6):
        at, turn = {}, {}
        for j, p in enumerate(parents):
            own = Rotation.from_matrix(local[t, j])
            at[j] = offsets[t, j] if p < 0 else at[p] + turn[p].apply(offsets[t, j])
            turn[j] = own if p < 0 else turn[p] * own
            np.testing.assert_allclose(positions[t, j], at[j][[2, 0, 1]], atol=1e-12)
            point = rng.standard_normal(3)
            expected = turn[j].apply(point)[[2, 0, 1]]
            np.testing.assert_allclose(rotations[t, j] @ point[[2, 0, 1]], expected, atol=1e-12)
