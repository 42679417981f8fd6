"""What doesn't suit the model is told where it is and how to mend it; the mends bring back the model without it."""

import warnings

import numpy as np
import pytest

from motionenv.errors import FitWarning
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.screening import unwrapped
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps


@pytest.fixture(scope="module")
def angles():
    """Sixty cycles of four angles, each within about one radian."""
    return with_gaps(0.25 * low_rank(seed=3)[0])[0]


def told(values, **settings) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        FunctionalPCA(3, n_harmonics=10, **settings).fit(as_cycles(values, tuple("ab"[i % 2] for i in range(60))))
    return [str(warning.message) for warning in seen if warning.category is FitWarning]


def fitted(values, **settings) -> FunctionalPCA:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FitWarning)
        return FunctionalPCA(3, n_harmonics=10, **settings).fit(values)


def likeness(one: FunctionalPCA, other: FunctionalPCA) -> float:
    """Cosine of the largest angle between the planes of the first two components."""
    return float(np.linalg.svd(*[one.components_[:2].reshape(2, -1) @ other.components_[:2].reshape(2, -1).T])[1].min())


@pytest.mark.parametrize("method", ["ppca", "svd"])
def test_good_cycles_raise_no_alarm(angles, method):
    assert told(angles, method=method) == []
    assert told(1000 * angles, method=method) == []


@pytest.mark.parametrize("size", [3.0, 100.0])
@pytest.mark.parametrize("phase", [0, 20, 63])
def test_a_spike_is_told_and_robustness_mends_it(angles, size, phase):
    values = np.array(angles)
    values[7, phase, 2] = np.nanmax(values[..., 2]) + size
    (text,) = told(values)
    assert text.startswith("angle_2: 1 spike, the largest by")
    assert f"at phase {phase / 64:.2f} of cycle 7" in text
    assert text.endswith("set it to NaN, or pass robust=True")
    assert told(values, robust=True) == []
    assert likeness(fitted(values, robust=True), fitted(angles, robust=True)) > 0.995


def test_robust_and_plain_agree_where_nothing_is_wrong(angles):
    plain, robust = fitted(angles), fitted(angles, robust=True)
    assert likeness(plain, robust) > 0.98
    np.testing.assert_allclose(robust.mean_, plain.mean_, atol=0.05)


def test_a_wrapped_angle_is_told_and_unwrapped(angles):
    values = np.array(angles)
    values[..., 1] = (values[..., 1] - np.nanmean(values[..., 1]) + 2 * np.pi) % (2 * np.pi) - np.pi
    (text,) = told(values)
    assert text.startswith("angle_1: jumps by a whole turn in ")
    assert text.endswith("pass unwrap=True")
    assert told(values, unwrap=True) == []
    assert likeness(fitted(values, unwrap=True), fitted(angles)) > 0.9999


def test_a_cycle_that_is_off_by_a_turn_comes_back(angles):
    values = np.array(angles)
    values[3, :, 0] += 2 * np.pi
    (text,) = told(values)
    assert "angle_0: jumps by a whole turn in 1 cycle, first at phase 0.00 of cycle 3" in text
    np.testing.assert_allclose(unwrapped(values), angles, atol=1e-9)


def test_phases_that_nobody_shows_are_told(angles):
    values = np.array(angles)
    values[:, 40:, 3] = np.nan
    (text,) = told(values)
    assert text.startswith("angle_3: 24 of 64 phases, from 0.62 on, are hardly seen, 24 of them never")
    values[5, 40:, 3] = angles[0, 40:, 3]
    (text,) = told(values)
    assert "hardly seen" in text


def test_channels_that_never_change_and_people_with_one_cycle_are_told(angles):
    values = np.array(angles)
    values[..., 2] = 0.5
    assert told(values) == ["angle_2 never changes: leave it out with channels="]
    cycles = as_cycles(angles, ("lonely", *("a",) * 59))
    with pytest.warns(FitWarning, match="lonely: a single cycle, which is its own mean"):
        FunctionalPCA(2, n_harmonics=8, centre="subject").fit(cycles)


@pytest.mark.parametrize("method", ["ppca", "svd"])
def test_a_fit_that_stops_early_says_so(angles, method):
    with pytest.warns(FitWarning, match="the fit stopped after 3 iterations: raise max_iter or tol"):
        model = FunctionalPCA(3, n_harmonics=10, method=method, max_iter=3).fit(angles)
    assert (model.n_iter_, model.converged_) == (3, False)
    assert FunctionalPCA(3, n_harmonics=10, method=method).fit(angles).converged_
