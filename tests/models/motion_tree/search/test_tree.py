"""The tree of paper C against a literal one made of dicts, and its probabilities against what is drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import chisquare, norm

from benchmarks.tree.probabilities import log_prob, log_probability_of
from motionenv._core.compilation import kernel
from motionenv._core.random import key_of, restart
from motionenv.models.motion_tree.search.tree import LEAVES, SPLITS, CoefficientTree
from motionenv.models.motion_tree.search.tree_kernels import draw, is_whole, tail

BOTH = pytest.mark.parametrize("splits", SPLITS)
EITHER_LEAF = pytest.mark.parametrize("leaf", LEAVES)
#: Few windows with few different coefficients, so that ties, empty children and equal windows are common.
COEFFICIENTS = st.tuples(st.integers(1, 70), st.integers(1, 5)).flatmap(
    lambda shape: arrays(np.float32, shape, elements=st.sampled_from([-1.5, -0.25, 0.0, 0.25, 1.0]))
)


@kernel
def draw_one(nodes, starts, members, blocks, probe, beta, leaf, number, k, weights):
    """What `draw` gives for draw `number` of probe `k`, with 8 as the key."""
    state = np.empty(1, dtype=np.uint64)
    restart(state, key_of(8, number), k)
    return draw(nodes, starts, members, blocks, probe, beta, leaf, state, weights)


@kernel
def known_probability(nodes, starts, members, blocks, probe, position, beta, leaf, weights):
    return log_probability_of(nodes, starts, members, blocks, probe, position, beta, leaf, weights)


def blocks_of(z) -> np.ndarray:
    n, b = z.shape
    padded = np.full((-(-n // 32) * 32, b), np.inf, np.float32)
    padded[:n] = z
    return padded.reshape(-1, 32, b).transpose(0, 2, 1).copy()


def literal_tree(z, members, level, splits):
    """Section 4.1 as it stands: nodes are split at every level, down to the depth b; a child may be empty."""
    if level == z.shape[1]:
        return members
    values = z[members, level].astype(np.float64)
    threshold = np.float32(np.median(values)) if splits == "median" and len(members) else np.float32(0)
    return {
        "threshold": float(threshold),
        "left": literal_tree(z, members[values < threshold], level + 1, splits),
        "right": literal_tree(z, members[values >= threshold], level + 1, splits),
    }


def count(tree) -> int:
    return count(tree["left"]) + count(tree["right"]) if isinstance(tree, dict) else len(tree)


def literal_leaves(tree, probe, beta, level=0, probability=1.0):
    """Members of every leaf that holds some, and its probability by eq. 7 and 8; an empty child: the other is taken."""
    if not isinstance(tree, dict):
        yield tree, probability
        return
    right = norm.cdf((float(probe[level]) - tree["threshold"]) / np.sqrt(beta))
    if not count(tree["left"]) or not count(tree["right"]):
        right = float(count(tree["right"]) > 0)
    for side, share in (("left", 1 - right), ("right", right)):
        if count(tree[side]):
            yield from literal_leaves(tree[side], probe, beta, level + 1, probability * share)


def literal_probabilities(z, probe, beta, splits, leaf) -> np.ndarray:
    out = np.zeros(len(z))
    for members, probability in literal_leaves(literal_tree(z, np.arange(len(z)), 0, splits), probe, beta):
        square = ((z[members].astype(np.float64) - probe) ** 2).sum(1)
        share = np.exp(-(square - square.min()) / (2 * beta)) if leaf == "kernel" else np.ones(len(members))
        out[members] = probability * share / share.sum()
    return out


def example(n=300, b=6, seed=0):
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(n, b)).astype(np.float32)
    return z, blocks_of(z), rng.normal(size=(4, b)).astype(np.float32)


def all_log_prob(tree, blocks, probes, beta, leaf):
    return log_prob(tree, probes, np.tile(np.arange(len(tree)), (len(probes), 1)), beta, leaf, blocks)


@BOTH
@EITHER_LEAF
@pytest.mark.parametrize("beta", [0.05, 1.0])
@given(z=COEFFICIENTS, seed=st.integers(0, 1000))
def test_every_window_has_the_probability_of_the_literal_tree(splits, leaf, beta, z, seed):
    probe = np.random.default_rng(seed).normal(size=z.shape[1]).astype(np.float32)
    blocks = blocks_of(z)
    tree = CoefficientTree.build(blocks, len(z), splits)
    ours = np.exp(all_log_prob(tree, blocks, probe[None], beta, leaf)[0])
    assert_allclose(ours, literal_probabilities(z, probe, beta, splits, leaf), rtol=1e-5, atol=1e-9)
    assert_allclose(ours.sum(), 1.0, rtol=1e-12)


@BOTH
@given(z=COEFFICIENTS)
def test_leaves_are_those_of_the_literal_tree_from_left_to_right(splits, z):
    tree = CoefficientTree.build(blocks_of(z), len(z), splits)
    leaves = literal_leaves(literal_tree(z, np.arange(len(z)), 0, splits), np.zeros(z.shape[1]), 1.0)
    for k, (members, _) in enumerate(leaves):
        assert_array_equal(tree.members[tree.starts[k] : tree.starts[k + 1]], members)
        assert_array_equal(tree.leaf_of(members), k)
    assert len(tree.sizes) == k + 1
    assert tree.sizes.sum() == len(tree) == len(z)
    assert tree.largest == tree.sizes.max()


@BOTH
@EITHER_LEAF
@pytest.mark.parametrize("beta", [0.2, 2.0])
def test_draws_follow_the_literal_probabilities(splits, leaf, beta):
    z, blocks, probes = example(n=120, b=4)
    tree = CoefficientTree.build(blocks, len(z), splits)
    draws = 40_000
    drawn, log_probability = tree.draw(probes, draws, beta, 11, leaf, blocks)
    for k, probe in enumerate(probes):
        expected = draws * literal_probabilities(z, probe, beta, splits, leaf)
        seen = np.bincount(drawn[k], minlength=len(z))
        order = np.argsort(expected)[::-1]  # rare windows are counted together
        bins = np.minimum(np.arange(len(z)), max(1, (expected >= 10).sum() - 1))
        seen, expected = np.bincount(bins, seen[order]), np.bincount(bins, expected[order])
        assert chisquare(seen, expected * seen.sum() / expected.sum()).pvalue > 1e-4
    assert_allclose(log_probability, log_prob(tree, probes, drawn, beta, leaf, blocks), rtol=1e-9, atol=1e-9)


@BOTH
@EITHER_LEAF
def test_a_large_tree_has_probability_one_and_says_what_it_draws(splits, leaf):
    z, blocks, probes = example(n=20_011, b=14)
    tree = CoefficientTree.build(blocks, len(z), splits)
    assert_allclose(np.exp(all_log_prob(tree, blocks, probes, 0.3, leaf)).sum(1), 1.0, rtol=1e-9)
    drawn, log_probability = tree.draw(probes, 50, 0.3, 5, leaf, blocks)
    assert (drawn.dtype, log_probability.dtype) == (np.int32, np.float64)
    assert_allclose(log_probability, log_prob(tree, probes, drawn, 0.3, leaf, blocks), rtol=1e-9)


@pytest.mark.parametrize(("n", "b"), [(1024, 7), (1000, 7), (5000, 12)])
def test_median_splits_give_a_balanced_tree(n, b):
    _, blocks, _ = example(n, b)
    tree = CoefficientTree.build(blocks, n, "median")
    assert len(tree.sizes) == 2**b
    assert tree.sizes.min() >= n // 2**b
    assert tree.sizes.max() <= -(-n // 2**b)


def test_sign_splits_give_the_leaves_by_sign_code():
    z, blocks, _ = example(n=5000, b=12)
    tree = CoefficientTree.build(blocks, len(z), "sign")
    codes = ((z >= 0) * 2 ** np.arange(11, -1, -1)).sum(1)
    assert_array_equal(tree.leaf_of(np.arange(len(z))), np.unique(codes, return_inverse=True)[1])


@BOTH
@EITHER_LEAF
def test_at_low_temperature_the_search_follows_the_probe(splits, leaf):
    z, blocks, _ = example(n=2000, b=10)
    tree = CoefficientTree.build(blocks, len(z), splits)
    away = np.abs(z).min(1) if splits == "sign" else np.full(len(z), np.inf)
    own = np.flatnonzero(away > 1e-3)
    for beta in (1e-9, 5e-324):
        drawn, log_probability = tree.draw(z[own], 3, beta, 1, leaf, blocks)
        same = tree.leaf_of(drawn) == tree.leaf_of(own)[:, None]
        assert same.all() if splits == "sign" else same.mean() > 0.5  # a probe on its own threshold goes either way
        if leaf == "kernel" and splits == "sign":
            assert_array_equal(drawn, np.repeat(own[:, None], 3, 1))
            assert_allclose(log_probability, 0.0, atol=1e-12)


@EITHER_LEAF
def test_what_is_never_drawn_has_probability_zero(leaf):
    z = np.array([[-3.0], [3.0], [90.0]], np.float32)
    tree = CoefficientTree.build(blocks_of(z), 3, "sign")
    found = log_prob(tree, [[3.0]], [[0, 1, 2]], 0.1, leaf, blocks_of(z))[0]
    certain = [-np.inf, 0.0, -np.inf] if leaf == "kernel" else [-np.inf, -np.log(2), -np.log(2)]
    assert_allclose(found, certain, atol=1e-12)


@BOTH
@EITHER_LEAF
@pytest.mark.parametrize("n", [1, 2, 33, 500])
@pytest.mark.parametrize("b", [1, 3])
def test_equal_windows_share_one_leaf(splits, leaf, n, b):
    z = np.full((n, b), 0.7, np.float32)
    blocks = blocks_of(z)
    tree = CoefficientTree.build(blocks, n, splits)
    assert (len(tree.sizes), tree.largest) == (1, n)
    drawn, log_probability = tree.draw(np.full((20, b), 3.0, np.float32), 10, 0.05, 3, leaf, blocks)
    assert_allclose(log_probability, -np.log(n), atol=1e-12)
    assert n < 33 or len(np.unique(drawn)) > 20


def test_depth_is_not_bound_to_a_word():
    z = -np.ones((100, 100), np.float32)
    z[np.tri(100, k=-1, dtype=bool)] = 1.0  # window i is on the right i times, then on the left
    blocks = blocks_of(z)
    tree = CoefficientTree.build(blocks, 100, "sign")
    assert_array_equal(tree.leaf_of(np.arange(100)), np.arange(100))
    probe = np.full((1, 100), 5.0, np.float32)
    assert_allclose(log_prob(tree, probe, [[0]], 1.0, "uniform", blocks)[0, 0], norm.logcdf(-5), rtol=1e-5)
    drawn, log_probability = tree.draw(-z[-1:], 3, 0.02, 0, "uniform", blocks)
    assert_allclose(log_probability, log_prob(tree, -z[-1:], drawn, 0.02, "uniform", blocks), rtol=1e-9)


def test_a_product_of_unlikely_branches_does_not_underflow():
    z, blocks, _ = example(n=3000, b=40)
    tree = CoefficientTree.build(blocks, len(z), "sign")
    far = -7.5 * np.sign(z[:1])
    found = log_prob(tree, far, [[0]], 1.0, "uniform", blocks)[0, 0]
    levels = round(found / norm.logcdf(-7.5))
    assert levels >= 8
    assert_allclose(found, levels * norm.logcdf(-7.5), rtol=1e-5)


@BOTH
@EITHER_LEAF
def test_draws_do_not_depend_on_batches_threads_or_calls(splits, leaf):
    z, blocks, _ = example(n=3000, b=11)
    tree = CoefficientTree.build(blocks, len(z), splits)
    probes = np.random.default_rng(5).normal(size=(2100, 11)).astype(np.float32)  # enough for threads
    drawn, log_probability = tree.draw(probes, 2, 0.1, 2**64 - 1, leaf, blocks)
    for last in (1, 40, 1300):
        again = tree.draw(probes[:last], 2, 0.1, 2**64 - 1, leaf, blocks)
        assert_array_equal(again[0], drawn[:last])
        assert_array_equal(again[1], log_probability[:last])
    assert_array_equal(tree.draw(probes, 1, 0.1, 2**64 - 1, leaf, blocks)[0], drawn[:, :1])
    assert (tree.draw(probes, 2, 0.1, 0, leaf, blocks)[0] != drawn).mean() > 0.5


@BOTH
@EITHER_LEAF
def test_one_probe_at_a_time_gives_the_same_draws(splits, leaf):
    z, blocks, probes = example(n=700, b=9)
    tree = CoefficientTree.build(blocks, len(z), splits)
    drawn, log_probability = tree.draw(probes, 5, 0.5, 8, leaf, blocks)
    parts, weights = (tree.nodes, tree.starts, tree.members, blocks), np.empty(tree.largest)
    for k, probe in enumerate(probes):
        one = np.array([draw_one(*parts, probe, 0.5, leaf == "kernel", j, k, weights) for j in range(5)])
        assert_array_equal(one[:, 0], drawn[k])
        assert_allclose(one[:, 1], log_probability[k], rtol=1e-12)
        known = known_probability(*parts, probe, drawn[k, 0], 0.5, leaf == "kernel", weights)
        assert_allclose(known, log_probability[k, 0], rtol=1e-12)


def test_the_tree_is_read_only_and_the_same_each_time():
    _, blocks, _ = example()
    a, b = (CoefficientTree.build(blocks, 300, "median") for _ in range(2))
    for name in ("nodes", "starts", "members"):
        assert_array_equal(getattr(a, name), getattr(b, name))
        with pytest.raises(ValueError, match="read-only"):
            getattr(a, name)[0] = 0


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
