"""Base class of the models of Fourier walkers: linear combinations of components, sampling, synthesis, storage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.principal_axes import numerical_rank, signs
from motionenv._core.validation import checked_whole, random_generator
from motionenv.arguments import Request
from motionenv.body.limbs import from_height
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.base import GaitModel
from motionenv.models.contact_rule import SAMPLES
from motionenv.models.eigenwalkers.fourier_series import (
    HIGHER,
    FourierWalker,
    body_heights,
    grounded,
    positions_at,
    stride_lengths,
)
from motionenv.models.eigenwalkers.locomotion import Gait, gait
from motionenv.models.eigenwalkers.speed import at_speed, longer
from motionenv.models.eigenwalkers.table import COEFFICIENTS
from motionenv.models.fpca.em_fit import fit_ppca
from motionenv.models.fpca.observations import Observations, group_centres
from motionenv.models.people.population import Person, average_person, draw_person
from motionenv.models.transforms import scaled
from motionenv.models.types import Components, Cycle, Treadmill, Walker
from motionenv.types import MARKERS, SPEED_RANGE, Motion

_EXCESS = np.radians(10.0)  # by which a drawn body may exceed its joint limits
_TRIES = 100
_MADE = 0.962  # mean ratio, ± 1 %, of the strides of walks that are made, with higher harmonics, to `stride_lengths`
_HIGHER = (2 * len(HIGHER), len(MARKERS), 3)


class FourierModel(GaitModel):
    r"""A walker is w = w̄ + Σ_n k_n e_n (paper B, eq. 3.3), with scores k ~ N(0, diag λ) (eq. 3.11).

    The frequency isn't part of w (paper B); its logarithm is regressed on the scores. Subclasses implement `fit`.

    Args:
        n_components: N; None takes the subclass's default, or the greatest possible number if that is fewer. Walkers
            that span fewer dimensions have fewer components.
        tol: with missing markers, stop when an iteration gains less than this fraction of the log-likelihood.
        max_iter: greatest number of iterations.

    Attributes:
        mean_: (5, 15, 3) [m], the average walker w̄; NaN for markers that no walk shows.
        components_: (N, 5, 15, 3), the eigenwalkers e_n, orthonormal as vectors of 225; the largest entry is positive.
        explained_variance_: (N,) λ = s² / (R - 1) [m²]; × 10⁶ gives paper B's mm².
        explained_variance_ratio_: (N,) λ as a share of the variance of all 225 entries.
        log_frequency_mean_, log_frequency_weights_, log_frequency_deviation_: log ω/2π [Hz] is the mean plus
            weights (N,) · k / √λ plus a residual of this standard deviation.
        speed_direction_: (5, 15, 3) change of a person's coefficients per change of the log stride length.
        speed_exponent_: power of speed that a person's step length follows.
        higher_: (12, 15, 3) of the `HIGHER` harmonics of walks, per length of strides; not part of w.
        learned_speeds_: (2,) least and greatest speed of the walks it was fitted to [m/s].
        n_people_, n_walkers_: number of people and of walks it was fitted to.
    """

    log_frequency_mean_: float
    log_frequency_weights_: np.ndarray
    log_frequency_deviation_: float
    speed_direction_: np.ndarray
    speed_exponent_: float
    higher_: np.ndarray
    learned_speeds_: np.ndarray
    n_people_: int
    n_walkers_: int
    learns_from: ClassVar[str] = "markers"
    _settings: ClassVar[tuple[str, ...]] = ("n_components", "tol", "max_iter")
    _stored: ClassVar[tuple[str, ...]] = (
        "mean_", "components_", "explained_variance_", "explained_variance_ratio_",
        "log_frequency_mean_", "log_frequency_weights_", "log_frequency_deviation_",
        "speed_direction_", "speed_exponent_", "learned_speeds_", "higher_",
    )  # fmt: skip
    _shapes: ClassVar[dict[str, tuple[int, ...]]] = {
        "mean_": COEFFICIENTS, "log_frequency_mean_": (), "log_frequency_deviation_": (),
        "speed_direction_": COEFFICIENTS, "speed_exponent_": (), "learned_speeds_": (2,),
        "higher_": _HIGHER,
    }  # fmt: skip
    _positive: ClassVar[tuple[str, ...]] = ()
    _needed: ClassVar[tuple[str, ...]] = MARKERS  # that at least one walker must show

    def __init__(self, n_components: int | None = None, tol: float = 1e-7, max_iter: int = 500) -> None:
        self.n_components, self.tol, self.max_iter = n_components, tol, max_iter
        self.card_: dict = {}

    def transform(self, walkers: Any) -> np.ndarray:
        """Scores k (..., N) [m] by least squares on the known entries (eq. 3.9, with 3D coefficients instead of 2D).

        Args:
            walkers: a `FourierWalker`, n of them, or coefficients (..., 5, 15, 3) [m]; NaN where unknown.

        Raises:
            MotionError: another shape, or infinite values.
        """
        self._check_fitted()
        if isinstance(walkers, FourierWalker):
            w = walkers.coefficients
        elif isinstance(walkers, (list, tuple)) and all(isinstance(a, FourierWalker) for a in walkers):
            w = np.array([a.coefficients for a in walkers])
        else:
            w = np.asarray(walkers, dtype=np.float64)
        if w.shape[-3:] != COEFFICIENTS or np.isinf(w).any():
            raise MotionError(f"walkers must be finite or NaN, of shape (..., 5, 15, 3), got {w.shape}")
        return self._scores(w)

    def inverse_transform(self, scores: ArrayLike) -> np.ndarray:
        """Coefficients (..., 5, 15, 3) [m] of the walkers with the given `scores` (..., N) [m] (eq. 3.3)."""
        return self.mean_ + np.tensordot(self._checked_scores(scores), self.components_, axes=1)

    def sample(self, n: int, seed: int | np.random.Generator | None = None) -> list[FourierWalker]:
        """Draw `n` walkers with scores from N(0, diag λ) and frequencies from the regression.

        Scores whose body exceeds its joint limits, such as knees that bend forwards, are drawn again.
        """
        n = checked_whole(n, "n", 1)
        rng = random_generator(seed)
        scores = np.array([self.draw_walker(rng).scores for _ in range(n)])
        frequencies = self.frequency(scores) * np.exp(self.log_frequency_deviation_ * rng.standard_normal(n))
        coefficients = self.inverse_transform(scores)
        return [FourierWalker(w, float(f), name="eigenwalker") for w, f in zip(coefficients, frequencies, strict=True)]

    def frequency(self, scores: ArrayLike) -> np.ndarray:
        """Expected strides per second (...) [Hz] of walkers with `scores` (..., N) [m]."""
        standard = self._checked_scores(scores) / np.sqrt(self.explained_variance_)
        return np.exp(self.log_frequency_mean_ + standard @ self.log_frequency_weights_)

    def score_samples(self, scores: ArrayLike) -> np.ndarray:
        """Log-density (...) of `scores` (..., N) [m] under N(0, diag λ) (eq. 3.11)."""
        scores, variance = self._checked_scores(scores), self.explained_variance_
        return -0.5 * (scores**2 / variance + np.log(2 * np.pi * variance)).sum(axis=-1)

    def score(self, walkers: Sequence[FourierWalker]) -> float:
        """Mean log-density of the scores of `walkers`, given as to `transform`."""
        return float(self.score_samples(self.transform(walkers)).mean())

    def gait_of(self, walker: Walker) -> Gait:
        """Body and overground path of `walker` at the walker's own speed."""
        return self._paced(walker, None, None)[0]

    def _paced(self, walker: Walker, speed: float | None, height: float | None) -> tuple[Gait, float]:
        """The walker at a `speed` [m/s] of a body of `height` [m], and strides per second.

        The gait has the size that the scores say; scaled to the height, it has the speed at the same frequency.
        """
        w, person = self.inverse_transform(walker.scores), walker.person
        tall = float(body_heights(w[None])[0])
        if height is None and person is not None:
            height = person.height
        own = speed if speed is None or height is None else speed * tall / height
        if speed and own and not SPEED_RANGE[0] <= own <= SPEED_RANGE[1]:
            low, high = (bound * speed / own for bound in SPEED_RANGE[:2])
            raise MotionError(
                f"speed must be from {low:.2g} to {high:.2g} m/s for a body of {height or tall:.2f} m, got {speed:g}"
            )
        if person is None:
            seconds = walker.stride_seconds or 1 / float(self.frequency(walker.scores))
            if own is None:
                return self._gait(w), 1 / seconds
            found = self._gait(at_speed(self, w, seconds, own))
        else:
            size = tall / person.height
            w = longer(self, w, np.log(2 * size * person.step_length / (_MADE * stride_lengths(w))))
            liked = size * person.speed
            own = liked if own is None else own
            found = self._gait(longer(self, w, self.speed_exponent_ * np.log(own / liked)))
        if height is None:
            return found, own / found.stride_length
        return found, own * found.skeleton.height / tall / found.stride_length

    def _gait(self, w: np.ndarray) -> Gait:
        return gait(np.concatenate([w, stride_lengths(w) * self.higher_]))

    def components(self) -> Components:
        """The eigenwalkers as components."""
        self._check_fitted()
        deviations = np.sqrt(self.explained_variance_)
        return Components(np.zeros(len(deviations)), deviations, self.explained_variance_ratio_)

    def treadmill(self) -> Treadmill:
        """The walk in place as Fourier series of markers; the drawn body has average proportions."""
        arrays = {
            "mean": self.mean_,
            "components": self.components_,
            "log_frequency_mean": np.asarray(self.log_frequency_mean_),
            "log_frequency_weights": self.log_frequency_weights_,
        }
        return Treadmill("markers", arrays, from_height(1.0).offsets, 1.75, self.crowd)

    def in_place(
        self, walkers: Sequence[Walker], *, speed: float | None = None, height: float | None = None,
        samples: int = SAMPLES,
    ) -> list[Cycle]:  # fmt: skip
        """One stride in place, at `samples` phases, of each of `walkers`, at a `speed` [m/s], of a `height` [m].

        The feet of the body that is fitted to the markers carry both.
        """
        return [self._in_place(walker, speed, height, samples) for walker in walkers]

    def _in_place(self, walker: Walker, speed: float | None, height: float | None, samples: int) -> Cycle:
        found, frequency = self._paced(walker, speed, height)
        cycle = found.in_place(samples, 1 / frequency)
        built = self._built(Motion(cycle.poses, cycle.body, samples), walker, height)
        size = built.skeleton.height / cycle.body.height
        return replace(
            cycle, markers=size * cycle.markers, poses=built.poses, body=built.skeleton, stride=size * cycle.stride
        )

    def crowd(self, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`Treadmill.crowd` of `scores` (n, q): no bodies are fitted."""
        w = self.inverse_transform(scores)
        heights = body_heights(w)
        steps = np.array([self._at_height(float(height)).step_length for height in heights])
        w = grounded(longer(self, w, np.log(2 * steps / (_MADE * stride_lengths(w)))))
        return positions_at(w, np.arange(SAMPLES) * (2 * np.pi / SAMPLES)), heights

    def _person_of(self, scores: np.ndarray) -> Person:
        return self._at_height(float(body_heights(self.inverse_transform(scores)[None])[0]))

    def _at_height(self, height: float) -> Person:
        stride, cadence = float(stride_lengths(self.mean_)), float(np.exp(self.log_frequency_mean_))
        return self._at_known_pace(average_person(height), stride * cadence, _MADE * stride)

    def body(self, height: float | None = None) -> None:
        """None for any `height`: each walker's markers determine its limb lengths."""

    def dimensions(self) -> dict[str, int]:
        """Numbers of markers and of coefficients of a walker."""
        self._check_fitted()
        return {"markers": len(MARKERS), "coefficients": int(self.mean_.size)}

    def draw_walker(
        self, rng: np.random.Generator, speed: float | None = None, height: float | None = None, person: str = "adult"
    ) -> Walker:
        """Draw a `person` of `height` [m] and scores from N(0, diag λ) with `rng`.

        Scores are drawn again if the body exceeds its joint limits. `speed` has no effect: `synthesize` takes it.

        Raises:
            ModelError: not fitted, or almost all walkers exceed their joint limits.
        """
        self._check_fitted()
        about = float(body_heights(self.mean_[None])[0])
        who = draw_person(rng, person=person, height=height, about=about)
        seconds = 2 * who.step_length / who.speed
        for _ in range(_TRIES):
            scores = rng.standard_normal(len(self.components_)) * np.sqrt(self.explained_variance_)
            walker = Walker(self.kind, tuple(scores), seconds, person=who)
            if self.gait_of(walker).excess < _EXCESS:
                return walker
        raise ModelError(
            f"{_TRIES} walkers in a row drawn from this model exceed their joint limits: it was fitted to too few or "
            "too noisy walkers; use fewer components, or give the walker"
        )

    def make_motion(self, walker: Walker, request: Request, rng: np.random.Generator) -> Motion:
        """The motion of a cylinder body that follows the markers of `walker` within about 1 cm, for a `request`.

        The markers determine limb lengths and angles. One cycle repeats, so `rng` has no effect.
        """
        found, frequency = self._paced(walker, request.speed, request.height)
        phases = 2 * np.pi * (request.phase + frequency * np.arange(request.frames) / request.fps)
        motion = found.motion(phases, request.fps, name="eigenwalker")
        return self._built(motion, walker, request.height)

    def _built(self, motion: Motion, walker: Walker, height: float | None) -> Motion:
        """The motion of a body as large and broad as the walker, or of a `height` [m]."""
        person = walker.person
        if person is None:
            return scaled(motion, height) if height else motion
        motion = scaled(motion, height or person.height)
        return replace(motion, skeleton=person.built(motion.skeleton))

    def learned_speeds(self) -> tuple[float, float]:
        """The slowest and the fastest captured walk [m/s]."""
        self._check_fitted()
        return tuple(self.learned_speeds_.tolist())

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and JSON-serialisable settings from which `from_arrays` restores the model."""
        self._check_fitted()
        settings = {name: getattr(self, name) for name in self._settings}
        meta = {"settings": settings, "n_people": self.n_people_, "n_walkers": self.n_walkers_}
        arrays = {name: np.asarray(getattr(self, name)) for name in self._stored}
        if missing := [name for name, mean in zip(MARKERS, self.mean_[0, :, 0], strict=True) if np.isnan(mean)]:
            arrays["mean_"], meta["missing"] = np.nan_to_num(self.mean_), missing  # model files hold finite numbers
        return arrays, meta

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """As `ModelFile.from_arrays`, without people's labels and scores."""
        model = cls(**meta["settings"])
        n = len(arrays["components_"])
        arrays = {"higher_": np.zeros(_HIGHER)} | arrays  # which files of 0.3 lack
        shapes = dict.fromkeys(cls._stored, (n,)) | cls._shapes | {"components_": (n, *COEFFICIENTS)}
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                raise ModelError(f"{name} has shape {arrays[name].shape}, expected {shape}: fit the model again")
            if name in cls._positive and not (arrays[name] > 0).all():
                raise ModelError(f"{name} must be above 0: fit the model again")
            setattr(model, name, arrays[name] if arrays[name].ndim else float(arrays[name]))
        model.n_people_, model.n_walkers_ = meta["n_people"], meta["n_walkers"]
        if missing := meta.get("missing"):
            unknown = np.isin(MARKERS, missing)[:, None]
            model.mean_ = np.where(unknown, np.nan, model.mean_)
        return model

    def _learn(self, rows: np.ndarray, rank: int) -> None:
        self.mean_, self.components_, self.explained_variance_, total = self._decomposed(rows, rank)
        if not len(self.components_):
            raise MotionError(f"these {len(rows)} walkers are all alike, so they have no components: check the data")
        self.explained_variance_ratio_ = self.explained_variance_ / total
        self.scores_ = self._scores(rows)

    def _decomposed(self, rows: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Mean (5, 15, 3), components (N, 5, 15, 3), λ (N,) and the sum of all λ, of the walkers in a table.

        N is `rank`, or the number of dimensions that complete walkers span if that is fewer. Markers that no walker
        shows are NaN in the mean and 0 in the components.
        """
        markers, gaps = _shown(rows, self._needed)
        shown = np.broadcast_to(markers[:, None], COEFFICIENTS).ravel()
        decompose = self._by_likelihood if gaps else _by_svd
        known_mean, known_components, variance, total = decompose(rows, shown, rank)
        mean, components = np.full(shown.size, np.nan), np.zeros((len(variance), shown.size))
        mean[shown], components[:, shown] = known_mean, signs(known_components)[:, None] * known_components
        return mean.reshape(COEFFICIENTS), components.reshape(-1, *COEFFICIENTS), variance, total

    def _by_likelihood(self, rows: np.ndarray, shown: np.ndarray, rank: int) -> tuple:
        """Like `_by_svd`, but for walkers with NaN: λ are eigenvalues of the covariance W Wᵀ + σ² I."""
        values, n = rows.reshape(len(rows), -1)[:, shown, None], len(rows)
        groups, basis = np.zeros(n, dtype=np.int64), np.eye(values.shape[1])
        centre = group_centres(values, groups, basis)
        data = Observations(values, basis, centre, groups)
        found = fit_ppca(data, rank, self.tol, self.max_iter)
        unbiased, noise = n / (n - 1), found.noise[0]
        total = unbiased * (found.variance.sum() + noise * len(basis))
        return found.means[0, :, 0], found.components[:, :, 0], unbiased * (found.variance + noise), float(total)

    def _scores(self, w: np.ndarray) -> np.ndarray:
        """Least-squares scores (..., N) of coefficients (..., 5, 15, 3); the shortest if underdetermined."""
        deviations = (w - self.mean_).reshape(-1, self.mean_.size)
        flat = self.components_.reshape(len(self.components_), -1)
        scores = np.empty((len(deviations), len(flat)))
        patterns, which = np.unique(np.isfinite(deviations), axis=0, return_inverse=True)
        for j, known in enumerate(patterns):
            rows = which.reshape(-1) == j
            scores[rows] = deviations[np.ix_(rows, known)] @ np.linalg.pinv(flat[:, known])
        return scores.reshape(*w.shape[:-3], len(flat))

    def _checked_scores(self, scores) -> np.ndarray:
        self._check_fitted()
        scores = np.asarray(scores, dtype=np.float64)
        if scores.ndim == 0 or scores.shape[-1] != len(self.components_) or not np.isfinite(scores).all():
            raise MotionError(f"scores must be finite, of shape (..., {len(self.components_)}), got {scores.shape}")
        return scores

    def _check_fitted(self) -> None:
        if not hasattr(self, "components_"):
            raise ModelError(
                f"this {type(self).__name__} is not fitted: call fit(walks) first, or motionenv.load(name)"
            )


def _shown(rows: np.ndarray, needed: tuple[str, ...]) -> tuple[np.ndarray, bool]:
    """Markers (15,) that at least one walker shows, and whether a walker lacks one of them."""
    known = np.isfinite(rows).all(axis=(1, 3))
    shown = known.any(axis=0)
    if unseen := [name for name, seen in zip(MARKERS, shown, strict=True) if name in needed and not seen]:
        raise GapError(
            f"no walker shows {', '.join(unseen)}: add walkers that do, or fill them first (motionenv.fill, or "
            "motionenv fit --fill)"
        )
    return shown, not bool(known[:, shown].all())


def _by_svd(rows: np.ndarray, shown: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Mean (n,), components (N, n), λ = s² / (R - 1) (N,) and the sum of all λ, of R complete walkers.

    Of the n entries `shown` (225,). N is at most `rank` and the walkers' numerical rank: components beyond it are
    rounding errors, which scores in standard deviations would make as large as any other.
    """
    x = rows.reshape(len(rows), -1)[:, shown]
    mean = x.mean(axis=0)
    _, s, vt = np.linalg.svd(x - mean, full_matrices=False)
    variance = s**2 / (len(rows) - 1)
    rank = min(rank, numerical_rank(s, x.shape, float(np.linalg.norm(x))))
    return mean, vt[:rank], variance[:rank], float(variance.sum())
