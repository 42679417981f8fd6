"""Rotations of kernels against SciPy's, the foot's rule against a search over angles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionenv._core.compilation import kernel
from motionenv.body import simd
from motionenv.body.limbs import LIMB_SHIFTS, LIMBS
from motionenv.body.skeleton import ANKLE_HEIGHT

HEEL, TOE = LIMB_SHIFTS[LIMBS.index("left_foot")][:, [0, 2]]  # (x, z) in the foot's frame, in body heights


@kernel
def sines(x, out):
    for i in range(len(x)):
        out[i, 0], out[i, 1] = simd.sine_cosine(x[i])


@kernel
def feet(angles, heights, out):
    for i in range(len(angles)):
        c, s = simd.foot_angle(np.cos(angles[i]), np.sin(angles[i]), heights[i], 1.0)
        out[i] = np.arctan2(s, c)


@kernel
def root(a):
    sines, cosines = np.sin(a), np.cos(a)
    return simd.root_rotation(sines[0], cosines[0], sines[1], cosines[1], sines[2], cosines[2])


@kernel
def turned(r, a):
    sines, cosines = np.sin(a), np.cos(a)
    return simd.turned(
        (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]),
        sines[0], cosines[0], sines[1], cosines[1], sines[2], cosines[2],
    )  # fmt: skip


@kernel
def foot(r, z):
    return simd.foot_rotation((r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]), z, 1.0)


def test_sines_are_those_of_numpy():
    x = np.linspace(-40, 40, 100_001)
    out = np.empty((len(x), 2))
    sines(x, out)
    np.testing.assert_allclose(out, np.stack([np.sin(x), np.cos(x)], -1), atol=1e-14)


def test_rotations_are_those_of_scipy():
    rng = np.random.default_rng(0)
    for angles, parent in zip(rng.uniform(-3, 3, (20, 3)), Rotation.random(20, rng=1), strict=True):
        tilt, obliquity, heading = angles
        expected = Rotation.from_euler("ZXY", [heading, obliquity, tilt]).as_matrix()
        np.testing.assert_allclose(np.reshape(root(angles), (3, 3)), expected, atol=1e-12)
        child = Rotation.from_euler("YXZ", angles)
        got = np.reshape(turned(parent.as_matrix().ravel(), angles), (3, 3))
        np.testing.assert_allclose(got, (parent * child).as_matrix(), atol=1e-12)


def lowest(angle: float, point: np.ndarray) -> float:
    """Height of a point of the foot above the ankle, toes down by `angle`."""
    return point[1] * np.cos(angle) - point[0] * np.sin(angle)


@pytest.mark.parametrize("raised", [0.0, 0.01, 0.03, 0.06])
def test_a_foot_follows_the_shin_until_toe_or_heel_would_sink(raised):
    """Between its limits the angle stays; at them the toe or the heel is as low as in stance."""
    angles = np.linspace(-2.0, 2.0, 401)
    out = np.empty(401)
    feet(angles, np.full(401, ANKLE_HEIGHT + raised), out)
    free = np.abs(out - angles) < 1e-9
    assert free.any()
    for angle in out:
        assert lowest(angle, TOE) + raised >= TOE[1] - 1e-9
        assert lowest(angle, HEEL) + raised >= HEEL[1] - 1e-9
    assert (np.diff(out) >= -1e-12).all()
    np.testing.assert_allclose(lowest(out.max(), TOE) + raised, TOE[1], atol=1e-9)


def test_a_foot_is_a_rotation_without_lateral_tilt():
    for shin in Rotation.random(200, rng=3):
        got = np.reshape(foot(shin.as_matrix().ravel(), 0.5), (3, 3))
        np.testing.assert_allclose(got @ got.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(got) == pytest.approx(1.0)
        assert got[2, 1] == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(got[:2, 1] @ shin.as_matrix()[:2, 1] > 0, True)
