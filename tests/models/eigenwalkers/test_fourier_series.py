"""Fourier walkers against eq. 3.1 written out, finite differences, mirrors, and the body that they were made of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionenv.body.kinematics import markers
from motionenv.body.limbs import from_height
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import GapError, MotionError
from motionenv.models.eigenwalkers.fourier_series import (
    LEFT_ANKLE,
    PELVIS,
    RIGHT_ANKLE,
    FourierWalker,
    body_heights,
    centred,
    columns,
    grounded,
    harmonic_power,
    in_phase,
    later,
    mirrored,
    positions_at,
)
from motionenv.types import MARKERS
from tests.models.eigenwalkers.walks import random_walker, stride

TURNS = st.floats(-np.pi, np.pi)


def test_columns_are_equation_3_1_and_its_derivatives():
    phase = np.linspace(-4, 9, 300)
    expected = np.stack([phase**0, np.sin(phase), np.cos(phase), np.sin(2 * phase), np.cos(2 * phase)], axis=-1)
    np.testing.assert_allclose(columns(phase), expected)
    step = 1e-5
    for d in (1, 2):
        slope = (columns(phase + step, d - 1) - columns(phase - step, d - 1)) / (2 * step)
        np.testing.assert_allclose(columns(phase, d), slope, atol=1e-8)


@given(TURNS, st.integers(0, 20))
def test_a_later_start_is_the_same_motion(turn, seed):
    w, phase = random_walker(seed), np.linspace(0, 7, 40)
    np.testing.assert_allclose(positions_at(later(w, turn), phase), positions_at(w, phase + turn), atol=1e-12)
    np.testing.assert_allclose(harmonic_power(later(w, turn)), harmonic_power(w))


@given(TURNS)
def test_zero_phase_is_where_the_left_ankle_leads_most(start):
    w = in_phase(later(random_walker(), start))
    np.testing.assert_allclose(w, in_phase(random_walker()), atol=1e-12)
    fundamental = np.where(np.arange(5)[:, None, None] < 3, w, 0)
    cycle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    x = positions_at(fundamental, cycle)[..., 0]
    assert (x[:, LEFT_ANKLE] - x[:, RIGHT_ANKLE]).argmax() == 0


def test_one_ankle_is_enough_for_the_phase_and_none_is_not():
    w = random_walker()
    w[1:3, RIGHT_ANKLE] = -w[1:3, LEFT_ANKLE]
    known = in_phase(w)
    for missing in (LEFT_ANKLE, RIGHT_ANKLE):
        part = w.copy()
        part[:, missing] = np.nan
        kept = [m for m in range(15) if m != missing]
        np.testing.assert_allclose(in_phase(part)[:, kept], known[:, kept], atol=1e-12)
    w[:, [LEFT_ANKLE, RIGHT_ANKLE]] = np.nan
    with pytest.raises(GapError, match="ankle"):
        in_phase(w)


def test_grounded_stands_on_the_ground_and_changes_nothing_else():
    w = random_walker()
    w[0, :, 2] += 5.0
    g = grounded(w)
    np.testing.assert_allclose(g, grounded(g), atol=1e-12)
    np.testing.assert_array_equal(g[1:], w[1:])
    np.testing.assert_allclose(np.ptp(g[0] - w[0], axis=0), 0, atol=1e-12)
    lowest = positions_at(g, np.linspace(0, 6.3, 500))[:, [LEFT_ANKLE, RIGHT_ANKLE], 2].min()
    # 0.491 of a standing height from ankle to pelvis, the ankle at 0.039 of it
    assert lowest == pytest.approx(ANKLE_HEIGHT / 0.491 * (g[0, PELVIS, 2] - lowest), abs=1e-4)


def test_a_mirror_image_is_the_walk_seen_in_a_mirror():
    """Of the positions over time: y negated, sides changed, half a stride later; twice it is the walk again."""
    w = np.random.default_rng(0).standard_normal((4, 5, 15, 3))
    phase = np.linspace(0, 6, 17)
    seen = positions_at(w, phase + np.pi) * [1, -1, 1]
    for i, name in enumerate(MARKERS):
        other = MARKERS.index(name.replace("left", "?").replace("right", "left").replace("?", "right"))
        np.testing.assert_allclose(positions_at(mirrored(w), phase)[..., i, :], seen[..., other, :], atol=1e-12)
    np.testing.assert_array_equal(mirrored(mirrored(w)), w)
    there = centred(in_phase(w))
    np.testing.assert_allclose(centred(in_phase(mirrored(there))), mirrored(there), atol=1e-12)


def test_power_is_the_variance_over_a_cycle():
    w = random_walker()
    cycle = np.arange(90) * 2 * np.pi / 90
    for harmonic, rows in ((0, (1, 2)), (1, (3, 4))):
        alone = np.where(np.isin(np.arange(5), rows)[:, None, None], w, 0.0)
        assert harmonic_power(w)[harmonic] == pytest.approx(positions_at(alone, cycle).var(axis=0).sum())
    w[:, 7] = np.nan
    assert np.isfinite(harmonic_power(w)).all()


@pytest.mark.parametrize("height", [1.5, 1.75, 2.0])
def test_a_body_of_average_proportions_has_the_height_that_it_was_made_with(height):
    cycle = np.arange(12) * 2 * np.pi / 12
    positions = markers(stride(height, phase=cycle), from_height(height)).reshape(12, -1)
    w = np.linalg.lstsq(columns(cycle), positions, rcond=None)[0].reshape(1, 5, 15, 3)
    np.testing.assert_allclose(body_heights(w), height, rtol=0.02)


def test_a_walker_needs_a_frequency_and_no_infinity():
    with pytest.raises(MotionError, match="frequency"):
        FourierWalker(random_walker(), 0.0)
    with pytest.raises(MotionError, match="infinity"):
        FourierWalker(random_walker() * np.inf, 1.0)
    with pytest.raises(MotionError, match=r"\(5, 15, 3\)"):
        FourierWalker(np.zeros((5, 45)), 1.0)
