"""The real orthonormal Fourier basis of one cycle, which makes models of cycles smooth and periodic."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from motionenv.errors import MotionError


def fourier_basis(phase: ArrayLike, n_harmonics: int, samples: int, derivative: int = 0) -> np.ndarray:
    """The truncated basis at arbitrary phases, (..., 2·n_harmonics - 1): a constant, then cosines, then sines.

    "The first 20 Fourier coefficients" of paper A (fig. 8, step 2) are taken as the constant and 19 pairs, 39 real
    columns. With the complex half spectrum, the one-sided weights would break Theorem 1.

    Args:
        phase: (...) real numbers [cycles]; the basis has period 1.
        n_harmonics: a constant and n_harmonics - 1 pairs.
        samples: samples per cycle. They set the scale: the columns at phases j / samples are orthonormal.
        derivative: 0 for the basis, d for its d-th derivative with respect to phase [per cycle^d].

    Raises:
        MotionError: fewer samples than columns, so that no orthonormal basis exists.
    """
    phase = np.asarray(phase, dtype=np.float64)
    columns = fourier_columns(phase.ravel(), n_harmonics, samples, derivative)
    return np.ascontiguousarray(columns.T).reshape(*phase.shape, len(columns))


def fourier_columns(phase: np.ndarray, n_harmonics: int, samples: int, derivative: int = 0) -> np.ndarray:
    """The transpose of `fourier_basis` for phases (n,): (2·n_harmonics - 1, n).

    Computes one cosine and one sine per phase, and the harmonics by angle addition with errors below 1e-14.
    """
    if n_harmonics < 1 or samples < 2 * n_harmonics - 1:
        raise MotionError(
            f"n_harmonics must be from 1 to {(samples + 1) // 2} for {samples} samples a cycle, got {n_harmonics}"
        )
    angle = 2 * np.pi * (phase - np.floor(phase))
    cosine, sine = np.empty((2, n_harmonics, len(angle)))
    cosine[0], sine[0] = 1.0, 0.0
    cosine[1:2], sine[1:2] = np.cos(angle), np.sin(angle)
    for k in range(2, n_harmonics):
        cosine[k] = cosine[1] * cosine[k - 1] - sine[1] * sine[k - 1]
        sine[k] = sine[1] * cosine[k - 1] + cosine[1] * sine[k - 1]
    for _ in range(derivative % 4):
        cosine, sine = -sine, cosine
    omega = 2 * np.pi * np.arange(1, n_harmonics)[:, None]
    scale = np.sqrt(2 / samples) * omega**derivative
    constant = np.full((1, len(angle)), 0.0 if derivative else 1 / np.sqrt(samples))
    return np.concatenate([constant, scale * cosine[1:], scale * sine[1:]])


def sampled_basis(samples: int, n_harmonics: int) -> np.ndarray:
    """The basis at phases j / samples, (samples, 2·n_harmonics - 1); its columns are orthonormal."""
    return fourier_basis(np.arange(samples) / samples, n_harmonics, samples)
