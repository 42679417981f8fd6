r"""Everything about a walk at once from the raw points of one camera: maximum a posteriori by Gauss-Newton.

The closed forms of paper B (eqs. 3.9, 3.15, 4.6) take a two-dimensional Fourier series and one view. Here the points
themselves are explained, in every frame, by the walker of eq. 3.1, whose 225 coefficients have the model's Gaussian as
their prior (eq. 3.11 in full), by phase and frequency, by the view, and by the walker's way:

- without a camera: picture = scale · C(α, ε) Σ_h b_h(ωt + φ) w_h + a polynomial in time,
- with one: the walker stands on the ground at a polynomial in time, facing where it goes (within a few cm/s sideways),
  and `types.Camera` projects it. Where only K is known, the camera stands upright at an unknown height and elevation.
  Where not even the focal length is, take no camera and an unknown scale: that is weak perspective, good where the
  walker stays at about one distance.

Each step solves (JᵀPJ + Λ) Δ = JᵀP r - Λ (θ - θ₀), damped after Levenberg and Marquardt so that it stays in the basin
of its start. Points weigh by Student's t (iterated reweighting), so outliers lose their pull. How sure a result is
depends on how strides differ, which makes residuals last over many frames: they count by their power at the low
frequencies where coefficients live, not as independent (see `_noise`).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from motionenv.errors import GapError, MotionError
from motionenv.estimation.lifting._noise import Noise, first_noise, noise, robust_weights
from motionenv.estimation.lifting._pictures import Parallel, Perspective, turn
from motionenv.estimation.lifting.refined import Refined
from motionenv.estimation.lifting.series import LEAST_CYCLES
from motionenv.models.harmonics import columns
from motionenv.types import MARKERS, Camera, Points, frozen

_FRAMES = 8  # in which a marker must be seen to count as seen
_STEPS = 60
_SMALL = 1e-2  # squared length of the last step, in posterior standard deviations
_HELD = 1e12  # [1/rad²] precision of a view that is known
# By how much the variances of what all markers share grow: the root mean square of α's error over its deviation was
# 1.2 on people left out, at all views, with and without noise, gaps and a camera.
_SHARED = 1.45
_WIDEST = 0.3  # [rad] by which α, phase or elevation turn in one step
_DAMPING = 1e-3
_SIZE = 0.015  # share by which people's sizes differ beyond what a model of few people knows
#: (5, 15, 3) flattened, marker by marker
_BY_MARKER = np.arange(225).reshape(5, 15, 3).swapaxes(0, 1).reshape(-1)


@dataclass(frozen=True, eq=False)
class Start:
    """Where refining starts: the closed-form estimate.

    Attributes:
        coefficients: (5, 15, 3) [m], the walker.
        alpha: view angle [rad].
        frequency: strides per second [Hz].
        phase: of the first frame [rad].
        elevation: angle [rad] by which the camera looks down; with a camera of known pose it plays no part.
        scale: units of the picture per metre: 1 for metres; with a camera it plays no part.
    """

    coefficients: np.ndarray
    alpha: float
    frequency: float
    phase: float
    elevation: float = 0.0
    scale: float = 1.0

    def __post_init__(self):
        w = frozen(self.coefficients, (5, len(MARKERS), 3), "Start.coefficients")
        object.__setattr__(self, "coefficients", w)
        numbers = (self.alpha, self.frequency, self.phase, self.elevation, self.scale)
        if not (np.isfinite(w).all() and np.isfinite(numbers).all() and self.frequency > 0 and self.scale > 0):
            raise MotionError(
                "Start needs finite coefficients and numbers, frequency and scale above 0: got alpha, frequency, "
                f"phase, elevation, scale = {numbers}"
            )


def refine(model, points: Points, start: Start, *, camera: Camera | None = None, unknown: tuple[str, ...] = ("alpha",),
           drift: int = 3, robust: bool = True) -> Refined:  # fmt: skip
    """The walk that explains the `points` best, given the model's prior, from a `start` near it.

    Markers may be missing in some frames or in all: the prior fills them. What a picture leaves open (front or back
    in a level view from the side of a symmetric walker) stays as the start has it.

    Args:
        model: `WalkerPrior`: mean_, components_, explained_variance_, noise_, inflation_.
        points: of the 15 markers, at least 1.5 strides; pixels where there is a camera.
        start: the closed-form estimate.
        camera: pinhole camera that took the picture; None for a picture without perspective.
        unknown: what isn't known as in the start, of "alpha", "elevation" and, without a camera, "scale"; with a
            camera, "elevation" means that of its pose only uprightness is known.
        drift: degree in time of the polynomial along which the walker, or its picture, moves.
        robust: whether outliers lose weight; else all points count alike.

    Raises:
        MotionError: units, settings or start that don't go together; says which.
        GapError: too few points, or fewer than 1.5 strides.
    """
    seen = _checked(points, start, camera, unknown, drift)
    time = np.linspace(-1.0, 1.0, len(points.positions))
    basis = np.polynomial.legendre.legvander(time, drift)
    seconds = (len(time) - 1) / points.fps
    own = tuple(name for name in unknown if name != "alpha")
    picture: Parallel | Perspective
    if camera is None:
        picture = Parallel(basis, start.elevation, start.scale, own)
    else:
        picture = Perspective(basis, camera, seconds, start.elevation, own)
    problem = _Problem(model, points.upward, seen, picture, time, robust, "alpha" in unknown)
    state = problem.begin(start, np.pi * start.frequency * seconds)
    return _result(problem, *_descend(problem, state, start.frequency * seconds), model, points, camera)


@dataclass(frozen=True, eq=False)
class _State:
    """Values of all that is unknown: w (225,) marker by marker, α, phase in mid-time, half the turns, picture's own."""

    walker: np.ndarray
    shared: np.ndarray

    def moved(self, step: np.ndarray) -> "_State":
        return _State(self.walker + step[:225], self.shared + step[225:])


