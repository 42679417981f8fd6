"""The model of cycles as one normal distribution: mean, components, smooth residuals and white noise.

x_k = m_g(k) + W z_k + B u_k + ε, with latents z ~ N(0, I). The residual of each channel is a stationary periodic
process, u_h ~ N(0, ψ_h) with one ψ for the cosine and the sine of a harmonic, and white noise ε ~ N(0, σ²). As
residuals are smooth, the samples around a gap help to fill it (kriging; Rasmussen & Williams 2006, section 2.1), and a
cycle of which little is seen tells little of its scores, which white noise alone would deny.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv._core.threads import in_chunks

ROUNDS = 50
_AT_A_TIME = 16  # cycles that a thread infers, at least
_LEAST = 1e-9  # variances, relative to those of the data


@dataclass(frozen=True)
class Inferred:
    """What the seen samples of cycles tell."""

    z: np.ndarray  # (K, q) posterior means of the latents
    covariance: np.ndarray  # (K, q, q)
    log_p: np.ndarray  # (K,) log-likelihoods; 0 without samples
    smooth: np.ndarray  # (m, J) Σ E[u²]
    rest: np.ndarray  # (m, 3) E[Σ ε²], the number of seen samples, and that of cycles that show any


@dataclass(frozen=True)
class Gaussian:
    """The distribution of cycles.

    Attributes:
        means: (G, P, m) of the groups.
        loadings: (q, P, m) W: components times the standard deviations of their scores.
        basis: (P, J) orthonormal functions B of the residuals' smooth parts; J may be 0.
        spectrum: (m, J) ψ.
        white: (m,) σ².
    """

    means: np.ndarray
    loadings: np.ndarray
    basis: np.ndarray
    spectrum: np.ndarray
    white: np.ndarray

    def infer(self, values: np.ndarray, groups: np.ndarray, learning: bool = False) -> Inferred:
        """What cycles `values` (K, P, m), NaN where missing, of `groups` (K,) tell; `learning` fills the sums.

        The smooth part is integrated out of each channel, then the latents out of the cycle.
        """
        from motionenv.models.fpca._gaussian_kernels import infer

        k, q = len(values), len(self.loadings)
        found = np.empty((k, q, 1)), np.empty((k, q, q)), np.empty(k)
        given = np.ascontiguousarray(values), groups, self.means, self._tables, found
        shapes = (self.spectrum.shape, (len(self.white), 3)) if learning else ((0, 0), (0, 3))

        def part(start, stop):
            sums = tuple(np.zeros(shape) for shape in shapes)
            infer(start, stop, *given, *sums)
            return sums

        smooth, rest = (sum(parts) for parts in zip(*in_chunks(part, k, _AT_A_TIME), strict=True))
        return Inferred(found[0][..., 0], found[1], found[2], smooth, rest)

    def fill(
        self, values: np.ndarray, groups: np.ndarray, normals: np.ndarray | None = None, level: float = 0.9
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Cycles (K, P, m) with the expectation of missing samples, and these samples' standard deviations.

        With `normals` (draws, q + J·m + P·m), of which each row makes one draw of all missing samples of a cycle, the
        deviations are multiplied by the quantile `level` of the largest |error| / deviation over the cycle's gaps.
        """
        from motionenv.models.fpca._gaussian_kernels import fill

        filled, width = np.array(values), np.zeros(values.shape)
        size = len(self.loadings) + self.spectrum.size + self.means[0].size
        drawn = np.empty((0, size)) if normals is None else normals
        given = np.ascontiguousarray(values), groups, self.means, self._tables, drawn, level
        in_chunks(lambda start, stop: fill(start, stop, *given, filled, width), len(values), _AT_A_TIME)
        return filled, width

    def draw_residuals(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Residuals (n, P, m), smooth and white."""
        smooth = rng.standard_normal((n, *self.spectrum.T.shape)) * np.sqrt(self.spectrum.T)
        white = rng.standard_normal((n, *self.means.shape[1:])) * np.sqrt(self.white)
        return np.einsum("pj,kja->kpa", self.basis, smooth) + white

    @cached_property
    def _tables(self) -> tuple[np.ndarray, ...]:
        loadings = np.ascontiguousarray(self.loadings.transpose(2, 1, 0))
        whole, squares = self.basis.T @ loadings, loadings.swapaxes(1, 2) @ loadings
        return self.basis, loadings, self.spectrum, self.white, whole, squares


def residual_model(
    residuals: np.ndarray, basis: np.ndarray, noise: np.ndarray, tol: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """The most likely spectrum (m, J) and white variance (m,) of residuals (K, P, m), NaN where missing; by EM.

    Begins with the `noise` (m,) that is white, and ends when a round gains less than the fraction `tol` of the
    log-likelihood.
    """
    k, p, m = residuals.shape
    nothing, groups = np.zeros((1, p, m)), np.zeros(k, dtype=np.int64)
    harmonic = np.r_[0, np.tile(np.arange(1, (basis.shape[1] + 1) // 2), 2)]
    pooled = (harmonic[:, None] == harmonic) / np.bincount(harmonic)[harmonic]
    squares = np.einsum("pj,kpa->kaj", basis, np.nan_to_num(residuals)) ** 2
    spectrum, white, before = np.maximum(squares.mean(axis=0), 1e-3 * noise[:, None]), noise, -np.inf
    least = _LEAST * noise
    for _ in range(ROUNDS):
        found = Gaussian(nothing, np.empty((0, p, m)), basis, spectrum, white).infer(residuals, groups, learning=True)
        total = float(found.log_p.sum())
        if total - before <= tol * abs(total):
            break
        before = total
        spectrum = np.maximum(found.smooth @ pooled / found.rest[:, 2:], least[:, None])
        white = np.maximum(found.rest[:, 0] / found.rest[:, 1], least)
    return spectrum, white
