"""Depth and ids of random rounded cones against the union of many spheres along the axis, in float64."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numba import njit

from motionenv.render.raycast import limb_kernel as kernel
from motionenv.types import Camera

STEPS = 2001


@njit(error_model="numpy")
def set_limb(ends, radii, r, t, k, kinv, width, height, g):
    """The part of that name, for Python."""
    kernel.set_limb(ends, radii, r, t, k, kinv, width, height, g)


@njit(error_model="numpy")
def draw_limb(g, kinv, limb, width, depth, limbs, scratch, where):
    """The part of that name, for Python."""
    kernel.draw_limb(g, kinv, limb, width, depth, limbs, scratch, where)


def camera_for(rng, width=29, height=23) -> Camera:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    f = rng.uniform(10, 60)
    K = np.array([[f, rng.normal(), (width - 1) / 2], [0, f * rng.uniform(0.8, 1.2), (height - 1) / 2], [0, 0, 1]])
    return Camera(K, turn, rng.normal(size=3), width, height)


def random_limb(rng, camera, near=0.6, far=5.0):
    """Ends (2, 3) and radii (2,) of a limb somewhere in front of the camera, now and then along the view."""
    middle = np.array([rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), 1.0]) * rng.uniform(near, far)
    axis = rng.normal(size=3) * rng.choice([0.02, 0.1, 0.3]) + rng.choice([0, 0.3]) * middle / np.linalg.norm(middle)
    seen = np.stack([middle - axis / 2, middle + axis / 2])
    return (seen - camera.t) @ camera.R, rng.uniform(0.01, 0.2, size=2)


def rays(camera):
    """Directions (height, width, 3) in the camera's frame, with z = 1."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    return np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera.K).T


def first_hit(camera, ends, radii):
    """Depth (height, width) at which each pixel's ray enters the nearest of STEPS spheres; infinite where it misses."""
    seen = ends @ camera.R.T + camera.t
    d = rays(camera)
    dd = (d * d).sum(-1)
    best = np.full(d.shape[:2], np.inf)
    for s in np.linspace(0, 1, STEPS):
        c, r = seen[0] + s * (seen[1] - seen[0]), radii[0] + s * (radii[1] - radii[0])
        dc = d @ c
        h = dc * dc - dd * (c @ c - r * r)
        with np.errstate(invalid="ignore"):
            best = np.minimum(best, np.where(h >= 0, (dc - np.sqrt(h)) / dd, np.inf))
    return best


def cast(camera, limbs):
    """Depth and ids of `limbs`, pairs of ends (2, 3) and radii (2,), by the engine."""
    depth = np.full((camera.height, camera.width), np.inf, np.float32)
    ids = np.zeros(depth.shape, np.uint8)
    table, kinv = np.zeros((1, kernel.COLUMNS)), np.linalg.inv(camera.K)
    scratch = np.empty((4, kernel.GATHER), np.float32), np.empty(kernel.GATHER, np.int64)
    for i, (ends, radii) in enumerate(limbs):
        size = camera.width, camera.height
        set_limb(ends, radii, camera.R, camera.t, camera.K, kinv, *size, table[0])
        into = depth.reshape(-1), ids.reshape(-1)
        draw_limb(table[0], kinv, np.uint8(i + 1), camera.width, *into, *scratch)
    return depth, ids


def assert_same_surface(camera, got, expected):
    """Equal depth but for rays that graze the surface, where either may hit."""
    hit, want = np.isfinite(got), np.isfinite(expected)
    assert (hit != want).mean() < 0.006
    both = hit & want
    error = np.abs(got[both] - expected[both])
    assert np.all(error < 2e-3)
    assert np.all(np.sort(error)[: int(0.9 * len(error))] < 2e-5)


@given(st.integers(0, 2**32 - 1))
def test_depth_equals_union_of_spheres(seed):
    rng = np.random.default_rng(seed)
    camera = camera_for(rng)
    limb = random_limb(rng, camera)
    assume((np.asarray(limb[0]) @ camera.R.T + camera.t)[:, 2].min() >= limb[1].max() + 0.05)
    assert_same_surface(camera, cast(camera, [limb])[0], first_hit(camera, *limb))


