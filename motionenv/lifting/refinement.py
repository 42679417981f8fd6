r"""Maximum a posteriori estimation of a walk from the raw points of one camera, by Gauss-Newton.

The closed forms of paper B (eqs. 3.9, 3.15, 4.6) start from a 2D Fourier series. `refine` fits the points of every
frame. The unknowns are the walker's 225 coefficients of eq. 3.1, with the model's Gaussian prior (eq. 3.11), phase and
frequency, the view, and the path in the picture:

    picture = scale · C(α, ε) Σ_h b_h(ωt + φ) w_h + a polynomial in time

This is weak perspective, which is accurate if the walker's distance changes little.

Each iteration solves (JᵀPJ + Λ) Δ = JᵀP r - Λ (θ - θ₀) with Levenberg-Marquardt damping, which keeps it in the basin of
attraction of its start. Points have Student's t weights (iteratively reweighted), which limits the influence of
outliers. Residuals are correlated over many frames, because strides differ from one another; `_noise` therefore
estimates their power at the low frequencies that determine the coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_whole
from motionenv.errors import GapError, MotionError
from motionenv.lifting._noise import Noise, first_noise, noise, robust_weights
from motionenv.lifting._parallel_projection import Parallel, turn
from motionenv.lifting.fourier_fit import LEAST_CYCLES
from motionenv.lifting.posterior import WalkPosterior
from motionenv.models.eigenwalkers.fourier_series import columns
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.types import MARKERS, Points, frozen

_FRAMES = 8  # least number of frames that must show a marker
_STEPS = 60
_SMALL = 1e-2  # squared length of the last step, in posterior standard deviations
_HELD = 1e12  # [1/rad²] precision of a given view angle
# Inflation of the variances of the parameters that all markers share: the root mean square of α's standardised error
# was 1.2 on held-out people, at all views, with and without noise and gaps.
_SHARED = 1.45
_WIDEST = 0.3  # [rad] largest change of α or phase in one step
_DAMPING = 1e-3
_SIZE = 0.015  # relative standard deviation of body size beyond what a model fitted to few people covers
#: Indices that reorder flattened (5, 15, 3) coefficients marker by marker.
_BY_MARKER = np.arange(225).reshape(5, 15, 3).swapaxes(0, 1).reshape(-1)


@dataclass(frozen=True, eq=False, repr=False)
class InitialEstimate(OneLine):
    """Initial values of `refine`, such as the closed-form estimate.

    Attributes:
        coefficients: (5, 15, 3) [m], the walker.
        alpha, phase: view angle, and phase of the first frame [rad].
        frequency: strides per second [Hz].
        elevation: angle [rad] by which the camera looks down.
        scale: image units per metre (1 for metres).
    """

    coefficients: np.ndarray
    alpha: float
    frequency: float
    phase: float
    elevation: float = 0.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        w = frozen(self.coefficients, (5, len(MARKERS), 3), "InitialEstimate.coefficients")
        object.__setattr__(self, "coefficients", w)
        numbers = (self.alpha, self.frequency, self.phase, self.elevation, self.scale)
        if not (np.isfinite(w).all() and np.isfinite(numbers).all() and self.frequency > 0 and self.scale > 0):
            raise MotionError(
                "InitialEstimate needs finite values, and frequency and scale above 0: got alpha, frequency, phase, "
                f"elevation, scale = {numbers}"
            )


def refine(
    model: WalkerPrior, points: Points, start: InitialEstimate, *, unknown: tuple[str, ...] = ("alpha",),
    drift: int = 3, robust: bool = True,
) -> WalkPosterior:  # fmt: skip
    """Maximum a posteriori estimate of a walk, by Gauss-Newton from `start`.

    The prior fills missing points and missing markers. Ambiguities (such as front or back, for a symmetric walker seen
    from the side) are resolved as in the start.

    Args:
        model: `WalkerPrior`: mean_, components_, explained_variance_, noise_, inflation_.
        points: the 15 markers in at least 1.5 strides.
        start: initial values, near the solution.
        unknown: parameters to estimate, of "alpha", "elevation" and "scale"; the others keep their start values.
        drift: degree in time of the polynomial path of the image.
        robust: whether to weight outliers down.

    Raises:
        MotionError: invalid arguments or start.
        GapError: too few points, or fewer than 1.5 strides.
    """
    seen = _checked(points, start, unknown, drift)
    time = np.linspace(-1.0, 1.0, len(points.positions))
    basis = np.polynomial.legendre.legvander(time, drift)
    seconds = (len(time) - 1) / points.fps
    picture = Parallel(basis, start.elevation, start.scale, tuple(name for name in unknown if name != "alpha"))
    problem = _Problem(model, points.upward, seen, picture, time, robust, "alpha" in unknown)
    state = problem.begin(start, np.pi * start.frequency * seconds)
    return _result(problem, *_descend(problem, state, start.frequency * seconds), model, points)


@dataclass(frozen=True, eq=False)
class _State:
    """Unknowns: walker (225,) by marker; shared: α, phase at mid-time, half the phase range, the view's parameters."""

    walker: np.ndarray
    shared: np.ndarray

    def moved(self, step: np.ndarray) -> _State:
        return _State(self.walker + step[:225], self.shared + step[225:])


