"""The honest sampler against brute force in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import logsumexp
from scipy.stats import chisquare

from motionenv.errors import MotionError
from motionenv.models.motion_tree.search.kernel_index import KernelIndex
from motionenv.models.motion_tree.search.kernel_index_kernels import gather, scratch

BETAS = (0.002, 0.05, 0.2, 1.0)


def build(z) -> tuple[KernelIndex, np.ndarray]:
    """An index of points z (n, b), and the points in its order."""
    z = np.asarray(z, np.float32)
    rows = np.zeros((-(-len(z) // 32) * 32, z.shape[1]), np.float32)
    rows[: len(z)] = z
    order = np.arange(len(z), dtype=np.int32)
    index = KernelIndex.build(rows, order)
    return index, z[order]


def log_kernel(z, probe, beta) -> np.ndarray:
    return -((z.astype(np.float64) - np.float32(probe)) ** 2).sum(1) / (2 * beta)


def probabilities(z, probe, beta) -> np.ndarray:
    x = log_kernel(z, probe, beta)
    return np.exp(x - logsumexp(x))


def check(drawn, p) -> None:
    """The draws are of p: chi-square over points in groups of equal expectation, none impossible."""
    assert drawn.min() >= 0
    assert drawn.max() < len(p)
    assert (p[drawn] > 1e-12).all()
    groups = np.minimum(np.cumsum(p) * min(50, len(drawn) // 40), 49).astype(int)
    expected = np.bincount(groups, p) * len(drawn)
    seen = np.bincount(groups[drawn], minlength=len(expected))
    kept = expected > 5
    if kept.sum() > 1:
        seen, expected = seen[kept], expected[kept] * seen[kept].sum() / expected[kept].sum()
        assert chisquare(seen, expected).pvalue > 1e-5


@pytest.fixture(scope="module")
def curves() -> tuple[KernelIndex, np.ndarray]:
    """5001 points on smooth curves in 13 dimensions, as windows of motion are."""
    rng = np.random.default_rng(0)
    t = np.linspace(0, 40, 5001)[:, None]
    z = sum(rng.normal(size=13) * np.sin(rng.uniform(0.3, 3, 13) * t + rng.uniform(0, 6, 13)) for _ in range(4))
    return build(z + 0.05 * rng.normal(size=z.shape))


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3, 3.0])
@pytest.mark.parametrize("beta", BETAS)
def test_draws_have_the_kernels_probabilities(curves, beta, noise):
    index, z = curves
    rng = np.random.default_rng(1)
    probe = (z[1234] + noise * rng.normal(size=13)).astype(np.float32)
    p = probabilities(z, probe, beta)
    of_one, of_many = (
        index.draw(probe[None], 20000, beta, 5)[0],
        index.draw(np.repeat(probe[None], 20000, 0), 1, beta, 5),
    )
    check(of_one, p)
    check(of_many[:, 0], p)


@pytest.mark.parametrize("beta", BETAS)
def test_total_variation_is_that_of_a_multinomial_of_the_same_size(curves, beta):
    index, z = curves
    p = probabilities(z, z[77] + 0.1, beta)
    size = 200000

    def variation(counts):
        return 0.5 * np.abs(counts / size - p).sum()

    drawn = index.draw((z[77] + 0.1)[None], size, beta, 3)[0]
    ideal = [variation(c) for c in np.random.default_rng(0).multinomial(size, p, 30)]
    assert variation(np.bincount(drawn, minlength=len(z))) < np.mean(ideal) + 6 * np.std(ideal) + 1e-5


@pytest.mark.parametrize("beta", [1e-300, 1e-30, 1e-7, 1e3, 1e37, 1e300])
@pytest.mark.parametrize("away", [0.0, 1.0, 30.0, 1e4, 1e12])
def test_extreme_temperatures_and_distances(curves, beta, away):
    index, z = curves
    probe = np.float32(z[400] + away)
    x = log_kernel(z, probe, max(beta, 1e-30))
    drawn = index.draw(probe[None], 300, beta, 9)[0]
    assert np.isfinite(index.log_normaliser(probe[None], beta)).all()
    # rounding of the probe's distances to the box's scale is all that may tell them apart
    assert (x[drawn] > x.max() - 40 - 1e-6 * abs(x.max())).all()
    if x.max() - np.sort(x)[-2] > 40 + 1e-6 * abs(x.max()):
        assert (drawn == x.argmax()).all()
    if np.ptp(x) < 1e-3:
        check(drawn, np.full(len(z), 1 / len(z)))


def test_far_probes_are_drawn_in_double_precision():
    """Kernels e⁻¹⁰⁰⁰⁰⁰⁰ that differ by little: single precision would miss the exponent's difference by 0.1."""
    rng = np.random.default_rng(4)
    index, z = build(rng.normal(size=(40, 3)))
    probe = np.float32([900.0, 900.0, 900.0])
    beta = 1.2
    p = probabilities(z, probe, 1200.0)
    check(index.draw(probe[None], 20000, 1200.0, 4)[0], p)
    assert p.max() > 0.05
    assert index.draw(probe[None], 50, beta, 4).min() == probabilities(z, probe, beta).argmax()


