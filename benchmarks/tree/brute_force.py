"""Brute-force baselines of the motion tree: draws from p(i | t) ∝ exp(-|z_i - z_t|² / 2β) over all i.

Both compute |z_i|²/2 - z_i·z_t by matrix products in single precision, for blocks of probes and windows, in two threads
with one BLAS thread each. `compiled_draws` is the fastest version we could write: products of blocks that fit in the
cache, exponentials by a polynomial (relative error 1e-4), and sums over 32 windows that are searched in the end.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit

_fast = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
_ONE, _LEAST = np.float32(1), np.float32(-28)
_LANES, _PIECE, _PROBES = 32, 2048, 32


def transposed(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients z (n, b) as (b, m) float32, and |z|²/2 (m,), the input of both; m is n padded to whole lanes."""
    n, b = z.shape
    out, half = np.zeros((b, -(-n // _LANES) * _LANES), np.float32), np.empty(-(-n // _LANES) * _LANES, np.float32)
    out[:, :n] = z.T
    half[:n], half[n:] = 0.5 * np.einsum("nb,nb->n", z, z), np.inf
    return out, half


def numpy_draws(zt, half, probes, beta: float, u) -> np.ndarray:
    """One draw (B,) for each of `probes` (B, b) from uniform numbers u (B,), with NumPy only."""
    out, size = np.empty(len(probes), np.int64), 4

    def work(first: int) -> None:
        x = probes[first : first + size] @ zt
        x -= half
        x *= np.float32(1 / beta)
        x -= x.max(1, keepdims=True)
        np.exp(x, out=x)
        sums = np.cumsum(x, axis=1, dtype=np.float64)
        for i, row in enumerate(sums, first):
            out[i] = np.searchsorted(row, u[i] * row[-1])

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(work, range(0, len(probes), size)))
    return out


def compiled_draws(zt, half, probes, beta: float, u) -> np.ndarray:
    """The same draws, compiled except for the products."""
    out, m = np.empty(len(probes), np.int64), len(half)

    def work(first: int) -> None:
        q = probes[first : first + _PROBES]
        best, sums = np.full(len(q), -np.inf, np.float32), np.empty((len(q), m // _LANES), np.float32)
        for a in range(0, m, _PIECE):
            x = q @ zt[:, a : a + _PIECE]
            _add_up(x, half[a : a + _PIECE], np.float32(1 / beta), best, sums, a // _LANES)
        _search(zt, half, q, np.float32(1 / beta), best, sums, u[first:], out[first:])

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(work, range(0, len(probes), _PROBES)))
    return out


@_fast
def _exp(x):
    """exp(x) for x <= 0; values below 1e-12 are inaccurate but stay below it."""
    x = max(x, _LEAST) * np.float32(1 / 64)
    y = _ONE + x * (_ONE + x * (np.float32(1 / 2) + x * (np.float32(1 / 6) + x * np.float32(1 / 24))))
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    return y * y


@_fast
def _add_up(x, half, s, best, sums, before):
    """Sum kernels over lanes of products x (probes, windows), relative to the largest kernel so far."""
    for p in range(len(x)):
        for k in range(x.shape[1] // _LANES):
            most = -np.float32(3e38)
            for i in range(k * _LANES, (k + 1) * _LANES):
                x[p, i] -= half[i]
                most = max(most, x[p, i])
            if most > best[p]:
                shrink = np.exp((best[p] - most) * s)
                for j in range(before + k):
                    sums[p, j] *= shrink
                best[p] = most
            total, top = np.float32(0), best[p]
            for i in range(k * _LANES, (k + 1) * _LANES):
                total += _exp((x[p, i] - top) * s)
            sums[p, before + k] = total


@_fast
def _search(zt, half, probes, s, best, sums, u, out):
    """Find the drawn window: first its lanes, then the window among them."""
    for p in range(len(probes)):
        total = 0.0
        for j in range(sums.shape[1]):
            total += sums[p, j]
        rest, j = u[p] * total, 0
        while j < sums.shape[1] - 1 and rest > sums[p, j]:
            rest -= sums[p, j]
            j += 1
        last = (j + 1) * _LANES - 1
        for i in range(j * _LANES, last + 1):
            product = -half[i]
            for d in range(len(zt)):
                product += probes[p, d] * zt[d, i]
            rest -= _exp((product - best[p]) * s)
            if rest <= 0.0:
                last = i
                break
        out[p] = last
