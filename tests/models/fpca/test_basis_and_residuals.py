"""The Fourier basis and the residuals' model against NumPy's FFT, finite differences and dense kriging."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.fpca.fourier_basis import fourier_basis, fourier_columns, sampled_basis
from motionenv.models.fpca.residual import expected_residual, harmonics, residual_model, residual_moments
from tests.models.fpca.made_cycles import with_gaps


def test_the_basis_is_orthonormal_and_matches_the_fft():
    basis = sampled_basis(64, 20)
    np.testing.assert_allclose(basis.T @ basis, np.eye(39), atol=1e-12)
    x = np.random.default_rng(0).standard_normal(64)
    spectrum = np.fft.rfft(x)
    spectrum[20:] = 0
    np.testing.assert_allclose(basis @ (basis.T @ x), np.fft.irfft(spectrum, 64), atol=1e-12)
    with pytest.raises(MotionError, match="n_harmonics"):
        fourier_basis(0.0, 20, 38)


@pytest.mark.parametrize("derivative", range(1, 6))
def test_derivatives_are_those_of_differences(derivative):
    phase, h = np.random.default_rng(derivative).uniform(-3, 3, (4, 5)), 1e-6
    slope = fourier_basis(phase + h, 7, 64, derivative - 1) - fourier_basis(phase - h, 7, 64, derivative - 1)
    expected = fourier_basis(phase, 7, 64, derivative)
    np.testing.assert_allclose(slope / (2 * h), expected, atol=1e-7 * np.abs(expected).max())


def test_far_phases_and_many_harmonics_are_as_exact_as_cosines_of_their_own():
    phase = np.random.default_rng(0).uniform(-1, 1, 50) * 1e3
    turns = phase - np.floor(phase)
    cosines = np.cos(2 * np.pi * turns[None] * np.arange(1, 60)[:, None])
    np.testing.assert_allclose(fourier_columns(phase, 60, 128)[1:60] * 8.0, cosines, atol=1e-12)


@pytest.mark.parametrize("n_harmonics", [0, 33])
def test_more_columns_than_samples_are_refused(n_harmonics):
    with pytest.raises(MotionError, match=f"n_harmonics must be from 1 to 32 for 64 samples .*, got {n_harmonics}"):
        sampled_basis(64, n_harmonics)


def test_smooth_residuals_are_filled_as_dense_kriging_does():
    rng = np.random.default_rng(5)
    basis = sampled_basis(32, 4)
    spectrum, white = np.full((2, 7), 3.0), np.array([0.1, 0.4])
    residuals = with_gaps(rng.standard_normal((3, 32, 2)), 0.3)[0]
    filled = expected_residual(residuals, basis, spectrum, white)
    for k in range(3):
        for a in range(2):
            o = np.isfinite(residuals[k, :, a])
            prior = basis @ np.diag(spectrum[a]) @ basis.T
            weights = np.linalg.solve(prior[np.ix_(o, o)] + white[a] * np.eye(o.sum()), residuals[k, o, a])
            np.testing.assert_allclose(filled[k, :, a], prior[:, o] @ weights)


def test_the_residual_spectrum_is_recovered():
    rng = np.random.default_rng(6)
    basis = sampled_basis(64, 4)
    true = np.array([4.0, 2.0, 1.0, 0.5, 2.0, 1.0, 0.5])
    u = rng.standard_normal((800, 2, 7)) * np.sqrt(true)
    residuals = np.moveaxis(u @ basis.T, 1, 2) + 0.1 * rng.standard_normal((800, 64, 2))
    spectrum, white = residual_model(residual_moments(with_gaps(residuals)[0], basis))
    np.testing.assert_allclose(spectrum, np.tile(true, (2, 1)), rtol=0.15)
    np.testing.assert_allclose(white, 0.01, rtol=0.05)


def test_columns_of_one_harmonic_are_those_of_one_frequency():
    power = np.abs(np.fft.rfft(sampled_basis(32, 5), axis=0))
    np.testing.assert_array_equal(harmonics(9), power.argmax(axis=0))


def test_noise_alone_has_no_spectrum_and_variances_stay_above_zero():
    residuals = np.random.default_rng(0).standard_normal((400, 32, 1))
    spectrum, white = residual_model(residual_moments(residuals, sampled_basis(32, 4)))
    assert ((spectrum > 0) & (spectrum < 0.2)).all()
    np.testing.assert_allclose(white, 1.0, rtol=0.05)
