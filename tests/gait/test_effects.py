"""Effects on curves against closed forms, a peer's permutation tests on published data, and simulated error rates."""

import itertools

import numpy as np
import pytest
from scipy import stats

from motionenv.errors import MotionError
from motionenv.gait.effects import effect_of


def smooth(n: int, phases: int, rng) -> np.ndarray:
    """Smooth random curves (n, phases)."""
    x = np.linspace(0, 1, phases)
    return rng.standard_normal((n, 7)) @ np.cos(np.pi * np.outer(np.arange(7), x)) / np.sqrt(7)


def two(first: int, second: int) -> np.ndarray:
    """The design of two groups."""
    return np.column_stack([np.ones(first + second), np.r_[np.zeros(first), np.ones(second)]])


def test_two_groups_give_welch_s_t_at_every_phase():
    rng = np.random.default_rng(1)
    curves = np.concatenate([smooth(7, 30, rng), 3 * smooth(11, 30, rng) + 1])
    found = effect_of(curves, two(7, 11), 1, permutations=99)
    expected = stats.ttest_ind(curves[7:], curves[:7], equal_var=False)
    np.testing.assert_allclose(found.t, expected.statistic)
    np.testing.assert_allclose(found.estimate, curves[7:].mean(axis=0) - curves[:7].mean(axis=0))


def test_differences_give_student_s_t():
    curves = smooth(8, 30, np.random.default_rng(2)) + 0.4
    found = effect_of(curves, np.ones((8, 1)), 0)
    np.testing.assert_allclose(found.t, stats.ttest_1samp(curves, 0).statistic)
    assert (len(found.maxima), found.least) == (2**8, 2 / 2**8)


def test_a_slope_is_that_of_least_squares_with_hc2_errors():
    rng = np.random.default_rng(3)
    speed, age = rng.uniform(0.8, 1.6, 14), rng.uniform(20, 70, 14)
    design = np.column_stack([np.ones(14), speed, age])
    curves = smooth(14, 20, rng) + 2 * speed[:, None]
    found = effect_of(curves, design, 1, permutations=99)
    beta, *_ = np.linalg.lstsq(design, curves, rcond=None)
    np.testing.assert_allclose(found.estimate, beta[1])
    bread = np.linalg.inv(design.T @ design)
    hat = np.diag(design @ bread @ design.T)
    for phase in range(20):
        e = curves[:, phase] - design @ beta[:, phase]
        meat = design.T @ np.diag(e**2 / (1 - hat)) @ design
        assert found.error[phase] == pytest.approx(np.sqrt((bread @ meat @ bread)[1, 1]))


def test_one_phase_of_few_people_gives_the_exact_permutation_test():
    rng = np.random.default_rng(4)
    values = np.r_[rng.standard_normal(4), rng.standard_normal(4) + 2][:, None]
    found = effect_of(values, two(4, 4), 1)

    def t(ones) -> float:
        zeros = [i for i in range(8) if i not in ones]
        return abs(stats.ttest_ind(values[list(ones), 0], values[zeros, 0], equal_var=False).statistic)

    every = np.array([t(ones) for ones in itertools.combinations(range(8), 4)])
    assert (len(found.maxima), found.least) == (70, 2 / 70)
    assert found.p == pytest.approx((every >= t((4, 5, 6, 7)) - 1e-9).mean())


def test_published_curves_agree_with_spm1d():
    """Plantar arch angles of ten people at two speeds (Caravaggi et al. 2010), by the permutation tests of spm1d."""
    spm1d = pytest.importorskip("spm1d")
    slow, fast = spm1d.data.uv1d.tpaired.PlantarArchAngle().get_data()
    found = effect_of(slow - fast, np.ones((len(slow), 1)), 0)
    peer = spm1d.stats.nonparam.ttest_paired(slow, fast)
    np.testing.assert_allclose(found.t, peer.z, rtol=1e-8)
    told = peer.inference(0.05, two_tailed=True, iterations=-1)
    assert found.threshold == pytest.approx(told.zstar, rel=0.03)
    clusters = [tuple(np.round(cluster.endpoints).astype(int)) for cluster in told.clusters]
    assert len(found.intervals) == len(clusters)
    np.testing.assert_allclose(np.array(found.intervals), np.array(clusters), atol=1.5)


