"""Paper B's errors against brute force over the frames of a cycle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.lifting.walker_errors import (
    cycle_mpjpe,
    joint_error,
    missing_variance,
    relative_joint_error,
    relative_walker_error,
    walker_error,
)
from motionenv.errors import MotionError
from motionenv.metrics import mpjpe
from motionenv.models.eigenwalkers.fourier_series import later

SEEDS = st.integers(0, 2**32 - 1)
FRAMES = 37


def walks(seed, *shape):
    return np.random.default_rng(seed).normal(0, 0.2, (*shape, 5, 15))


def at(w, t):
    """Eq. 3.1 of coefficients (5, 15), at the phase t, written out."""
    return w[0] + w[1] * np.sin(t) + w[2] * np.cos(t) + w[3] * np.sin(2 * t) + w[4] * np.cos(2 * t)


def sampled(w):
    """Positions (frames, 15) over a cycle."""
    return np.array([at(w, 2 * np.pi * i / FRAMES) for i in range(FRAMES)])


@given(SEEDS)
def test_equations_4_1_to_4_4_over_the_frames_of_a_cycle(seed):
    estimate, truth = walks(seed), walks(seed + 1)
    p, q = sampled(truth), sampled(estimate)
    each = [sum((p[t, j] - q[t, j]) ** 2 for t in range(FRAMES)) / FRAMES for j in range(15)]
    variance = np.mean([np.var(p[:, j]) for j in range(15)])
    for given_as in ((estimate, truth, False), (q, p, True)):
        a, b, frames = given_as
        np.testing.assert_allclose(joint_error(a, b, frames=frames), each)
        assert walker_error(a, b, frames=frames) == pytest.approx(np.mean(each))
        assert missing_variance(b, frames=frames) == pytest.approx(variance)
        np.testing.assert_allclose(relative_joint_error(a, b, frames=frames), each / variance)
        assert relative_walker_error(a, b, frames=frames) == pytest.approx(np.mean(each) / variance)
        assert missing_variance(b, posture=True, frames=frames) == pytest.approx(np.var(p))
        assert relative_walker_error(a, b, posture=True, frames=frames) == pytest.approx(np.mean(each) / np.var(p))


@given(SEEDS, st.floats(-6, 6))
def test_where_the_cycle_starts_does_not_matter(seed, phase):
    a, b = walks(seed)[..., None], walks(seed + 1)[..., None]
    moved = [later(w, phase)[..., 0] for w in (a, b)]
    np.testing.assert_allclose(joint_error(*moved), joint_error(a[..., 0], b[..., 0]))
    assert missing_variance(moved[1]) == pytest.approx(missing_variance(b[..., 0]))


def test_batches_are_one_by_one():
    estimate, truth = walks(0, 3, 4), walks(1, 4)
    for measure in (walker_error, relative_walker_error):
        found = measure(estimate, truth)
        assert found.shape == (3, 4)
        np.testing.assert_allclose(found, [[measure(estimate[i, j], truth[j]) for j in range(4)] for i in range(3)])
    assert relative_joint_error(estimate, truth).shape == (3, 4, 15)


def test_unknown_truth_is_left_out_and_unknown_estimates_are_not():
    estimate, truth = walks(0), walks(1)
    truth[:, 3] = np.nan
    rest = np.delete(np.arange(15), 3)
    less = joint_error(estimate, truth)
    assert np.isnan(less[3])
    assert walker_error(estimate, truth) == pytest.approx(less[rest].mean())
    assert missing_variance(truth) == pytest.approx(np.mean(np.var(sampled(truth)[:, rest], axis=0)))
    assert missing_variance(truth, posture=True) == pytest.approx(np.var(sampled(truth)[:, rest]))
    estimate[0, 5] = np.nan
    assert np.isnan(walker_error(estimate, truth))
    assert np.isnan(walker_error(walks(0), np.full((5, 15), np.nan)))


def test_mpjpe_over_a_cycle_is_the_mean_over_fine_frames():
    rng = np.random.default_rng(0)
    estimate, truth = rng.normal(0, 0.2, (2, 3, 5, 15, 3))
    fine = [[at(w, t) for t in np.linspace(0, 2 * np.pi, 2000, endpoint=False)] for w in (estimate[1], truth[1])]
    assert cycle_mpjpe(estimate, truth)[1] == pytest.approx(mpjpe(*np.array(fine)).mean(), rel=1e-4)
    assert cycle_mpjpe(truth + [0.03, 0, 0.04] * np.eye(5)[0][:, None, None], truth) == pytest.approx([0.05] * 3)
    truth[0, :, 2] = np.nan
    assert np.isfinite(cycle_mpjpe(estimate, truth)).all()


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: joint_error(walks(0)[..., :14], walks(0)), "estimate must hold coefficients"),
        (lambda: walker_error(walks(0), np.zeros((9, 15))), "truth must hold coefficients"),
        (lambda: walker_error(np.zeros((9, 15)), np.zeros((8, 15)), frames=True), "equal frames, got 9 and 8"),
        (lambda: walker_error(np.zeros((0, 15)), np.zeros((0, 15)), frames=True), "positions"),
        (lambda: joint_error(walks(0, 3), walks(0, 2)), "estimate and truth must broadcast"),
        (lambda: missing_variance(np.zeros(15)), "truth must hold coefficients"),
        (lambda: cycle_mpjpe(walks(0), walks(1)), "estimate must hold coefficients"),
        (lambda: cycle_mpjpe(np.zeros((5, 15, 3)), np.zeros((5, 15, 3)), samples=0), "samples"),
    ],
)
def test_bad_input_says_what_is_wrong(call, match):
    with pytest.raises(MotionError, match=match):
        call()