@settings(deadline=None, max_examples=60)
@given(
    z=st.tuples(st.integers(1, 300), st.integers(1, 9)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.sampled_from([-1.5, -0.5, 0.0, 0.25, 1.0]))
    ),
    beta=st.sampled_from([0.01, 0.3, 2.0]),
    shift=st.sampled_from([0.0, 0.2, 5.0]),
)
def test_any_small_set_with_ties_and_duplicates(z, beta, shift):
    index, ordered = build(z)
    assert sorted(map(tuple, ordered)) == sorted(map(tuple, z))
    assert_array_equal(index.coefficients(np.arange(len(z))), ordered)
    probe = (ordered[len(z) // 2] + np.float32(shift)).astype(np.float32)
    p = probabilities(ordered, probe, beta)
    check(index.draw(probe[None], 2000, beta, 11)[0], p)
    expected = logsumexp(log_kernel(ordered, probe, beta))
    assert -0.0101 - 1e-5 < index.log_normaliser(probe[None], beta)[0] - expected < 1e-4


def test_one_point_is_always_drawn():
    index, _ = build([[1.0, 2.0]])
    assert (index.draw(np.zeros((3, 2)), 4, 0.1, 0) == 0).all()
    assert_allclose(index.log_normaliser(np.zeros((1, 2)), 0.1), -25.0)


def test_draws_depend_on_key_and_number_of_the_probe_only(curves):
    index, z = curves
    probes = z[:1600] + np.float32(0.1)
    whole = index.draw(probes, 2, 0.05, 2**64 - 1)
    assert_array_equal(whole, index.draw(probes, 2, 0.05, 2**64 - 1))
    assert_array_equal(whole[:3], index.draw(probes[:3], 2, 0.05, 2**64 - 1))  # one thread, not three
    assert_array_equal(whole[:, :1], index.draw(probes, 1, 0.05, 2**64 - 1))
    assert (whole != index.draw(probes, 2, 0.05, 1)).any()


@pytest.mark.parametrize("beta", BETAS)
def test_normaliser_is_within_its_tolerance(curves, beta):
    index, z = curves
    rng = np.random.default_rng(2)
    probes = (
        z[rng.integers(len(z), size=60)] + rng.choice([0, 0.1, 0.5, 4], (60, 1)) * rng.normal(size=(60, 13))
    ).astype(np.float32)
    expected = np.array([logsumexp(log_kernel(z, q, beta)) for q in probes])
    ratio = np.exp(index.log_normaliser(probes, beta) - expected)
    assert (ratio <= 1 + 1e-4).all()
    assert (ratio >= 1 - 0.01 - 1e-4).all()


def test_log_kernel_is_that_of_brute_force(curves):
    index, z = curves
    positions = np.array([[3, 5000], [70, 64]])
    expected = [log_kernel(z, z[9], 0.3)[positions[0]], log_kernel(z, z[8], 0.3)[positions[1]]]
    assert_allclose(index.log_kernel(z[[9, 8]], positions, 0.3), expected, rtol=1e-12)


def test_probabilities_of_all_points_sum_to_one(curves):
    index, z = curves
    every = np.arange(len(z))[None]
    total = np.exp(index.log_kernel(z[:1], every, 0.2) - index.log_normaliser(z[:1], 0.2)).sum()
    assert_allclose(total, 1, atol=0.011)


def test_threads_build_the_same_kind_of_index():
    rng = np.random.default_rng(0)
    index, z = build(rng.normal(size=(140001, 4)))
    blocks, n = index.blocks.transpose(0, 2, 1).reshape(-1, 4), len(z)
    assert_array_equal(blocks[:n], z)
    assert np.isinf(blocks[n:]).all()
    p = probabilities(z, np.zeros(4), 0.2)
    check(index.draw(np.zeros((1, 4)), 20000, 0.2, 1)[0], p)


def test_boxes_hold_their_points(curves):
    index, z = curves
    leaves = index.boxes[-math.ceil(len(z) / 256) :].transpose(0, 2, 1, 3).reshape(-1, 2, index.boxes.shape[3])
    for leaf in range(-(-len(z) // 16)):
        points = z[16 * leaf : 16 * leaf + 16]
        assert_array_equal(leaves[leaf, :, :13], [points.min(0), points.max(0)])


@pytest.mark.parametrize("beta", [0.0, -1.0, np.nan, np.inf, 1j, "warm"])
def test_temperatures_that_cannot_be(curves, beta):
    for call in (
        lambda: curves[0].draw(np.zeros((1, 13)), 1, beta, 0),
        lambda: curves[0].log_normaliser([[0] * 13], beta),
    ):
        with pytest.raises(MotionError, match="beta .*above 0, got"):
            call()


def test_requests_that_cannot_be(curves):
    index, _ = curves
    with pytest.raises(MotionError, match=r"probes must have shape \(probes, 13\), got \(1, 12\)"):
        index.draw(np.zeros((1, 12)), 1, 0.1, 0)
    broken = np.zeros((3, 13))
    for value in (np.nan, np.inf, 1e20):
        broken[2, 4] = value
        with pytest.raises(MotionError, match="probes must be finite numbers .* in probe 2"):
            index.draw(broken, 1, 0.1, 0)
    for count in (0, -3, 1.5, True):
        with pytest.raises(MotionError, match="count must be a whole number from 1, got"):
            index.draw(np.zeros((1, 13)), count, 0.1, 0)


@pytest.mark.parametrize("beta", BETAS)
def test_all_but_a_share_of_the_sum_is_gathered_and_none_twice(curves, beta):
    index, z = curves
    work = scratch(index.n, index.boxes.shape[3])
    for tolerance in (0.1, 1e-3, 1e-6):
        for probe in z[::500] + np.float32(0.2):
            found, best = gather(index.blocks, index.boxes, index.n, probe, 0.5 / beta, tolerance, work)
            leaves, weights, sums = (part[:found] for part in work[-3:])
            away = ((z.astype(np.float64) - probe) ** 2).sum(axis=1)
            assert_allclose(best, away.min(), rtol=1e-12)
            assert len(set(leaves)) == found
            assert_allclose(np.cumsum(weights.sum(axis=1)), sums, rtol=1e-12)
            whole = np.exp((best - away) * (0.5 / beta)).sum()
            assert whole * (1 - tolerance) <= sums[-1] <= whole * (1 + 1e-12)
