"""The model of cycles as one normal distribution: mean, components, smooth residuals and white noise.

x_k = m_g(k) + W z_k + B u_k + ε, with latents z ~ N(0, I). The residual of each channel is a stationary periodic
process, u_h ~ N(0, ψ_h) with one ψ for the cosine and the sine of a harmonic, and white noise ε ~ N(0, σ²). As
residuals are smooth, the samples around a gap help to fill it (kriging; Rasmussen & Williams 2006, section 2.1), and a
cycle of which little is seen tells little of its scores, which white noise alone would deny.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionenv._core.threads import in_chunks

ROUNDS = 50
_AT_A_TIME = 32  # cycles
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

        def part(start: int, stop: int) -> tuple[np.ndarray, ...]:
            smooth, rest = np.zeros(self.spectrum.shape), np.zeros((len(self.white), 3))
            found = []
            for i in range(start, stop, _AT_A_TIME) or [start]:
                own = slice(i, min(i + _AT_A_TIME, stop))
                told = self._posterior(values[own] - self.means[groups[own]])
                found.append((told.z, told.covariance, told.log_p))
                for channel, white, spectrum, squares, sums in zip(
                    told.channels if learning else (), self.white, self.spectrum, smooth, rest, strict=False
                ):
                    more, counted = channel.expected(told, white, spectrum)
                    squares += more
                    sums += counted
            return *(np.concatenate(each) for each in zip(*found, strict=True)), smooth, rest

        z, covariance, log_p, smooth, rest = zip(*in_chunks(part, len(values), _AT_A_TIME), strict=True)
        return Inferred(np.concatenate(z), np.concatenate(covariance), np.concatenate(log_p), sum(smooth), sum(rest))

    def fill(
        self, values: np.ndarray, groups: np.ndarray, normals: np.ndarray | None = None, level: float = 0.9
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Cycles (K, P, m) with the expectation of missing samples, and these samples' standard deviations.

        With `normals` (draws, q + J·m + P·m), of which each row makes one draw of all missing samples of a cycle, the
        deviations are multiplied by the quantile `level` of the largest |error| / deviation over the cycle's gaps.
        """
        filled, width = np.array(values), np.zeros(values.shape)
        drawn = np.empty((0, len(self.loadings) + self.spectrum.size + self.means[0].size))
        drawn = drawn if normals is None else normals

        def part(start: int, stop: int) -> None:
            for i in range(start, stop, _AT_A_TIME):
                own = slice(i, min(i + _AT_A_TIME, stop))
                self._fill(filled[own], width[own], self.means[groups[own]], drawn, level)

        in_chunks(part, len(values), _AT_A_TIME)
        return filled, width

    def _fill(
        self, filled: np.ndarray, width: np.ndarray, means: np.ndarray, normals: np.ndarray, level: float
    ) -> None:  # fmt: skip
        """`fill` some cycles (K, P, m) in place, and their samples' `width`s."""
        told, (q, _, m), j = self._posterior(filled - means), self.loadings.shape, self.basis.shape[1]
        most = np.zeros((len(filled), len(normals)))
        for a, channel in enumerate(told.channels):
            smooth = channel.inverse @ self.basis.T  # (K, J, P)
            latent = self.loadings[:, :, a] - channel.explained[:, :, :q].swapaxes(1, 2) @ smooth  # (K, q, P)
            expected = (told.z[:, None] @ latent + channel.explained[:, None, :, q] @ smooth)[:, 0]
            latent = told.root @ latent
            deviation = np.sqrt(self.white[a] * (1 + (smooth**2).sum(axis=1)) + (latent**2).sum(axis=1))
            missing = np.isnan(filled[..., a])
            filled[..., a] = np.where(missing, means[..., a] + expected, filled[..., a])
            width[..., a] = np.where(missing, deviation, 0.0)
            if len(normals):
                own, last = normals[:, q + a * j : q + (a + 1) * j], normals[:, q + m * j + a :: m]
                off = normals[:, :q] @ latent + np.sqrt(self.white[a]) * (own @ smooth + last)
                most = np.maximum(most, np.where(missing[:, None], np.abs(off) / deviation[:, None], 0.0).max(axis=2))
        if len(normals):
            width *= np.quantile(most, level, axis=1)[:, None, None]

    def _posterior(self, deviations: np.ndarray) -> _Posterior:
        """What the seen samples of `deviations` (K, P, m) from the mean tell."""
        q = len(self.loadings)
        channels = [
            _channel(deviations[..., a], self.basis, self.loadings[..., a].T, self.spectrum[a], self.white[a])
            for a in range(len(self.white))
        ]
        inner = sum(channel.inner / white for channel, white in zip(channels, self.white, strict=True))
        n = sum(channel.n for channel in channels)
        precision = np.eye(q) + inner[:, :q, :q]
        root = np.linalg.inv(np.linalg.cholesky(precision))
        covariance = root.swapaxes(1, 2) @ root
        z = (covariance @ inner[:, :q, q:])[..., 0]
        minus_twice = sum(channel.log_det for channel in channels) + inner[:, q, q] + n * np.log(2 * np.pi)
        minus_twice += -2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1) - (inner[:, :q, q] * z).sum(axis=1)
        return _Posterior(z, covariance, root, np.where(n > 0, -0.5 * minus_twice, 0.0), channels)

    def draw_residuals(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Residuals (n, P, m), smooth and white."""
        smooth = rng.standard_normal((n, *self.spectrum.T.shape)) * np.sqrt(self.spectrum.T)
        white = rng.standard_normal((n, *self.means.shape[1:])) * np.sqrt(self.white)
        return np.einsum("pj,kja->kpa", self.basis, smooth) + white


@dataclass(frozen=True)
class _Channel:
    """The seen samples of one channel of K cycles, with the smooth part u of the residual integrated out.

    With M = σ² Ψ⁻¹ + Bᵀ B over them, and its Cholesky root L: `inverse` (K, J, J) L⁻¹, `explained` (K, J, q + 1) L⁻¹
    Bᵀ [W, x], `inner` (K, q + 1, q + 1) [W, x]ᵀ (I - B M⁻¹ Bᵀ) [W, x], their number `n` (K,), and `log_det` (K,) of
    their covariance given the latents.
    """

    inverse: np.ndarray
    explained: np.ndarray
    inner: np.ndarray
    n: np.ndarray
    log_det: np.ndarray

    def expected(self, told: _Posterior, white: float, spectrum: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums over the cycles that show any sample: E[u²] (J,), and (E[Σ ε²], the samples, these cycles).

        With D = M⁻¹ Bᵀ W, u has the covariance σ² M⁻¹ + D S Dᵀ, and by Bᵀ B = M - σ² Ψ⁻¹ the noise's sum is E[[-z, 1]ᵀ
        inner [-z, 1]] + σ² J - σ² Σ E[u²] / ψ.
        """
        q, seen = told.z.shape[1], self.n > 0
        d = self.inverse.swapaxes(1, 2) @ self.explained
        less = np.concatenate([-told.z, np.ones((len(seen), 1))], axis=1)
        u = (d @ less[..., None])[..., 0]
        squares = u**2 + white * (self.inverse**2).sum(axis=1) + (d[..., :q] @ told.covariance * d[..., :q]).sum(axis=2)
        noise = (less[:, None] @ self.inner @ less[..., None])[:, 0, 0]
        noise += (self.inner[:, :q, :q] * told.covariance).sum(axis=(1, 2))
        noise += white * (len(spectrum) - (squares / spectrum).sum(axis=1))
        return squares[seen].sum(axis=0), np.array([noise[seen].sum(), self.n.sum(), seen.sum()])


@dataclass(frozen=True)
class _Posterior:
    """Posterior N(z, S) of the latents of K cycles, log p of their seen samples, and what their channels tell."""

    z: np.ndarray  # (K, q)
    covariance: np.ndarray  # (K, q, q) S
    root: np.ndarray  # (K, q, q), with S = rootᵀ root
    log_p: np.ndarray  # (K,), 0 without samples
    channels: list[_Channel]


def _channel(x: np.ndarray, basis: np.ndarray, loading: np.ndarray, spectrum: np.ndarray, white: float) -> _Channel:
    """What one channel's deviations `x` (K, P) from the mean, NaN where missing, tell; `loading` W is (P, q)."""
    columns, j = np.concatenate([basis, loading], axis=1), basis.shape[1]
    seen = np.isfinite(x)
    known, n = np.where(seen, x, 0.0), seen.sum(axis=1)
    patterns, which = np.unique(seen, axis=0, return_inverse=True)  # many cycles show the same samples: all of them
    outer = (columns[:, :, None] * columns[:, None]).reshape(len(columns), -1)
    gram = (patterns.astype(np.float64) @ outer).reshape(-1, *2 * columns.shape[1:])
    root = np.linalg.cholesky(gram[:, :j, :j] + np.diag(white / spectrum))
    log_det = 2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1) + np.log(spectrum / white).sum()
    which = which.reshape(-1)
    gram, inverse = gram[which], np.linalg.inv(root)[which]
    right = known @ columns
    explained = inverse @ np.concatenate([gram[:, :j, j:], right[:, :j, None]], axis=2)
    inner = np.empty((len(x), *2 * (columns.shape[1] - j + 1,)))
    inner[:, :-1, :-1], inner[:, -1, -1] = gram[:, j:, j:], (known**2).sum(axis=1)
    inner[:, :-1, -1] = inner[:, -1, :-1] = right[:, j:]
    return _Channel(
        inverse, explained, inner - explained.swapaxes(1, 2) @ explained, n, n * np.log(white) + log_det[which]
    )


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
