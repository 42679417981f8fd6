"""Dots of displays against what they are defined by: markers, mirrors, permutations, counts."""

from itertools import pairwise

import numpy as np
import pytest

import motionenv
from motionenv.data.stimuli import Display, PointLightWalker, Ring, dots_at
from motionenv.data.stimuli.making import ring
from motionenv.models import cycle
from motionenv.render.cameras import orthographic
from motionenv.types import MARKERS

TIMES = np.arange(240) / 60


@pytest.fixture(scope="module")
def walk() -> Ring:
    return ring(PointLightWalker(deviations=(1.0, -0.5)))


def test_a_plain_display_shows_the_markers_of_the_walk(walk):
    made = cycle("walk/fpca", deviations=(1.0, -0.5))
    seen = dots_at(Display(view=30), walk, np.arange(96) / 96 * made.seconds)
    wanted = motionenv.markers(made.poses, made.body)
    np.testing.assert_allclose(seen.positions, wanted, atol=1e-9)
    flat = orthographic(wanted, np.radians(30)) / walk.height - [0, 0.5]
    np.testing.assert_allclose(seen.plane, flat, atol=1e-9)
    assert seen.visible.all()


def test_between_samples_it_is_smooth_and_periodic(walk):
    fine = dots_at(Display(), walk, np.linspace(0, walk.seconds, 961)).positions
    np.testing.assert_allclose(fine[0], fine[-1], atol=1e-9)
    np.testing.assert_allclose(fine[::10], walk.markers[np.arange(97) % 96], atol=1e-9)
    assert np.abs(np.diff(fine, n=2, axis=0)).max() < 1e-3


def test_backwards_is_forwards_from_behind(walk):
    back = dots_at(Display(rate=-1), walk, TIMES).positions
    np.testing.assert_allclose(back, dots_at(Display(), walk, -TIMES).positions, atol=1e-12)
    twice = dots_at(Display(rate=2), walk, TIMES).positions
    np.testing.assert_allclose(twice, dots_at(Display(), walk, 2 * TIMES).positions, atol=1e-12)


def test_roll_turns_the_picture_and_inversion_mirrors_it(walk):
    plain = dots_at(Display(view=45), walk, TIMES).plane
    np.testing.assert_allclose(dots_at(Display(view=45, roll=180), walk, TIMES).plane, -plain, atol=1e-12)
    x, y = np.moveaxis(dots_at(Display(view=45, roll=90), walk, TIMES).plane, -1, 0)
    np.testing.assert_allclose(np.stack([y, -x], axis=-1), plain, atol=1e-12)
    np.testing.assert_allclose(dots_at(Display(view=45, inverted=True), walk, TIMES).plane, plain * [1, -1], atol=1e-12)


def test_a_turntable_is_a_view_that_changes(walk):
    turning = dots_at(Display(view=10, turntable=60), walk, TIMES)
    still = dots_at(Display(view=10 + 60 * TIMES[90]), walk, TIMES)
    np.testing.assert_allclose(turning.plane[90], still.plane[90], atol=1e-12)
    np.testing.assert_allclose(turning.depth[90], still.depth[90], atol=1e-12)


def test_across_the_feet_that_stand_stay_where_they_are(walk):
    ankles = [MARKERS.index(f"{side}_ankle") for side in ("left", "right")]
    moved = dots_at(Display(across=100), walk, TIMES).positions[:, ankles, 0]
    slowest = np.abs(np.diff(moved, axis=0)).min(axis=1) * 60
    assert np.median(slowest) < 0.12 * walk.stride / walk.seconds
    wrapped = dots_at(Display(across=2), walk, TIMES).positions.mean(axis=1)[:, 0]
    assert wrapped.max() < 1.4
    assert wrapped.min() > -1.4
    assert (np.diff(wrapped) < -1.5).sum() == int(TIMES[-1] * walk.stride / walk.seconds / 2)


def test_scrambled_dots_move_as_before_from_elsewhere(walk):
    plain, scrambled = (dots_at(Display(scrambled=on, seed=3), walk, TIMES).positions for on in (False, True))
    shift = scrambled - plain
    np.testing.assert_allclose(shift, shift[:1].repeat(len(TIMES), axis=0), atol=1e-12)
    middle = walk.markers[::4].mean(axis=0) + shift[0]
    assert (np.abs(middle[:, :2]) <= 0.25 * walk.height).all()
    assert ((middle[:, 2] >= 0.06 * walk.height) & (middle[:, 2] <= 0.94 * walk.height)).all()
    other = dots_at(Display(scrambled=True, seed=4), walk, TIMES).positions
    assert np.abs(other - scrambled).max() > 0.1


def test_desynchronised_dots_keep_their_paths(walk):
    phases = np.linspace(0, walk.seconds, 97)
    found = dots_at(Display(desynchronised=True), walk, phases).positions
    for dot in range(len(MARKERS)):
        near = np.linalg.norm(found[:, None, dot] - walk.markers[None, :, dot], axis=-1).min(axis=1)
        assert near.max() < 0.03


@pytest.mark.parametrize("count", [1, 5, 14])
def test_so_many_dots_are_visible_and_each_lives_so_long(walk, count):
    times = np.arange(3000) / 1000
    visible = dots_at(Display(dots=count, lifetime=0.25, seed=5), walk, times).visible
    assert (visible.sum(axis=1) == count).all()
    assert visible.any(axis=0).sum() > 5, "dots take turns"
    for dot in range(len(MARKERS)):
        changes = np.flatnonzero(np.diff(visible[:, dot].astype(int)))
        ends = [(a, b) for a, b in pairwise(changes) if visible[a + 1, dot]]
        assert all(b - a == pytest.approx(250, abs=1.01) for a, b in ends)
    assert (dots_at(Display(dots=count, seed=5), walk, times).visible.sum(axis=1) == count).all()


def test_a_mask_moves_as_walkers_do_and_dies_as_they_do(walk):
    shown = Display(mask=45, dots=5, lifetime=0.2, mask_size=1.4)
    found = dots_at(shown, walk, TIMES)
    mask = found.positions[:, 15:]
    assert mask.shape == (240, 45, 3)
    assert found.visible[:, 15:].all()
    reach = 0.7 * walk.height + 0.6
    assert (np.abs(mask - [0, 0, 0.5 * walk.height]) < reach).all()
    jumps = (np.linalg.norm(np.diff(mask, axis=0), axis=-1) > 0.15).sum(axis=0)
    assert jumps.mean() == pytest.approx(TIMES[-1] / 0.2, abs=2)
    lasting = dots_at(Display(mask=45), walk, TIMES).positions[:, 15:]
    assert np.linalg.norm(np.diff(lasting, axis=0), axis=-1).max() < 0.1
    assert np.ptp(lasting, axis=0).max() == pytest.approx(np.ptp(walk.markers, axis=0).max(), rel=0.02)
