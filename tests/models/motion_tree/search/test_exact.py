"""The honest sampler against brute force in double precision."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import logsumexp
from scipy.stats import chisquare

from motionenv.errors import MotionError
from motionenv.models.motion_tree.search.exact import ExactSampler

BETAS = (0.002, 0.05, 0.2, 1.0)


def build(z) -> tuple[ExactSampler, np.ndarray]:
    """A sampler of points z (n, b), and these in single precision."""
    z = np.asarray(z, np.float32)
    rows = np.zeros((-(-len(z) // 32) * 32, z.shape[1]), np.float32)
    rows[: len(z)] = z
    return ExactSampler.build(rows, len(z)), z


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
def curves() -> tuple[ExactSampler, np.ndarray]:
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
        index.draw(probe[None], 20000, beta, 5),
        index.draw(np.repeat(probe[None], 20000, 0), 1, beta, 5),
    )
    for drawn, log_probability in (of_one, of_many):
        check(drawn.ravel(), p)
        assert_allclose(np.exp(log_probability), p[drawn], rtol=1e-9)


@pytest.mark.parametrize("beta", BETAS)
def test_total_variation_is_that_of_a_multinomial_of_the_same_size(curves, beta):
    index, z = curves
    p = probabilities(z, z[77] + 0.1, beta)
    size = 200000

    def variation(counts):
        return 0.5 * np.abs(counts / size - p).sum()

    drawn = index.draw((z[77] + 0.1)[None], size, beta, 3)[0][0]
    ideal = [variation(c) for c in np.random.default_rng(0).multinomial(size, p, 30)]
    assert variation(np.bincount(drawn, minlength=len(z))) < np.mean(ideal) + 6 * np.std(ideal) + 1e-5


@pytest.mark.parametrize("beta", [1e-300, 1e-30, 1e-7, 1e3, 1e37, 1e300])
@pytest.mark.parametrize("away", [0.0, 1.0, 30.0, 1e4, 1e12])
def test_extreme_temperatures_and_distances(curves, beta, away):
    index, z = curves
    probe = np.float32(z[400] + away)
    x = log_kernel(z, probe, max(beta, 1e-30))
    (drawn,), log_probability = index.draw(probe[None], 300, beta, 9)
    assert np.isfinite(log_probability).all()
    # rounding of the probe's distances is all that may tell them apart
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
    check(index.draw(probe[None], 20000, 1200.0, 4)[0][0], p)
    assert p.max() > 0.05
    assert index.draw(probe[None], 50, beta, 4)[0].min() == probabilities(z, probe, beta).argmax()


@settings(deadline=None, max_examples=60)
@given(
    z=st.tuples(st.integers(1, 300), st.integers(1, 9)).flatmap(
        lambda shape: arrays(np.float32, shape, elements=st.sampled_from([-1.5, -0.5, 0.0, 0.25, 1.0]))
    ),
    beta=st.sampled_from([0.01, 0.3, 2.0]),
    shift=st.sampled_from([0.0, 0.2, 5.0]),
)
def test_any_small_set_with_ties_and_duplicates(z, beta, shift):
    index, z = build(z)
    assert_array_equal(index.coefficients(np.arange(len(z))), z)
    probe = (z[len(z) // 2] + np.float32(shift)).astype(np.float32)
    p = probabilities(z, probe, beta)
    (drawn,), log_probability = index.draw(probe[None], 2000, beta, 11)
    check(drawn, p)
    assert_allclose(np.exp(log_probability[0]), p[drawn], rtol=1e-9)


def test_one_point_is_always_drawn():
    index, _ = build([[1.0, 2.0]])
    assert (np.array(index.draw(np.zeros((3, 2)), 4, 0.1, 0)) == 0).all()  # log-probabilities too


def test_draws_depend_on_key_and_number_of_the_probe_only(curves):
    index, z = curves
    probes = z[:1600] + np.float32(0.1)
    whole, _ = index.draw(probes, 2, 0.05, 2**64 - 1)
    assert_array_equal(whole, index.draw(probes, 2, 0.05, 2**64 - 1)[0])
    assert_array_equal(whole[:3], index.draw(probes[:3], 2, 0.05, 2**64 - 1)[0])  # one thread, not three
    assert_array_equal(whole[:, :1], index.draw(probes, 1, 0.05, 2**64 - 1)[0])
    assert (whole != index.draw(probes, 2, 0.05, 1)[0]).any()


def test_more_points_than_are_rearranged_at_a_time():
    index, z = build(np.random.default_rng(0).normal(size=(140001, 4)))
    blocks, n = index.blocks.transpose(0, 2, 1).reshape(-1, 4), len(z)
    assert_array_equal(blocks[:n], z)
    assert np.isinf(blocks[n:]).all()
    check(index.draw(np.zeros((1, 4)), 20000, 0.2, 1)[0][0], probabilities(z, np.zeros(4), 0.2))


@pytest.mark.parametrize("beta", [0.0, -1.0, np.nan, np.inf, 1j, "warm"])
def test_temperatures_that_cannot_be(curves, beta):
    with pytest.raises(MotionError, match="beta .*above 0, got"):
        curves[0].draw(np.zeros((1, 13)), 1, beta, 0)


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
