"""Units by definition, axes by the right hand, hierarchies against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv.errors import MotionError
from motionenv.mocap.units_axes import forward, metres_per, upright


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


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_the_vertical_axis_becomes_z_and_hands_stay_hands(up, axis):
    axes = upright(np.eye(3), up)
    np.testing.assert_array_equal(axes[axis], [0, 0, 1])
    assert np.linalg.det(axes) == pytest.approx(1)


def test_of_y_up_files_z_is_forward_and_x_left():
    np.testing.assert_array_equal(upright([[0, 0, 1], [1, 0, 0]], "y"), [[1, 0, 0], [0, 1, 0]])
    with pytest.raises(MotionError, match="up must be 'x', 'y' or 'z', got 'Y'"):
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