@given(st.integers(0, 2**32 - 1))
def test_nearest_limb_wins(seed):
    rng = np.random.default_rng(seed)
    camera = camera_for(rng)
    limbs = [random_limb(rng, camera, near=2.0) for _ in range(4)]
    alone = np.stack([cast(camera, [limb])[0] for limb in limbs])
    depth, ids = cast(camera, limbs)
    np.testing.assert_array_equal(depth, alone.min(0))
    np.testing.assert_array_equal(ids, np.where(np.isfinite(alone.min(0)), alone.argmin(0) + 1, 0))


def straight_ahead(f=40.0, width=41, height=31):
    return Camera([[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1]], np.eye(3), np.zeros(3), width, height)


@pytest.mark.parametrize(
    ("ends", "radii"),
    [
        ([[0, 0, 2], [0, 0, 3]], (0.3, 0.1)),  # thick end towards the camera
        ([[0, 0, 2], [0, 0, 3]], (0.1, 0.3)),  # thin end: the far sphere shows around it
        ([[0, 0, 2], [0.05, 0, 2]], (0.3, 0.1)),  # one sphere within the other
        ([[0.4, 0, 1], [0.1, 0, 9]], (0.3, 0.3)),  # nearly along the rays
        ([[0, 0, 2], [0, 0, 2]], (0.3, 0.3)),  # a ball
    ],
)
def test_hard_shapes(ends, radii):
    limb = np.array(ends, float), np.array(radii)
    camera = straight_ahead()
    assert_same_surface(camera, cast(camera, [limb])[0], first_hit(camera, *limb))


@pytest.mark.parametrize(
    ("ends", "radii"),
    [
        ([[0, 0, -2], [0, 0, -3]], (0.3, 0.1)),  # behind
        ([[0, 0, -1], [0, 0, 1]], (0.3, 0.3)),  # around the camera
        ([[0, 0, 0], [0, 0, 1]], (0.3, 0.001)),
    ],
)
def test_limbs_behind_or_around_the_camera_are_not_drawn(ends, radii):
    depth, ids = cast(straight_ahead(), [(np.array(ends, float), np.array(radii))])
    assert np.isinf(depth).all()
    assert not ids.any()


def test_limb_that_passes_beside_the_camera_is_drawn_where_it_is_in_front():
    camera = straight_ahead()
    limb = np.array([[0.5, 0, -1.0], [0.5, 0, 3.0]]), np.array([0.2, 0.2])
    ahead = first_hit(camera, *limb)
    assert_same_surface(camera, cast(camera, [limb])[0], np.where(ahead > 0, ahead, np.inf))


def test_far_limb_keeps_its_precision():
    """At 60 m through a long lens, float32 still gives the surface within 0.1 mm."""
    camera = straight_ahead(f=3000.0)
    limb = np.array([[-0.1, -0.2, 60.0], [0.15, 0.1, 60.3]]), np.array([0.08, 0.05])
    got, want = cast(camera, [limb])[0], first_hit(camera, *limb)
    both = np.isfinite(got) & np.isfinite(want)
    assert both.sum() > 100
    assert np.median(np.abs(got[both] - want[both])) < 1e-5 + np.spacing(np.float32(60))


def test_outline_touches_its_bounding_box():
    """The box holds every pixel that is drawn, and no row or column more than rounding needs."""
    camera = straight_ahead(f=400.0, width=401, height=301)
    limb = np.array([[-0.3, -0.1, 2.0], [0.25, 0.2, 2.5]]), np.array([0.15, 0.05])
    _, ids = cast(camera, [limb])
    g = np.zeros(kernel.COLUMNS)
    set_limb(*limb, camera.R, camera.t, camera.K, np.linalg.inv(camera.K), camera.width, camera.height, g)
    rows, columns = np.nonzero(ids.any(1))[0], np.nonzero(ids.any(0))[0]
    box = g[kernel.BOX : kernel.BOX + 4]
    np.testing.assert_allclose(box, [columns[0], columns[-1], rows[0], rows[-1]], atol=1)
    assert box[0] <= columns[0] and box[1] >= columns[-1] and box[2] <= rows[0] and box[3] >= rows[-1]  # noqa: PT018
