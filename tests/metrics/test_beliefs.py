"""Energy score and coverage against brute force, closed forms, and what they promise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gammaln
from scipy.stats import kstest, norm

from motionenv.errors import MotionError
from motionenv.metrics import coverage, credible_level, energy_score

SEEDS = st.integers(0, 2**32 - 1)


def belief(seed, n=3, m=11, deviation=0.2):
    """Samples (n, m, 15, 3) about 0, log weights (n, m) and truths (n, 15, 3)."""
    rng = np.random.default_rng(seed)
    samples, truth = rng.normal(0, deviation, (n, m, 15, 3)), rng.normal(0, deviation, (n, 15, 3))
    return samples, 2 * rng.standard_normal((n, m)), truth


def by_definition(samples, log_weights, truth) -> list[float]:
    scores = []
    for x, log_w, y in zip(samples, log_weights, truth, strict=True):
        w = np.exp(log_w) / np.exp(log_w).sum()
        near = sum(w[i] * np.linalg.norm(x[i] - y) for i in range(len(w)))
        pairs = [(i, j) for i in range(len(w)) for j in range(len(w))]
        scores.append(near - 0.5 * sum(w[i] * w[j] * np.linalg.norm(x[i] - x[j]) for i, j in pairs))
    return scores


@given(SEEDS, st.integers(1, 20))
@settings(max_examples=30, deadline=None)
def test_energy_score_is_its_definition(seed, m):
    case = belief(seed, m=m)
    np.testing.assert_allclose(energy_score(*case), by_definition(*case), rtol=2e-6)


def test_far_from_the_origin_nothing_is_lost():
    samples, weights, truth = belief(0, deviation=0.001)
    np.testing.assert_allclose(
        energy_score(samples + 90, weights, truth + 90), by_definition(samples, weights, truth), rtol=1e-5
    )


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_energy_score_of_one_pose_is_its_distance_and_of_the_truth_is_0(seed):
    samples, weights, truth = belief(seed, m=1)
    np.testing.assert_allclose(
        energy_score(samples, weights, truth), np.linalg.norm((samples[:, 0] - truth).reshape(3, -1), axis=-1)
    )
    assert (energy_score(np.repeat(truth[:, None], 7, axis=1), np.zeros((3, 7)), truth) == 0).all()


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_splitting_leaving_out_order_and_constants_do_not_matter(seed):
    samples, weights, truth = belief(seed)
    score = energy_score(samples, weights, truth)
    order = np.random.default_rng(seed).permutation(11)
    split = np.concatenate([weights, weights], axis=1)
    unused = np.concatenate([weights, np.full_like(weights, -np.inf)], axis=1)
    np.testing.assert_allclose(energy_score(samples[:, order], weights[:, order] + 700, truth), score, rtol=1e-5)
    np.testing.assert_allclose(energy_score(np.tile(samples, (1, 2, 1, 1)), split, truth), score, rtol=1e-5)
    np.testing.assert_allclose(energy_score(np.concatenate([samples, samples + 1], 1), unused, truth), score, rtol=1e-5)
    assert (score >= 0).all()


def test_on_one_coordinate_it_is_the_crps_of_a_gaussian():
    m, mean, deviation = 2000, 0.3, 0.7
    samples, truth = np.zeros((2, m, 15, 3)), np.zeros((2, 15, 3))
    samples[:, :, 4, 1] = norm.ppf((np.arange(m) + 0.5) / m, mean, deviation)
    truth[:, 4, 1] = -0.2, 1.5
    z = (truth[:, 4, 1] - mean) / deviation
    crps = deviation * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))  # Gneiting & Raftery, eq. 5
    np.testing.assert_allclose(energy_score(samples, np.zeros((2, m)), truth), crps, atol=1e-4)


def test_of_an_isotropic_gaussian_it_is_what_chi_says():
    m, deviation = 3000, 0.1
    samples = np.random.default_rng(0).normal(0, deviation, (1, m, 15, 3))
    chi = np.sqrt(2) * np.exp(gammaln(23) - gammaln(22.5))  # mean of the chi distribution with 45 degrees of freedom
    score = energy_score(samples, np.zeros((1, m)), np.zeros((1, 15, 3)), fair=True)
    assert score == pytest.approx(deviation * chi * (1 - np.sqrt(2) / 2), rel=0.01)


def test_fair_scores_do_not_depend_on_how_many_samples_there_are():
    rng = np.random.default_rng(0)
    few, many = (rng.standard_normal((4000, m, 15, 3)) for m in (2, 20))
    truth = rng.standard_normal((4000, 15, 3))
    a, b = (energy_score(x, np.zeros(x.shape[:2]), truth, fair=True) for x in (few, many))
    assert abs(a.mean() - b.mean()) < 4 * np.hypot(a.std(), b.std()) / np.sqrt(4000)
    plain = energy_score(few, np.zeros((4000, 2)), truth)
    assert plain.mean() > b.mean() + 0.5


@pytest.mark.parametrize("wrong", [{"deviation": 0.8}, {"deviation": 1.25}, {"shift": 0.2}])
def test_it_is_proper(wrong):
    """Truths drawn from the belief: to report it scores best, sharper, broader and shifted ones score worse."""
    rng = np.random.default_rng(1)
    n, m = 2000, 100
    truth = rng.standard_normal((n, 15, 3))
    draws = rng.standard_normal((n, m, 15, 3))
    other = wrong.get("deviation", 1.0) * draws + wrong.get("shift", 0.0)
    loss = energy_score(other, np.zeros((n, m)), truth) - energy_score(draws, np.zeros((n, m)), truth)
    assert loss.mean() > 3 * loss.std() / np.sqrt(n)


def test_weights_that_are_true_score_better_than_equal_ones():
    rng = np.random.default_rng(2)
    n = 4000
    modes = rng.standard_normal((n, 3, 15, 3))
    p = np.array([0.7, 0.2, 0.1])
    truth = modes[np.arange(n), rng.choice(3, n, p=p)]
    honest = energy_score(modes, np.tile(np.log(p), (n, 1)), truth)
    loss = energy_score(modes, np.zeros((n, 3)), truth) - honest
    assert loss.mean() > 3 * loss.std() / np.sqrt(n)
    np.testing.assert_allclose(honest.mean(), energy_expectation(modes, p), rtol=0.03)


def energy_expectation(modes, p) -> float:
    """Of truths drawn from the belief itself, half the mean distance of two draws."""
    apart = np.linalg.norm((modes[:, :, None] - modes[:, None]).reshape(len(modes), 3, 3, -1), axis=-1)
    return float(0.5 * (apart * np.outer(p, p)).sum(axis=(1, 2)).mean())


@pytest.mark.parametrize("m", [1, 2, 9])
def test_levels_of_a_calibrated_belief_are_uniform_whatever_its_size(m):
    """Skewed, correlated beliefs, different from case to case."""
    rng = np.random.default_rng(m)
    n = 3000
    centre, spread = rng.normal(0, 5, (n, 1, 15, 3)), rng.gamma(1.0, 1.0, (n, 1, 15, 3))
    draws = centre + spread * rng.exponential(1.0, (n, m + 1, 15, 1))
    levels = credible_level(draws[:, 1:], np.zeros((n, m)), draws[:, 0], seed=0)
    assert all(kstest(levels[:, joint], "uniform").pvalue > 1e-4 for joint in range(15))


def test_weighted_draws_of_a_calibrated_belief_are_covered_as_they_should():
    """Importance samples: drawn from a broader Gaussian, weighted towards the one that truths come from."""
    rng = np.random.default_rng(0)
    n, m = 1500, 300
    truth = rng.standard_normal((n, 15, 3))
    scale = 1.4
    draws = np.repeat(scale * rng.standard_normal((n, m, 1, 3)), 15, axis=2)
    square = (draws[:, :, 0] ** 2).sum(axis=-1)
    covered = coverage(draws, -0.5 * square * (1 - 1 / scale**2), truth, (0.5, 0.9), seed=0)
    np.testing.assert_allclose(covered.mean(axis=-1), [0.5, 0.9], atol=0.02)


def test_beliefs_too_sharp_cover_too_little_and_too_broad_too_much():
    rng = np.random.default_rng(0)
    truth, draws = rng.standard_normal((1000, 15, 3)), rng.standard_normal((1000, 50, 15, 3))
    flat = np.zeros((1000, 50))
    assert (coverage(0.5 * draws, flat, truth, 0.9, seed=0) < 0.7).all()
    assert (coverage(2.0 * draws, flat, truth, 0.5, seed=0) > 0.7).all()


def test_a_point_that_is_right_is_inside_by_chance_and_one_that_is_wrong_is_outside():
    truth = np.random.default_rng(0).standard_normal((2000, 15, 3))
    same = np.repeat(truth[:, None], 4, axis=1)
    np.testing.assert_allclose(coverage(same, np.zeros((2000, 4)), truth, 0.3, seed=0), 0.3, atol=0.05)
    assert (credible_level(same + 0.1, np.zeros((2000, 4)), truth, seed=0) > 0.8).all()


def test_unknown_truth_is_left_out():
    samples, weights, truth = belief(0, n=50)
    truth[:25, 3] = np.nan
    levels = credible_level(samples, weights, truth, seed=0)
    assert np.isnan(levels).sum() == 25
    assert np.isfinite(coverage(samples, weights, truth, 0.5, seed=0)).all()
    assert coverage(samples, weights, truth, 1.0, seed=0).tolist() == [1.0] * 15


def test_the_seed_decides_the_ties():
    case = belief(0)
    np.testing.assert_array_equal(credible_level(*case, seed=5), credible_level(*case, seed=5))


@pytest.mark.parametrize("score", [energy_score, credible_level])
def test_what_is_no_belief_is_refused(score):
    samples, weights, truth = belief(0)
    with pytest.raises(MotionError, match="must agree"):
        score(samples[:, :5], weights, truth)
    with pytest.raises(MotionError, match="must agree"):
        score(samples, weights, truth[:2])
    with pytest.raises(MotionError, match="must agree"):
        score(samples[:, :0], weights[:, :0], truth)
    for bad in (np.nan, np.inf):
        with pytest.raises(MotionError, match="log_weights"):
            score(samples, np.where(np.arange(11) == 2, bad, weights), truth)
    with pytest.raises(MotionError, match="log_weights"):
        score(samples, np.full_like(weights, -np.inf), truth)


def test_impossible_requests_are_refused():
    samples, weights, truth = belief(0)
    with pytest.raises(MotionError, match="two samples"):
        energy_score(samples[:, :1], weights[:, :1], truth, fair=True)
    with pytest.raises(MotionError, match="p must be"):
        coverage(samples, weights, truth, 1.5)
