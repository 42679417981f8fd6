"""Offsets against fig. 6 written out with a table of phases, and by the properties that it promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.cycles import align, periodic_basis
from motionenv.errors import GapError, MotionError


def fig_6(sequences, periods, weights):
    """Fig. 6: every phase of every sample at every candidate offset, one least-squares fit per channel."""
    offsets, errors = np.zeros(len(sequences), dtype=int), []
    root = np.sqrt(weights)
    stacked = np.concatenate(sequences) * root

    def phase(i, offset):
        return np.mod(np.arange(len(sequences[i])) - offset, periods[i]) / periods[i]

    while True:
        basis = periodic_basis(np.concatenate([phase(i, o) for i, o in enumerate(offsets)]))
        seen = ~np.isnan(stacked)
        fits = [np.linalg.lstsq(basis[s], z[s])[0] for s, z in zip(seen.T, stacked.T, strict=True)]
        reference = np.stack(fits, axis=1)
        errors.append(np.nansum((stacked - basis @ reference) ** 2))
        if len(errors) > 1 and errors[-2] - errors[-1] <= 1e-6 * errors[-2]:
            return offsets, errors
        for i in range(len(sequences)):
            costs = [
                np.nansum((sequences[i] * root - periodic_basis(phase(i, o)) @ reference) ** 2)
                for o in range(int(np.ceil(periods[i])))
            ]
            offsets[i] = np.argmin(costs)


def walkers(seed, n, periods, m=3, noise=0.2, missing=0.1):
    """`n` sequences of one rhythm, at random phases, with noise and gaps; and their true offsets."""
    rng = np.random.default_rng(seed)
    size, start = rng.normal(size=(3, m)), rng.uniform(0, 6, (3, m))
    sequences, shifts = [], rng.integers(0, 20, n)
    for p, shift in zip(periods, shifts, strict=True):
        turn = 2 * np.pi * (np.arange(rng.integers(60, 120))[:, None] - shift) / p
        z = sum(size[k] * np.cos((k + 1) * turn + start[k]) for k in range(3))
        z += noise * rng.normal(size=z.shape)
        z[rng.random(z.shape) < missing] = np.nan
        sequences.append(z)
    return sequences, shifts


@pytest.mark.parametrize("fractional", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_identical_to_fig_6(seed, fractional):
    rng = np.random.default_rng(seed)
    periods = rng.integers(22, 40, 6) + (rng.integers(0, 4, 6) / 4 if fractional else 0)
    sequences, _ = walkers(seed, 6, periods)
    weights = rng.uniform(0.5, 2, 3)
    offsets, errors = fig_6(sequences, periods, weights)
    got = align(sequences, periods, weights=weights)
    np.testing.assert_array_equal(got.offsets, offsets)
    np.testing.assert_allclose(got.errors, errors, rtol=1e-9)


@given(st.integers(0, 2**32), st.integers(1, 8), st.floats(0, 3), st.floats(0, 0.7), st.booleans())
@settings(max_examples=40, deadline=None)
def test_error_never_rises(seed, n, noise, missing, fractional):
    periods = np.random.default_rng(seed).uniform(21, 45, n)
    periods = periods if fractional else np.round(periods)
    errors = align(walkers(seed, n, periods, noise=noise, missing=missing)[0], periods).errors
    assert (np.diff(errors) <= 1e-9 * errors[0]).all()


@given(st.integers(0, 2**32), st.integers(0, 100))
@settings(max_examples=25, deadline=None)
def test_a_later_start_is_an_earlier_offset(seed, k):
    """Among sequences in step, one that starts k frames later has its phase 0 k frames earlier, modulo its period."""
    cycle = walkers(seed, 1, [36], noise=0.0, missing=0.0)[0][0][:36]
    steady = np.tile(cycle, (6, 1))
    got = align([steady] * 5 + [steady[k:]], [36] * 6)
    assert np.mod(got.offsets - got.offsets[0], 36).tolist() == [0] * 5 + [-k % 36]


def test_true_offsets_come_back():
    periods = np.array([28, 31, 35, 26, 30])
    sequences, shifts = walkers(11, 5, periods, noise=0.05)
    got = align(sequences, periods)
    away = np.mod(got.offsets / periods - shifts / periods, 1)
    away = np.mod(away - away[0] + 0.5, 1) - 0.5
    assert np.abs(away).max() < 1 / 26
    np.testing.assert_allclose(got.phase(1, [got.offsets[1] + periods[1] / 2]), 0.5)


def test_reference_is_in_the_units_of_the_channels():
    sequences, _ = walkers(5, 3, [30, 30, 30], noise=0.0, missing=0.0)
    got = align(sequences, [30, 30, 30], weights=[100.0, 1.0, 0.01])
    curve = periodic_basis(got.phase(0, np.arange(len(sequences[0])))) @ got.reference
    assert np.abs(curve - sequences[0]).max() < 0.05 * np.abs(sequences[0]).max()


def test_refusals():
    z = np.random.default_rng(0).normal(size=(50, 2))
    with pytest.raises(MotionError, match="at least one"):
        align([], [])
    with pytest.raises(MotionError, match="same channels"):
        align([z, z[:, :1]], [20, 20])
    with pytest.raises(MotionError, match="periods"):
        align([z, z], [20, 20, 20])
    with pytest.raises(MotionError, match="periods"):
        align([z, z], [20, np.nan])
    with pytest.raises(MotionError, match="weights"):
        align([z, z], [20, 20], weights=[1.0, -1.0])
    with pytest.raises(GapError, match="no observations"):
        align([z, np.full((50, 2), np.nan)], [20, 20])