def test_published_forces_grow_with_speed_as_spm1d_says():
    """Vertical ground reaction forces against walking speed (Pataky et al. 2008)."""
    spm1d = pytest.importorskip("spm1d")
    curves, speed = spm1d.data.uv1d.regress.SpeedGRF().get_data()
    found = effect_of(curves, np.column_stack([np.ones(len(speed)), speed]), 1, permutations=999)
    peer = spm1d.stats.regress(curves, speed).inference(0.05)
    strong = np.abs(peer.z) > 2 * peer.zstar
    weak = np.abs(peer.z) < 0.5 * peer.zstar
    assert strong.any()
    assert (np.abs(found.t[strong]) > found.threshold).all()
    assert (np.sign(found.t[strong]) == np.sign(peer.z[strong])).all()
    assert (np.abs(found.t[weak]) < found.threshold).all()


@pytest.mark.parametrize("kind", ["paired", "unequal groups", "slope beside another predictor"])
def test_no_effect_is_found_in_five_of_a_hundred(kind):
    rng, found, n = np.random.default_rng(7), [], 1000
    for _ in range(n):
        if kind == "paired":
            curves, design, column = smooth(9, 25, rng), np.ones((9, 1)), 0
        elif kind == "unequal groups":
            curves, design, column = np.concatenate([smooth(8, 25, rng), 1.5 * smooth(12, 25, rng)]), two(8, 12), 1
        else:
            age = rng.uniform(20, 70, 15)
            design, column = np.column_stack([np.ones(15), rng.uniform(1, 2, 15), age]), 1
            curves = smooth(15, 25, rng) + 0.1 * age[:, None]
        found.append(effect_of(curves, design, column, permutations=199, seed=rng).p <= 0.05)
    assert 0.036 < np.mean(found) < 0.066  # 0.05 within 2.3 standard errors


def test_the_band_holds_the_effect_at_all_phases_in_95_of_a_hundred():
    rng = np.random.default_rng(8)
    truth = np.sin(np.linspace(0, 3, 25))
    inside = []
    for _ in range(500):
        curves = np.concatenate([smooth(10, 25, rng), smooth(10, 25, rng) + truth])
        found = effect_of(curves, two(10, 10), 1, permutations=199, seed=rng)
        inside.append((np.abs(found.estimate - truth) <= found.band).all())
    assert 0.92 < np.mean(inside) < 0.98


def test_people_with_gaps_are_left_out_and_the_rest_counted():
    curves = smooth(9, 20, np.random.default_rng(5))
    whole = effect_of(curves[1:], np.ones((8, 1)), 0)
    curves[0, 3] = np.nan
    found = effect_of(curves, np.ones((9, 1)), 0)
    assert found.people == 8
    np.testing.assert_array_equal(found.t, whole.t)


def test_too_few_people_for_a_level_get_no_band():
    curves = smooth(4, 10, np.random.default_rng(1)) + 9
    found = effect_of(curves, np.ones((4, 1)), 0)
    assert found.p == found.least == 0.125
    assert np.isinf(found.band).all()
    assert not found.intervals
    assert np.isfinite(effect_of(curves, np.ones((4, 1)), 0, level=0.8).band).all()


@pytest.mark.parametrize(
    ("design", "says"),
    [
        (np.ones((2, 1)), "1 coefficients need at least 3 people whose curves are known, got 2"),
        (np.column_stack([np.ones(6), np.full(6, 3.0)]), "predictors tell the same"),
        (two(1, 5), "each group needs two people"),
    ],
)
def test_what_cannot_be_told_is_refused(design, says):
    with pytest.raises(MotionError, match=says):
        effect_of(smooth(len(design), 10, np.random.default_rng(0)), design, design.shape[1] - 1)
