"""Signs and rank of principal axes don't change with rounding errors."""

import numpy as np
import pytest

from motionenv._core.principal_axes import numerical_rank, signs


def test_the_largest_entry_becomes_positive():
    axes = np.random.default_rng(0).standard_normal((20, 7))
    turned = signs(axes)[:, None] * axes
    np.testing.assert_array_equal(turned.max(axis=1), np.abs(axes).max(axis=1))


@pytest.mark.parametrize("error", [-1e-7, 0.0, 1e-7])
def test_rounding_errors_decide_no_tie(error):
    """One period of a sine, or left against right: the greatest entry is as large as the least."""
    wave = np.sin(2 * np.pi * np.arange(64) / 64)
    wave[48] += error
    assert signs(wave[None]) == [1.0]
    assert signs(-wave[None]) == [-1.0]


@pytest.mark.parametrize("rank", [0, 1, 4])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_the_rank_is_that_of_the_data_about_their_mean(rank, offset):
    rng = np.random.default_rng(rank)
    data = offset + rng.standard_normal((40, rank)) @ rng.standard_normal((rank, 9))
    centred = data - data.mean(axis=0)
    assert numerical_rank(np.linalg.svd(centred)[1], data.shape, np.linalg.norm(data)) == rank
