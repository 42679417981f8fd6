"""The loops of the coefficient tree: its normal tail against SciPy's, its build against a sorted list."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import norm

from motionenv._core.compilation import kernel
from motionenv.models.motion_tree.search.tree import CoefficientTree
from motionenv.models.motion_tree.search.tree_kernels import is_whole, tail


@kernel
def tails(x):
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = tail(x[i])
    return out


def test_the_tail_is_that_of_the_normal_distribution():
    x = np.linspace(0, 8, 20_001)[:-1]
    ours = tails(x)
    assert_allclose(ours, norm.sf(x), rtol=1e-6, atol=0)
    assert np.abs(ours - norm.sf(x)).max() < 1e-10
    assert (np.diff(ours) < 0).all()
    assert not tails(np.array([8.0, np.inf])).any()


@pytest.fixture(scope="module")
def blocks() -> np.ndarray:
    """100 points of 6 coordinates in blocks of 32, the last one padded with infinity."""
    padded = np.full((128, 6), np.inf, np.float32)
    padded[:100] = np.random.default_rng(0).normal(size=(100, 6))
    return padded.reshape(4, 32, 6).transpose(0, 2, 1).copy()


@pytest.mark.parametrize("splits", ["sign", "median"])
def test_a_tree_that_is_cut_or_tied_into_a_loop_is_not_whole(blocks, splits):
    tree = CoefficientTree.build(blocks, 100, splits)
    parts = [np.array(part) for part in (tree.nodes, tree.starts, tree.members)]
    assert_array_equal(np.sort(parts[2]), np.arange(100))
    assert is_whole(*parts, 6)
    for child in ("left", "right"):
        looped = parts[0].copy()
        looped[child][-1] = 0
        assert not is_whole(looped, *parts[1:], 6)
        outside = parts[0].copy()
        outside[child][0] = len(parts[0])
        assert not is_whole(outside, *parts[1:], 6)
    assert not is_whole(parts[0], parts[1], np.r_[parts[2][:-1], 100], 6)