class _Problem:
    """Residuals in metres, their derivatives, and the prior."""

    def __init__(self, model, target, seen, picture, time, robust, turning=True):
        self.target, self.seen, self.picture, self.time = np.where(seen[..., None], target, 0.0), seen, picture, time
        self.robust, self.turning = robust, turning
        self.mean = np.asarray(model.mean_).reshape(-1)[_BY_MARKER]
        self.precision = _precision(model)[np.ix_(_BY_MARKER, _BY_MARKER)]

    def begin(self, start: InitialEstimate, turns: float) -> _State:
        """Initial state, with the path fitted to the points."""
        walker = start.coefficients.reshape(-1)[_BY_MARKER]
        own = np.zeros(len(self.picture.names))
        if "elevation" in self.picture.unknown:
            own[0] = start.elevation
        shared = np.concatenate([[start.alpha, start.phase + turns, turns], own])
        weights = self.seen.astype(float)
        for _ in range(4):  # reweighting
            shared[3:] = self.picture.fit_path(self.places(_State(walker, shared)), self.target, weights, shared[3:])
            residual, _ = self.residual(_State(walker, shared))
            if not self.robust:
                break
            weights = robust_weights(residual, self.seen, first_noise(residual, self.seen).total)
        return _State(walker, shared)

    def places(self, state: _State) -> np.ndarray:
        """Marker positions (frames, 15, 3) [m] in the level frame, walking in place."""
        return self._moving(state, 0) @ turn(state.shared[0]).T

    def _moving(self, state: _State, derivative: int) -> np.ndarray:
        """Marker positions (frames, 15, 3) [m] in the walker's frame, or their derivative by phase."""
        waves = columns(state.shared[1] + self.time * state.shared[2], derivative)
        parts = state.walker.reshape(15, 5, 3).swapaxes(0, 1).reshape(5, 45)
        return (waves @ parts).reshape(-1, 15, 3)

    def residual(self, state: _State, metres: float | None = None) -> tuple[np.ndarray, float]:
        """Residuals (frames, 15, 2) [m] and the metres per image unit used for conversion."""
        shown = self.picture.project(self.places(state), state.shared[3:])
        metres = shown.metres if metres is None else metres
        return np.where(self.seen[..., None], self.target - shown.picture, 0.0) * metres, metres

    def jacobian(self, state: _State) -> np.ndarray:
        """Derivatives (15, frames, 2, 15 + shared) [m] by each marker's coefficients and the shared unknowns."""
        alpha, phase, turns = state.shared[:3]
        moving, slope = self._moving(state, 0), self._moving(state, 1)
        shown = self.picture.project(moving @ turn(alpha).T, state.shared[3:])
        by_walker = shown.by_position @ turn(alpha)
        waves = columns(phase + self.time * turns)
        by_phase = np.einsum("tmic,tmc->tmi", by_walker, slope)
        by_alpha = np.einsum("tmic,tmc->tmi", shown.by_position, moving @ turn(alpha, 1).T)
        jacobian = np.empty((15, len(self.time), 2, 15 + len(state.shared)))
        by_coefficients = jacobian[..., :15].reshape(15, -1, 2, 5, 3)  # a view, filled below
        scaled = waves * shown.metres
        np.multiply(scaled[:, None, :, None], by_walker.swapaxes(0, 1)[..., None, :], out=by_coefficients)
        phases = np.stack([by_alpha, by_phase, by_phase * self.time[:, None, None]], axis=-1)
        jacobian[..., 15:18] = (phases * shown.metres).swapaxes(0, 1)
        jacobian[..., 18:] = (shown.by_parameters * shown.metres).swapaxes(0, 1)
        return jacobian

    def objective(self, state: _State, precision: np.ndarray, metres: float, deviance: float) -> float:
        """Half the weighted sum of squares, prior included; precision (frames, 15).

        The prior favours a smaller walker under a larger scale, because all its deviations from the mean shrink with
        it; the mode is then too small (by 4 % on six walks from two sides). Adding `deviance`, the prior's quadratic
        form at the start of the step, times the logarithm of the scale removes this bias.
        """
        residual, _ = self.residual(state, metres)
        off = state.walker - self.mean
        prior, _ = self.picture.prior(state.shared[3:])
        squares = (precision * (residual**2).sum(axis=-1)).sum() + off @ self.precision @ off + prior @ prior
        return 0.5 * float(squares) + deviance * self.picture.log_scale(state.shared[3:])[0]

    def normal(self, state: _State, precision: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Normal matrix (n, n), negative gradient (n,) of the objective, and the walker's deviance from the prior."""
        residual, _ = self.residual(state)
        count = 225 + len(state.shared)
        matrix, slope = np.zeros((count, count)), np.zeros(count)
        jacobian = self.jacobian(state)
        jacobian *= np.sqrt(precision).T[:, :, None, None]
        scaled = np.moveaxis(residual * np.sqrt(precision)[..., None], 1, 0)
        for m, (j, r) in enumerate(zip(jacobian, scaled, strict=True)):
            j = j.reshape(-1, j.shape[-1])
            own, square, pull = slice(15 * m, 15 * m + 15), j.T @ j, j.T @ r.reshape(-1)
            matrix[own, own], matrix[own, 225:] = square[:15, :15], square[:15, 15:]
            matrix[225:, own] = square[15:, :15]
            matrix[225:, 225:] += square[15:, 15:]
            slope[own] = pull[:15]
            slope[225:] += pull[15:]
        matrix[:225, :225] += self.precision
        slope[:225] -= self.precision @ (state.walker - self.mean)
        prior, rows = self.picture.prior(state.shared[3:])
        matrix[228:, 228:] += rows.T @ rows
        slope[228:] -= rows.T @ prior
        off = state.walker - self.mean
        deviance = float(off @ self.precision @ off)
        slope[228:] -= deviance * self.picture.log_scale(state.shared[3:])[1]
        if not self.turning:
            matrix[225, 225] += _HELD
        return matrix, slope, deviance


def _descend(
    problem: _Problem, state: _State, cycles: float
) -> tuple[_State, np.ndarray, Noise, np.ndarray, int, bool]:
    """Iterate until steps are small: state, normal matrix, noise, weights, iterations, converged."""
    residual, metres = problem.residual(state)
    level = first_noise(residual, problem.seen)
    damping = _DAMPING
    for iteration in range(1, _STEPS + 1):
        weights = robust_weights(residual, problem.seen, level.total, problem.robust)
        precision = weights / level.slow
        matrix, slope, deviance = problem.normal(state, precision)
        before = problem.objective(state, precision, metres, deviance)
        while True:
            step = _step(matrix, slope, damping)
            moved = state.moved(step)
            if problem.objective(moved, precision, metres, deviance) <= before + 1e-12 * abs(before):
                break
            damping *= 10
            if damping > 1e8:  # no descent: converged to rounding if the undamped step is small
                return state, matrix, level, weights, iteration, float(slope @ _step(matrix, slope, 0.0)) < _SMALL
        small = float(step @ matrix @ step) < _SMALL and damping <= _DAMPING
        state, damping = moved, max(damping / 10, 1e-9)
        residual, metres = problem.residual(state)
        weights = robust_weights(residual, problem.seen, level.total, problem.robust)
        level = noise(residual, weights, cycles)
        if small:
            break
    matrix, *_ = problem.normal(state, weights / level.slow)
    return state, matrix, level, weights, iteration, small


def _step(matrix: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
    """The damped step (n,), shortened to limit the change of view angle and phase."""
    damped = matrix + damping * np.diag(np.diag(matrix))
    step = cho_solve(cho_factor(damped, lower=True, check_finite=False), slope, check_finite=False)
    widest = np.abs(step[225:228]).max()
    return step * min(1.0, _WIDEST / max(widest, 1e-12))


def _precision(model) -> np.ndarray:
    """Inverse (225, 225) of the walker's covariance Eᵀ diag λ E + diag noise, by Woodbury's identity."""
    loose = np.repeat(1.0 / np.asarray(model.noise_, dtype=np.float64).reshape(-1), 3)
    e = np.concatenate([model.components_, np.asarray(model.mean_)[None]]).reshape(-1, 225)
    scaled = e * loose
    inner = np.diag(1.0 / np.append(model.explained_variance_, _SIZE**2)) + scaled @ e.T
    half = solve_triangular(np.linalg.cholesky(inner), scaled, lower=True)
    return np.diag(loose) - half.T @ half


def _checked(points, start, unknown, drift) -> np.ndarray:
    """Validate the arguments of `refine`; returns which points are seen, (frames, 15)."""
    if not isinstance(points, Points) or not isinstance(start, InitialEstimate):
        raise MotionError(
            f"points must be Points and start an InitialEstimate, got {type(points).__name__} and "
            f"{type(start).__name__}"
        )
    allowed = ("alpha", "elevation", "scale")
    if isinstance(unknown, str) or not set(unknown) <= set(allowed):
        raise MotionError(f"unknown must be a tuple of names from {allowed}, got {unknown!r}")
    checked_whole(drift, "drift", 0, 7)
    seen = np.isfinite(points.positions).all(axis=-1)
    strides = start.frequency * len(seen) / points.fps
    if strides < LEAST_CYCLES:
        raise GapError(
            f"{points.name or 'these points'} last {strides:.2f} strides; at least {LEAST_CYCLES:g} are needed"
        )
    often = seen.sum(axis=0) >= _FRAMES
    if often.sum() < 3:
        raise GapError(
            f"{points.name or 'these points'} show {often.sum()} of the 15 markers in {_FRAMES} frames or more; "
            "at least three are needed"
        )
    return seen


def _misfit(problem: _Problem, state: _State, weights: np.ndarray, noise: np.ndarray) -> float:
    """`WalkPosterior.misfit`, for the prior's `noise` (5, 15) [m²].

    What the walker leaves unexplained at the harmonics counts as the person's own. The noise of the points doesn't hide
    it, as it does in the posterior, which takes all residuals for noise.
    """
    off = state.walker - problem.mean
    square, count = off @ problem.precision @ off, 0
    residual, _ = problem.residual(state)
    waves = columns(state.shared[1] + problem.time * state.shared[2])
    for marker in np.flatnonzero(problem.seen.sum(axis=0) >= _FRAMES):
        weighted = waves * weights[:, marker, None]
        rest = np.linalg.lstsq(weighted.T @ waves, weighted.T @ residual[:, marker], rcond=None)[0]
        square += (rest**2 / noise[:, marker, None]).sum()
        count += rest.size
    return float(np.sqrt(square / count))


def _result(problem, state, matrix, level, weights, iterations, converged, model, points) -> WalkPosterior:
    order = np.r_[np.argsort(_BY_MARKER), 225 : len(matrix)]
    joint = cho_solve(cho_factor(matrix, lower=True), np.eye(len(matrix)))[np.ix_(order, order)]
    alpha, phase, turns = (float(a) for a in state.shared[:3])
    picture = problem.picture
    elevation, scale, drift = picture.view(state.shared[3:])
    seconds = (len(problem.time) - 1) / points.fps
    return WalkPosterior(
        coefficients=state.walker.reshape(15, 5, 3).swapaxes(0, 1), covariance=joint[:225, :225],
        alpha=float(np.remainder(alpha + np.pi, 2 * np.pi) - np.pi), elevation=float(elevation), scale=float(scale),
        frequency=turns / (np.pi * seconds), phase=float(np.remainder(phase - turns, 2 * np.pi)),
        path=picture.scale * picture.basis @ drift,
        names=("alpha", "phase", "turns", *picture.names), parameter_covariance=_SHARED * joint[225:, 225:],
        weights=weights,
        noise=np.sqrt(level.total), deviation=np.sqrt(level.deviation), inflation=np.asarray(model.inflation_),
        misfit=_misfit(problem, state, weights, np.asarray(model.noise_)), iterations=iterations,
        converged=bool(converged), phases=phase + problem.time * turns, _joint=joint,
    )  # fmt: skip
