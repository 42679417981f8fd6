r"""The posterior of a steady walk, given its Fourier series in the picture and a view (paper B, eqs. 3.15 and A.5).

    series of marker m = scale · (C(α, ε) w_m(φ) + offset) + noise,     w ~ N(w̄, Eᵀ diag λ E + diag noise)

The 225 coefficients w of the walker are linear in this, so that their most probable values have a closed form; the
noise is that of the series, whose covariance follows from the frames. View, phase and offset, which `find_view` has
estimated, enter the covariance by their derivatives.

It needs no look at single frames: on people left out, fitting these instead was better by 0.5 mm at most, with outliers
(`benchmarks.lifting.raw`).
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from motionenv.lifting.fourier_fit import Series
from motionenv.lifting.posterior import WalkPosterior
from motionenv.lifting.view_geometry import project
from motionenv.lifting.views.unknown_view import Views
from motionenv.models.eigenwalkers.fourier_series import later
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import Points

_SHARED = 1.45  # inflation of the variances of the parameters that all markers share; see `benchmarks.lifting.raw`
_ELEVATION = np.radians(20.0)  # prior standard deviation of an unknown elevation
_HELD = 1e12  # [1/rad²] precision of a given view angle
_SIZE = 0.015  # relative standard deviation of body size beyond what a model fitted to few people covers
_FLOOR = 1e-4  # [m] least standard deviation of a series' coefficients
_STEP = 1e-4  # of differences [rad]


def steady_walk(
    model: WalkerPrior, points: Points, series: Series, views: Views, unknown: tuple[str, ...]
) -> WalkPosterior:
    """The posterior of a walker of `model` at the best of `views`, given the `series` of `points`.

    `unknown` are those of "alpha", "elevation" and "scale" that `views` had to estimate.
    """
    view = np.array([views.alpha, -views.phase, views.elevation], dtype=np.float64)
    seen = np.isfinite(series.coefficients[0, :, 0])
    told = (series.coefficients / views.scale)[:, seen]
    told[0] += views.offset
    roots = np.linalg.cholesky(series.covariance[seen] / views.scale**2 + _FLOOR**2 * np.eye(5))
    whiten = lambda values: np.einsum("mgh,hmi...->gmi...", np.linalg.inv(roots), values).reshape(10 * seen.sum(), -1)
    shown = lambda w, at: project(later(w, at[1]), at[0], at[2])[..., seen, :]
    walker = whiten(np.moveaxis(shown(np.eye(225).reshape(-1, 5, 15, 3), view), 0, -1))
    prior, mean = precision_of(model), np.asarray(model.mean_).reshape(-1)
    w = mean + _solved(walker.T @ walker + prior, walker.T @ (whiten(told)[:, 0] - walker @ mean))
    own = w.reshape(5, 15, 3)

    slopes = [(shown(own, view + h) - shown(own, view - h)) / (2 * _STEP) for h in _STEP * np.eye(3)]
    offsets = np.zeros((2, *told.shape))
    offsets[[0, 1], 0, :, [0, 1]] = 1.0
    names = ("alpha", "phase", "turns", *(name for name in ("elevation", "scale") if name in unknown))
    by_name = {"alpha": slopes[0], "phase": slopes[1], "turns": 0 * told, "elevation": slopes[2], "scale": told}
    design = np.hstack([walker, whiten(np.stack([*(by_name[name] for name in names), *offsets], axis=-1))])
    matrix = design.T @ design
    matrix[:225, :225] += prior
    matrix[227, 227] = matrix[226, 226] / 3  # of a slope over time from -1 to 1, where the mean is as sure as the phase
    known = {"alpha": 0.0 if "alpha" in unknown else _HELD, "elevation": _ELEVATION**-2}
    for i, name in enumerate(names, 225):
        matrix[i, i] += known.get(name, 0.0)
    joint = _solved(matrix, np.eye(len(matrix)))[: 225 + len(names), : 225 + len(names)]
    rest = told - shown(own, view)
    square = (w - mean) @ prior @ (w - mean) + (rest**2 / np.asarray(model.noise_)[:, seen, None]).sum()
    return WalkPosterior(
        coefficients=own, alpha=float(views.alpha), elevation=float(views.elevation), scale=float(views.scale),
        frequency=series.frequency, phase=float(np.remainder(view[1], 2 * np.pi)), names=names,
        parameter_covariance=_SHARED * joint[225:, 225:], weights=series.weights,
        deviation=_scatter(points, series) / float(views.scale), inflation=np.asarray(model.inflation_),
        misfit=float(np.sqrt(square / rest.size)),
        phases=view[1] + 2 * np.pi * series.frequency * np.arange(len(series.weights)) / series.fps, _joint=joint,
    )  # fmt: skip


def precision_of(model: WalkerPrior) -> np.ndarray:
    """Inverse (225, 225) of the walker's covariance Eᵀ diag λ E + diag noise, by Woodbury's identity."""
    loose = np.repeat(1.0 / np.asarray(model.noise_, dtype=np.float64).reshape(-1), 3)
    e = np.concatenate([model.components_, np.asarray(model.mean_)[None]]).reshape(-1, 225)
    scaled = e * loose
    inner = np.diag(1.0 / np.append(model.explained_variance_, _SIZE**2)) + scaled @ e.T
    half = solve_triangular(np.linalg.cholesky(inner), scaled, lower=True)
    return np.diag(loose) - half.T @ half


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    return cho_solve(cho_factor(matrix, lower=True), right)


def _scatter(points: Points, series: Series) -> np.ndarray:
    """Standard deviation (15,) of a person's motion about its series, in the points' unit.

    It is the part of the residuals that lasts from one frame to the next: the rest is noise of the points. Its share
    is common to all markers, as is the variance of those that aren't seen.
    """
    off = points.upward - series.positions_at(np.arange(len(points.positions)) / points.fps)
    off *= np.sqrt(series.weights)[..., None]
    power, *lags = (np.nanmean(off[lag:] * off[: len(off) - lag]) for lag in range(3))
    share = np.clip((4 * lags[0] - lags[1]) / (3 * max(power, 1e-300)), 0.0, 1.0)  # at lag 0 by c(k) = c(0) - a k²
    usual = np.sqrt(np.nanmean(series.rms**2))
    return np.sqrt(share) * np.where(np.isfinite(series.rms), series.rms, usual)