class _Problem:
    """Residuals in metres, their derivatives, and the prior."""

    def __init__(self, model, target, seen, picture, time, robust, turning=True):
        self.target, self.seen, self.picture, self.time = np.where(seen[..., None], target, 0.0), seen, picture, time
        self.robust, self.turning = robust, turning
        self.mean = np.asarray(model.mean_).reshape(-1)[_BY_MARKER]
        self.precision = _precision(model)[np.ix_(_BY_MARKER, _BY_MARKER)]

    def begin(self, start: Start, turns: float) -> _State:
        """The start with the offset, drift or way that suits it."""
        walker = start.coefficients.reshape(-1)[_BY_MARKER]
        own = np.zeros(len(self.picture.names))
        if "elevation" in self.picture.unknown:
            own[0] = start.elevation
        shared = np.concatenate([[start.alpha, start.phase + turns, turns], own])
        weights = self.seen.astype(float)
        for _ in range(4):  # outliers pull less each time
            shared[3:] = self.picture.place(self.places(_State(walker, shared)), self.target, weights, shared[3:])
            residual, _ = self.residual(_State(walker, shared))
            if not self.robust:
                break
            weights = robust_weights(residual, self.seen, first_noise(residual, self.seen).total)
        return _State(walker, shared)

    def places(self, state: _State) -> np.ndarray:
        """(frames, 15, 3) [m] in the level frame, the walker being in place."""
        return self._moving(state, 0) @ turn(state.shared[0]).T

    def _moving(self, state: _State, derivative: int) -> np.ndarray:
        """(frames, 15, 3) [m] of the walker, or the derivative by phase."""
        waves = columns(state.shared[1] + self.time * state.shared[2], derivative)
        parts = state.walker.reshape(15, 5, 3).swapaxes(0, 1).reshape(5, 45)
        return (waves @ parts).reshape(-1, 15, 3)

    def residual(self, state: _State, metres=None) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (frames, 15, 2) [m] and the metres per unit (frames,) they are converted with."""
        shown = self.picture.show(self.places(state), state.shared[3:])
        metres = shown.metres if metres is None else metres
        return np.where(self.seen[..., None], self.target - shown.picture, 0.0) * metres[:, None, None], metres

    def jacobian(self, state: _State) -> np.ndarray:
        """Derivatives (15, frames, 2, 15 + shared) [m] of the picture by each marker's 15 coefficients and the rest."""
        alpha, phase, turns = state.shared[:3]
        moving, slope = self._moving(state, 0), self._moving(state, 1)
        shown = self.picture.show(moving @ turn(alpha).T, state.shared[3:])
        by_walker = shown.by_place @ turn(alpha)
        waves = columns(phase + self.time * turns)
        by_phase = np.einsum("tmic,tmc->tmi", by_walker, slope)
        by_alpha = np.einsum("tmic,tmc->tmi", shown.by_place, moving @ turn(alpha, 1).T)
        jacobian = np.empty((15, len(self.time), 2, 15 + len(state.shared)))
        by_coefficients = jacobian[..., :15].reshape(15, -1, 2, 5, 3)  # a view
        scaled = waves * shown.metres[:, None]
        np.multiply(scaled[:, None, :, None], by_walker.swapaxes(0, 1)[..., None, :], out=by_coefficients)
        phases = np.stack([by_alpha, by_phase, by_phase * self.time[:, None, None]], axis=-1)
        jacobian[..., 15:18] = (phases * shown.metres[:, None, None, None]).swapaxes(0, 1)
        jacobian[..., 18:] = (shown.by_own * shown.metres[:, None, None, None]).swapaxes(0, 1)
        return jacobian

    def objective(self, state: _State, precision: np.ndarray, metres: np.ndarray, unlike: float) -> float:
        """Half the weighted sum of squares, the prior's among them; precision (frames, 15).

        A smaller walker under a larger scale would be nearer to the average in all that tells it from the average, so
        the most probable pair is too small (by 4 % on six walks from two sides). The unlikeness of the step's start,
        times the logarithm of the scale, takes this pull out: how unlike others somebody is shall not tell the scale.
        """
        residual, _ = self.residual(state, metres)
        off = state.walker - self.mean
        prior, _ = self.picture.prior(state.shared[3:], state.shared[0])
        squares = (precision * (residual**2).sum(axis=-1)).sum() + off @ self.precision @ off + prior @ prior
        return 0.5 * float(squares) + unlike * self.picture.log_scale(state.shared[3:])[0]

    def normal(self, state: _State, precision: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """The normal matrix (n, n), the downhill gradient (n,) of the objective, and the unlikeness there."""
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
        prior, rows = self.picture.prior(state.shared[3:], state.shared[0])
        free = np.r_[225, 228:count]  # α and the picture's own
        matrix[np.ix_(free, free)] += rows.T @ rows
        slope[free] -= rows.T @ prior
        off = state.walker - self.mean
        unlike = float(off @ self.precision @ off)
        slope[228:] -= unlike * self.picture.log_scale(state.shared[3:])[1]
        if not self.turning:
            matrix[225, 225] += _HELD
        return matrix, slope, unlike


def _descend(
    problem: _Problem, state: _State, cycles: float
) -> tuple[_State, np.ndarray, Noise, np.ndarray, int, bool]:
    """Steps until they are small: state, normal matrix, noise, weights, steps taken, converged."""
    residual, metres = problem.residual(state)
    level = first_noise(residual, problem.seen)
    damping = _DAMPING
    for iteration in range(1, _STEPS + 1):
        weights = robust_weights(residual, problem.seen, level.total, problem.robust)
        precision = weights / (level.slow * problem.picture.together)
        matrix, slope, unlike = problem.normal(state, precision)
        before = problem.objective(state, precision, metres, unlike)
        while True:
            step = _step(matrix, slope, damping)
            moved = state.moved(step)
            if problem.objective(moved, precision, metres, unlike) <= before + 1e-12 * abs(before):
                break
            damping *= 10
            if damping > 1e8:  # no way down: rounding, if the undamped step is small
                return state, matrix, level, weights, iteration, float(slope @ _step(matrix, slope, 0.0)) < _SMALL
        small = float(step @ matrix @ step) < _SMALL and damping <= _DAMPING
        state, damping = moved, max(damping / 10, 1e-9)
        residual, metres = problem.residual(state)
        weights = robust_weights(residual, problem.seen, level.total, problem.robust)
        level = noise(residual, weights, cycles)
        if small:
            break
    matrix, *_ = problem.normal(state, weights / (level.slow * problem.picture.together))
    return state, matrix, level, weights, iteration, small


def _step(matrix: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
    """The damped step (n,), shortened where it would turn the view or the phase far."""
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


def _checked(points, start, camera, unknown, drift) -> np.ndarray:
    """Which points are seen, (frames, 15).

    Raises:
        MotionError: settings that don't go together.
        GapError: too few points.
    """
    if not isinstance(points, Points) or not isinstance(start, Start):
        raise MotionError(f"refine needs Points and a Start, got {type(points).__name__} and {type(start).__name__}")
    allowed = ("alpha", "elevation") if camera is not None else ("alpha", "elevation", "scale")
    if isinstance(unknown, str) or not set(unknown) <= set(allowed):
        where = "with" if camera is not None else "without"
        raise MotionError(f"unknown must be a tuple out of {allowed} {where} a camera, got {unknown!r}")
    if camera is not None and points.unit != "px":
        raise MotionError(f"points that a camera took must be in pixels, got unit {points.unit!r}")
    if isinstance(drift, bool) or drift not in range(1 if camera is not None else 0, 8):
        raise MotionError(f"drift must be a degree from 0 (1 with a camera) to 7, got {drift!r}")
    seen = np.isfinite(points.positions).all(axis=-1)
    strides = start.frequency * len(seen) / points.fps
    if strides < LEAST_CYCLES:
        raise GapError(
            f"{points.name or 'these points'} last {strides:.2f} strides: refining needs {LEAST_CYCLES:g} at least"
        )
    often = seen.sum(axis=0) >= _FRAMES
    if often.sum() < 3:
        raise GapError(
            f"{points.name or 'these points'} show {often.sum()} of the 15 markers in {_FRAMES} frames or more: "
            "refining needs three at least"
        )
    return seen


def _result(problem, state, matrix, level, weights, iterations, converged, model, points, camera) -> Refined:
    """What was found, with its covariance."""
    order = np.r_[np.argsort(_BY_MARKER), 225 : len(matrix)]
    joint = cho_solve(cho_factor(matrix, lower=True), np.eye(len(matrix)))[np.ix_(order, order)]
    alpha, phase, turns = (float(a) for a in state.shared[:3])
    picture, own = problem.picture, state.shared[3:]
    _, metres = problem.residual(state)
    azimuth = 0.0
    if isinstance(picture, Parallel):
        elevation, scale, drift = picture.view(own)
        path = picture.scale * picture.basis @ drift
    else:
        azimuth = picture.azimuth
        rotation, shift = picture.pose(own)
        camera = replace(camera, R=rotation @ turn(azimuth), t=shift)
        elevation, scale = float(np.arcsin(-camera.R[2, 2])), float(1 / metres.mean())
        path = np.column_stack([picture.basis @ picture.way(own), picture.drift(own)]) @ turn(azimuth)
    seconds = (len(problem.time) - 1) / points.fps
    return Refined(
        coefficients=state.walker.reshape(15, 5, 3).swapaxes(0, 1), covariance=joint[:225, :225],
        alpha=float(np.remainder(alpha + np.pi, 2 * np.pi) - np.pi), elevation=float(elevation), scale=float(scale),
        frequency=turns / (np.pi * seconds), phase=float(np.remainder(phase - turns, 2 * np.pi)), path=path,
        names=("alpha", "phase", "turns", *picture.names), parameter_covariance=_SHARED * joint[225:, 225:],
        weights=weights,
        noise=np.sqrt(level.total), deviation=np.sqrt(level.deviation), inflation=np.asarray(model.inflation_),
        iterations=iterations, converged=bool(converged), camera=camera, phases=phase + problem.time * turns,
        _basis=picture.basis, _azimuth=azimuth, _joint=joint,
    )  # fmt: skip
