r"""Global search for views: all local minima of the cost of eqs. 4.5 and 4.6, on a grid and refined by Newton's method.

With v = (1, k), data terms c(α, ε, φ) and normal matrix H(α, ε), both of `_gaussian.DataTerms`,

    J = ½ (τ² yᵀWy - 2 τ vᵀc + vᵀH v + Σ k²/λ) - n log τ

For given angles, the scores k and the scale 1/τ have closed forms. What is left is an analytic function of the angles,
whose gradient is exact by steps into the complex plane (Squire & Trapp 1998). Angles are always in the order α, ε, φ.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from motionenv.lifting.views._gaussian import DataTerms

_ENOUGH = 1e-7  # [rad] last step; quadratic convergence makes the next one about its square
_STEPS = 100
_ROUNDING = 1e-13  # relative rounding error of the terms of the cost
_SAME = 1e-6  # [rad] minima closer than this are duplicates
_IMAGINARY, _APART = 1e-30, 3e-5  # [rad] steps of gradient and Hessian
_BATCH = 16  # sequences whose grids are in memory at once


@dataclass(frozen=True, eq=False)
class Cost:
    """J of sequences that show the same markers; `count` is their number of values, or 0 if the scale is given."""

    terms: DataTerms
    precision: np.ndarray  # (N,)
    count: int

    def views(self, alpha: np.ndarray, elevation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Factors (n, 5) of the data terms, and normal matrices (n, 1 + N, 1 + N), of views (n,)."""
        ca, sa, ce, se = np.cos(alpha), np.sin(alpha), np.cos(elevation), np.sin(elevation)
        x, y, z = -sa * ce, ca * ce, -se  # direction of view
        factors = np.stack([1 - x * x, 1 - y * y, 1 - z * z, -x * y, -x * z, -y * z], axis=-1)
        normal = np.tensordot(factors, self.terms.blocks, axes=1)
        index = np.arange(1, normal.shape[-1])
        normal[:, index, index] += self.precision
        return np.stack([ca, sa, -sa * se, ca * se, ce], axis=-1), normal

    def at(self, angles: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """J (n,), τ (n,) and scores (n, N) at `angles` (n, 3), real or complex, of the sequences `rows` (n,)."""
        shown, normal = self.views(angles[:, 0], angles[:, 1])
        data = self.terms.data[rows]
        turns = _turns(angles[:, 2], data.shape[2])
        c = np.einsum("na,najk,nj->nk", shown, data, turns, optimize=True)
        of_mean = normal[:, 0, 1:]
        solved = np.linalg.solve(normal[:, 1:, 1:], np.stack([c[:, 1:], of_mean], axis=-1))
        p = self.terms.squares[rows] - (c[:, 1:] * solved[..., 0]).sum(axis=1)
        q = c[:, 0] - (c[:, 1:] * solved[..., 1]).sum(axis=1)
        tau, cost = self.scaled(p, q, normal[:, 0, 0] - (of_mean * solved[..., 1]).sum(axis=1))
        return cost, tau, tau[:, None] * solved[..., 0] - solved[..., 1]

    def scaled(self, p: np.ndarray, q: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """τ and J = ½ (τ² p - 2 τ q + rest) - count · log τ at its minimum."""
        if self.count == 0:
            return np.ones_like(p), 0.5 * (p - 2 * q + rest)
        tau = (q + np.sqrt(q * q + 4 * p * self.count)) / (2 * p)
        return tau, 0.5 * (tau * tau * p - 2 * tau * q + rest) - self.count * np.log(tau)

    def on_grid(self, alphas, elevations, phases, rows: slice) -> np.ndarray:
        """J (n, E, A, Φ) of some sequences on a grid, by factors that only depend on the view."""
        elevation, alpha = (part.ravel() for part in np.meshgrid(elevations, alphas, indexing="ij"))
        shown, normal = self.views(alpha, elevation)
        root = np.linalg.inv(np.linalg.cholesky(normal[:, 1:, 1:]))
        inner = np.einsum("vij,vj->vi", root, normal[:, 0, 1:])
        data = self.terms.data[rows]
        c = np.einsum("va,najk->nvjk", shown, data, optimize=True)
        half = np.einsum("vik,nvjk->nvji", root, c[..., 1:], optimize=True)
        turns = _turns(phases, data.shape[2])
        there = np.einsum("nvji,fj->nvfi", half, turns, optimize=True)
        p = self.terms.squares[rows][:, None, None] - (there**2).sum(axis=-1)
        q = c[..., 0] @ turns.T - np.einsum("nvfi,vi->nvf", there, inner)
        rest = (normal[:, 0, 0] - (inner**2).sum(axis=1))[:, None]
        return self.scaled(p, q, rest)[1].reshape(len(p), len(elevations), len(alphas), -1)

    def slopes(self, angles: np.ndarray, rows: np.ndarray, open_: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (n, 3) and Hessian (n, 3, 3) of J by the angles that are `open_` (3,); 0 by the others."""
        unit = np.eye(3)[open_]
        moves = np.concatenate([np.zeros((1, 3)), _APART * unit, -_APART * unit])
        points = (angles[:, None, None] + moves[:, None] + 1j * _IMAGINARY * unit).reshape(-1, 3)
        cost = self.at(points, np.repeat(rows, len(moves) * len(unit)))[0]
        slope = cost.imag.reshape(len(rows), len(moves), len(unit)) / _IMAGINARY
        curved = (slope[:, 1 : 1 + len(unit)] - slope[:, 1 + len(unit) :]) / (2 * _APART)
        gradient, hessian = np.zeros((len(rows), 3)), np.zeros((len(rows), 3, 3))
        gradient[:, open_] = slope[:, 0]
        hessian[:, np.ix_(open_, open_)[0], np.ix_(open_, open_)[1]] = 0.5 * (curved + curved.swapaxes(1, 2))
        return gradient, hessian


def _turns(phase: np.ndarray, terms: int) -> np.ndarray:
    """What multiplies the data's `terms`, 1, sin φ, cos φ, sin 2φ and cos 2φ, or the first alone, at phases (n,)."""
    waves = [f(h * phase) for h in (1, 2) for f in (np.sin, np.cos)]
    return np.stack([np.ones_like(phase), *waves], axis=-1)[:, :terms]


def lowest(cost: np.ndarray, around: bool, most: int) -> np.ndarray:
    """Indices (K, 3) of the lowest local minima of `cost` (E, A, Φ); phase is circular, and α if `around`."""
    padded = np.pad(cost, ((1, 1), (0, 0), (0, 0)), constant_values=np.inf)
    padded = np.pad(padded, ((0, 0), (1, 1), (0, 0)), **({"mode": "wrap"} if around else {"constant_values": np.inf}))
    padded = np.pad(padded, ((0, 0), (0, 0), (1, 1)), mode="wrap")
    least = ndimage.minimum_filter(padded, 3, mode="nearest")[1:-1, 1:-1, 1:-1]
    found = np.argwhere(cost <= least)
    return found[np.argsort(cost[tuple(found.T)], kind="stable")[:most]]


def polished(cost: Cost, angles: np.ndarray, rows: np.ndarray, low, high, reach) -> tuple[np.ndarray, np.ndarray]:
    """Newton's method from `angles` (n, 3) of sequences `rows` (n,) within bounds, with steps of at most `reach` (3,).

    Returns the minima (n, 3), and the variance (n,) of α from the curvature there, NaN at a bound.
    """
    open_ = low < high
    angles, damping, going = angles.copy(), np.zeros(len(rows)), np.arange(len(rows))
    variance = np.full(len(rows), np.nan)
    for _ in range(_STEPS):
        here, which = angles[going], rows[going]
        gradient, hessian = cost.slopes(here, which, open_)
        outwards = ((here <= low) & (gradient > 0)) | ((here >= high) & (gradient < 0))
        free = open_ & ~outwards
        variance[going] = _variances(hessian, free)
        step = _steps(gradient, hessian, free, damping[going])
        step /= np.maximum(np.abs(step / reach).max(axis=1), 1.0)[:, None]
        there = np.clip(here + step, low, high)
        size = np.abs(there - here).max(axis=1)
        before, tau, _ = cost.at(here, which)
        after = cost.at(there, which)[0]
        better = after <= before + _ROUNDING * (np.abs(before) + tau**2 * cost.terms.squares[which])
        angles[going[better]] = there[better]
        usual = damping[going]
        stiff = np.maximum(10 * usual, np.abs(hessian[:, 0, 0]))
        damping[going] = np.where(better, np.where(usual > 1e-6, 0.1 * usual, 0.0), stiff)
        done = ((size < _ENOUGH) & better & (usual == 0)) | (~better & (size < 1e-3 * _ENOUGH))
        going = going[~done]
        if not len(going):
            break
    return angles, variance


def _steps(gradient, hessian, free, damping) -> np.ndarray:
    """Newton steps (n, 3) of the `free` angles, damped until the Hessian is positive definite."""
    bound = ~free
    matrix = np.where(free[:, :, None] & free[:, None, :], hessian, 0.0) + np.eye(3) * bound[:, None, :]
    values, vectors = np.linalg.eigh(matrix)
    largest = np.abs(np.where(free, np.diagonal(hessian, axis1=1, axis2=2), 0.0)).max(axis=1)
    least = values[:, 0] + damping
    short = least <= 0
    damping = np.where(short, np.maximum(damping - least, 0) + 1e-3 * largest + 1e-300, damping)
    turned = np.einsum("nij,ni->nj", vectors, np.where(free, -gradient, 0.0))
    return np.where(free, np.einsum("nij,nj->ni", vectors, turned / (values + damping[:, None])), 0.0)


def _variances(hessian: np.ndarray, free: np.ndarray) -> np.ndarray:
    """First diagonal entries (n,) of the inverse Hessians of the `free` angles; NaN where they aren't positive."""
    matrix = np.where(free[:, :, None] & free[:, None, :], hessian, 0.0) + np.eye(3) * ~free[:, None, :]
    good = free[:, 0] & (np.linalg.eigvalsh(matrix)[:, 0] > 0)
    return np.where(good, np.linalg.inv(np.where(good[:, None, None], matrix, np.eye(3)))[:, 0, 0], np.nan)


def search(cost: Cost, grid: tuple, low, high, reach, most: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each sequence its local minima (K, 3), lowest first and at most `most`, and their variances (K,) of α.

    `grid` are α, ε and φ; `low` and `high` (3,) their bounds, equal where an angle is given.
    """
    alphas, elevations, phases = grid
    around, n, found = np.isinf(low[0]), len(cost.terms.data), []
    for first in range(0, n, _BATCH):
        rows = slice(first, min(first + _BATCH, n))
        picked = [lowest(one, around, most) for one in cost.on_grid(alphas, elevations, phases, rows)]
        which = np.repeat(np.arange(rows.start, rows.stop), [len(picks) for picks in picked])
        e, a, f = np.concatenate(picked).T
        angles, variance = polished(cost, np.stack([alphas[a], elevations[e], phases[f]], 1), which, low, high, reach)
        angles[:, [0, 2]] = np.pi - (np.pi - angles[:, [0, 2]]) % (2 * np.pi)
        height = cost.at(angles, which)[0]
        for row in range(rows.start, rows.stop):
            mine = np.flatnonzero(which == row)
            mine = mine[np.argsort(height[mine], kind="stable")]
            apart = np.abs((angles[mine, None] - angles[mine] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
            mine = mine[~np.tril(apart < _SAME, -1).any(axis=1)]
            found.append((angles[mine], variance[mine]))
    return found
