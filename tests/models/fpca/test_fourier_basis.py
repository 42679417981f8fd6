"""The Fourier basis against NumPy's FFT and finite differences."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.models.fpca.fourier_basis import fourier_basis, fourier_columns, sampled_basis


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
