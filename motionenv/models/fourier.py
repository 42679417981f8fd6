"""The real orthonormal Fourier basis on one cycle, in which every model of cycles is smooth and periodic."""

import numpy as np

from motionenv.errors import MotionError


def fourier_basis(phase, n_harmonics: int, samples: int, derivative: int = 0) -> np.ndarray:
    """The truncated basis at arbitrary phases: a constant, then cosines, then sines.

    "The first 20 Fourier coefficients" of paper A (fig. 8, step 2) are read as the constant and 19 pairs, 39 real
    columns; with the complex half spectrum the one-sided weights break Theorem 1.

    Args:
        phase: (...) any real numbers, in cycles: 0 and 1 are the same place.
        n_harmonics: constant and n_harmonics - 1 pairs, so 2·n_harmonics - 1 columns.
        samples: samples of a cycle; sets the scale, so that the columns at phase j / samples are orthonormal.
        derivative: 0 for the basis, d for its d-th derivative by phase [per cycle^d].

    Returns:
        (..., 2·n_harmonics - 1).

    Raises:
        MotionError: fewer samples than columns, so that no orthonormal basis exists.
    """
    if n_harmonics < 1 or samples < 2 * n_harmonics - 1:
        raise MotionError(
            f"n_harmonics must be from 1 to {(samples + 1) // 2} for {samples} samples a cycle, got {n_harmonics}"
        )
    omega = 2 * np.pi * np.arange(1, n_harmonics)
    angle = np.asarray(phase, dtype=np.float64)[..., None] * omega + derivative * np.pi / 2
    scale = np.sqrt(2 / samples) * omega**derivative
    constant = np.full((*angle.shape[:-1], 1), 0.0 if derivative else 1 / np.sqrt(samples))
    return np.concatenate([constant, scale * np.cos(angle), scale * np.sin(angle)], axis=-1)


def sampled_basis(samples: int, n_harmonics: int) -> np.ndarray:
    """The basis at phases j / samples, (samples, 2·n_harmonics - 1); its columns are orthonormal."""
    return fourier_basis(np.arange(samples) / samples, n_harmonics, samples)
