"""Cycles with gaps against sums over every single sample."""

import numpy as np
import pytest

from motionenv.models.fpca.fourier_basis import sampled_basis
from motionenv.models.fpca.observations import (
    Observations,
    from_triangle,
    functions,
    group_centres,
    missed,
    running,
    triangle,
)
from tests.models.fpca.made_cycles import with_gaps

GROUPS = np.arange(50) % 3


@pytest.fixture(scope="module")
def values():
    """Fifty cycles of 24 samples in 3 channels; no cycle shows sample 5 of channel 1, group 2 lacks more."""
    values = with_gaps(2.0 + np.random.default_rng(0).standard_normal((50, 24, 3)), 0.3)[0]
    values[:, 5, 1] = np.nan
    values[GROUPS == 2, 10:14, 0] = np.nan
    return values


@pytest.fixture(scope="module")
def basis():
    return sampled_basis(24, 5)


@pytest.fixture(scope="module")
def data(values, basis):
    return Observations(values, basis, group_centres(values, GROUPS, basis), GROUPS)


def deviations(data, values) -> np.ndarray:
    """What is seen less the centre of its group, 0 in gaps."""
    return np.nan_to_num(values - (data.basis @ data.centre)[GROUPS])


def test_a_groups_centre_is_its_mean_and_gaps_in_it_are_filled(values):
    """By the mean of all where only the group lacks a sample, between the neighbours where everyone does."""
    values, whole = values[:, :23], sampled_basis(23, 12)  # as many columns as samples: nothing is smoothed away
    centre = whole @ group_centres(values, GROUPS, whole)
    for g in range(3):
        own = np.array([[np.mean([v for v in values[g == GROUPS, p, a] if v == v] or [np.nan]) for a in range(3)]
                        for p in range(23)])  # fmt: skip
        if g == 2:
            assert np.isnan(own[10:14, 0]).all()
            own[10:14, 0] = np.nanmean(values[:, 10:14, 0], axis=0)
        pooled = np.nanmean(values[:, [4, 6], 1], axis=0)
        own[5, 1] = pooled.mean()
        np.testing.assert_allclose(centre[g], own, atol=1e-12)


def test_coefficients_squares_and_gaps_are_those_of_every_sample(data, values):
    y, lack = deviations(data, values), np.isnan(values)
    np.testing.assert_allclose(data.coefficients, (data.basis.T @ y).reshape(50, -1), atol=1e-12)
    np.testing.assert_allclose(data.square, (y**2).sum(axis=1), atol=1e-12)
    np.testing.assert_allclose(data.squares, (y**2).sum(axis=(0, 1)))
    told = np.zeros((50, 25 * 3))
    for k in range(50):
        for first, last in data.runs[data.offsets[k] : data.offsets[k + 1]]:
            told[k, first:last:3] += 1
    np.testing.assert_array_equal(told.reshape(50, 25, 3)[:, :24], lack)
    assert (data.n_seen, data.sizes.tolist()) == ((~lack).sum(), [17, 17, 16])
    for g in range(3):
        np.testing.assert_array_equal(data.n_missing[g], lack[g == GROUPS].sum(axis=0).ravel())
        np.testing.assert_allclose(data.y_sum[g], data.coefficients[g == GROUPS].sum(axis=0), atol=1e-12)


def test_a_part_of_the_cycles_is_what_they_alone_would_be(data, values):
    part, alone = data.every(7), Observations(values[::7], data.basis, data.centre, GROUPS[::7])
    for name in ("centre", "groups", "n", "n_seen", "squares", "y_sum", "sizes", "n_missing"):
        np.testing.assert_array_equal(getattr(part, name), getattr(alone, name), err_msg=name)


def test_sums_over_gaps_are_those_over_what_is_missing(data, values):
    table = np.random.default_rng(2).standard_normal((24, 3, 4))
    np.testing.assert_allclose(data.gap_sums(table), np.einsum("kpa,pac->kc", np.isnan(values), table), atol=1e-12)
    edges = np.zeros((25 * 3, 1))
    for first, last in data.runs:
        edges[first] += 1
        edges[last] -= 1
    np.testing.assert_array_equal(missed(edges, 3)[:, 0], np.isnan(values).sum(axis=0).ravel())


def test_tables_of_sums_functions_and_triangles_are_undone():
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((7, 2, 3))
    np.testing.assert_allclose(np.diff(running(rows), axis=0), rows, atol=1e-12)
    half = rng.standard_normal((4, 5, 5))
    whole = half + half.swapaxes(1, 2)
    assert triangle(whole).shape == (4, 15)
    np.testing.assert_array_equal(from_triangle(triangle(whole), 5), whole)
    basis, curves = sampled_basis(12, 3), functions(np.eye(10), sampled_basis(12, 3), 2)
    for i in range(10):
        expected = np.zeros((12, 2))
        expected[:, i % 2] = basis[:, i // 2]
        np.testing.assert_array_equal(curves[..., i], expected)
