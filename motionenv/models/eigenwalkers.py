"""Eigenwalkers: principal components of walkers in Fourier representation (paper B, section 3.1)."""

from typing import ClassVar, Self

import numpy as np

from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.harmonics import PARTS, Walker, centred, in_phase
from motionenv.models.observations import Observations, column_sums, group_centres
from motionenv.models.overground import Gait, gait
from motionenv.models.ppca import fit_ppca
from motionenv.models.regression import shrunk_regression
from motionenv.models.store import save_model
from motionenv.models.walkers import fourier_walker
from motionenv.types import MARKERS, Markers, Motion, checked_fps

_SHAPE = (len(PARTS), len(MARKERS), 3)
_USUAL = 30  # components the paper keeps of 80 walkers
_FASTEST = 3.0  # [m/s]
_EXCESS = np.radians(10.0)  # beyond its joint limits by less than this, a drawn body is fine
_TRIES = 100


class Eigenwalkers:
    r"""A walker is w = w̄ + Σ_n k_n e_n (eq. 3.3), with scores k ~ N(0, diag λ) (eq. 3.11).

    w are the 225 Fourier coefficients of `motionenv.models.harmonics`, in metres. One column of the matrix W is one
    person: several walks of one person are averaged first. Complete walkers are decomposed by SVD; with markers
    missing, by maximum likelihood (EM for probabilistic PCA, `motionenv.models.ppca`; complete, it gives the SVD's).

    Frequency is no part of w (paper B); its logarithm is regressed on the scores, shrunk as far as predicting left-out
    people asks for, so that drawn walkers step at a pace that suits them.

    Args:
        n_components: N; None keeps the paper's 30, or one less than there are people if that is fewer.
        tol: with markers missing, stop when an iteration gains less than this fraction of the log-likelihood.
        max_iter: iterations at most.

    Attributes:
        mean_: (5, 15, 3) [m], the average walker w̄.
        components_: (N, 5, 15, 3), the eigenwalkers e_n, orthonormal as vectors of 225; the largest entry is positive.
        explained_variance_: (N,) λ = s² / (R - 1) [m²]; × 10⁶ gives paper B's mm².
        explained_variance_ratio_: (N,) λ as a share of the variance of all 225 entries.
        log_frequency_mean_, log_frequency_weights_, log_frequency_deviation_: log ω/2π [Hz] is the mean plus
            weights (N,) · k / √λ plus a rest of this standard deviation.
        scores_: (R, N) [m] of the people it was fitted to.
        people_: (R,) their labels.
        n_people_, n_walkers_: R, and how many walks they made.
        card_: the model card that a loaded model carries.
    """

    kind = "eigenwalkers"
    _settings: tuple[str, ...] = ("n_components", "tol", "max_iter")
    _stored: tuple[str, ...] = (
        "mean_", "components_", "explained_variance_", "explained_variance_ratio_",
        "log_frequency_mean_", "log_frequency_weights_", "log_frequency_deviation_",
    )  # fmt: skip
    _shapes: ClassVar = {"mean_": _SHAPE, "log_frequency_mean_": (), "log_frequency_deviation_": ()}

    def __init__(self, n_components: int | None = None, tol: float = 1e-7, max_iter: int = 500):
        self.n_components = n_components
        self.tol = tol
        self.max_iter = max_iter
        self.card_: dict = {}

    def fit(self, walkers, subjects=None) -> "Eigenwalkers":
        """Learn mean and components of `walkers`.

        Args:
            walkers: `Walker`s, from `fourier_walker`; NaN in the coefficients of markers that were not seen.
            subjects: a person's label for each, whose walkers are averaged; None takes each for a person of its own.

        Raises:
            MotionError: fewer than two people, or not enough for n_components; labels and walkers don't match.
            GapError: a marker that nobody shows; names it.
        """
        walkers, subjects = labelled(walkers, subjects)
        coefficients, log_frequencies, self.people_ = mean_walkers(walkers, subjects)
        self.n_people_, self.n_walkers_ = len(coefficients), len(walkers)
        self._learn(coefficients, self._rank())
        standard = self.scores_ / np.sqrt(self.explained_variance_)
        fitted = shrunk_regression(standard, log_frequencies)
        self.log_frequency_mean_, self.log_frequency_weights_, self.log_frequency_deviation_ = fitted
        return self

    def fit_from_markers(self, markers, subjects=None) -> "Eigenwalkers":
        """`fit` on the `fourier_walker` of each of the captured walks.

        Args:
            markers: `Markers` of the 15 markers (frames, 15, 3) [m], one per walk.
            subjects: as in `fit`.

        Raises:
            MotionError: as `fourier_walker` and `fit`.
        """
        return self.fit([fourier_walker(m) for m in markers], subjects)

    def transform(self, walkers) -> np.ndarray:
        """Scores k by least squares on the entries that are known (eq. 3.9, with 3D coefficients in place of 2D ones).

        Args:
            walkers: a `Walker`, n of them, or coefficients (..., 5, 15, 3) [m]; NaN where unknown.

        Returns:
            (N,), (n, N) or (..., N) [m].

        Raises:
            MotionError: another shape, or infinite values.
        """
        self._check_fitted()
        if isinstance(walkers, Walker):
            w = walkers.coefficients
        elif isinstance(walkers, (list, tuple)) and all(isinstance(a, Walker) for a in walkers):
            w = np.array([a.coefficients for a in walkers])
        else:
            w = np.asarray(walkers, dtype=np.float64)
        if w.shape[-3:] != _SHAPE or np.isinf(w).any():
            raise MotionError(f"walkers must be finite or NaN, of shape (..., 5, 15, 3), got {w.shape}")
        return self._scores(w)

    def inverse_transform(self, scores) -> np.ndarray:
        """Coefficients (..., 5, 15, 3) [m] of the walkers with the given `scores` (..., N) [m] (eq. 3.3)."""
        return self.mean_ + np.tensordot(self._checked_scores(scores), self.components_, axes=1)

    def sample(self, n: int, seed=None) -> list[Walker]:
        """`n` new walkers, with frequencies that suit them; `seed` is an int or a Generator.

        Scores are drawn from N(0, diag λ), again where no body could do it: knees that bend forwards, for instance.

        Raises:
            MotionError: `n` is not a whole number above 0.
        """
        self._check_fitted()
        if isinstance(n, bool) or n != int(n) or n < 1:
            raise MotionError(f"n must be a whole number of walkers from 1, got {n!r}")
        rng = np.random.default_rng(seed)
        scores = np.stack([self._draw(rng)[0] for _ in range(int(n))])
        frequencies = self.frequency(scores) * np.exp(self.log_frequency_deviation_ * rng.standard_normal(int(n)))
        coefficients = self.inverse_transform(scores)
        return [Walker(w, float(f), name="eigenwalker") for w, f in zip(coefficients, frequencies, strict=True)]

    def frequency(self, scores) -> np.ndarray:
        """Strides per second (...) [Hz] that suit walkers with `scores` (..., N) [m]."""
        standard = self._checked_scores(scores) / np.sqrt(self.explained_variance_)
        return np.exp(self.log_frequency_mean_ + standard @ self.log_frequency_weights_)

    def score_samples(self, scores) -> np.ndarray:
        """Log-density (...) of `scores` (..., N) [m] under N(0, diag λ) (eq. 3.11)."""
        scores, variance = self._checked_scores(scores), self.explained_variance_
        return -0.5 * (scores**2 / variance + np.log(2 * np.pi * variance)).sum(axis=-1)

    def score(self, walkers) -> float:
        """Mean log-density of the scores of `walkers`, which are as in `transform`."""
        return float(self.score_samples(self.transform(walkers)).mean())

    def synthesize(self, seconds: float, fps: float = 60.0, *, k=None, seed=None, speed: float | None = None,
                   phase: float = 0.0, overground: bool = True) -> Markers:  # fmt: skip
        """The 15 markers of a walker over time (eq. 3.3, then 3.1), walking along x on the ground z = 0.

        Args:
            seconds: duration [s].
            fps: frames per second.
            k: scores (N,) [m]; zeros for the average walker; None draws them with `seed`.
            seed: int or Generator.
            speed: walking speed [m/s], by more or fewer strides per second; None takes the pace that suits the scores.
            phase: where in the cycle to start [cycles]; 0 is the left foot furthest ahead.
            overground: False keeps the walker in place, as on a treadmill.

        Raises:
            MotionError: a number out of range.
            ModelError: not fitted.
        """
        walker, angles = self._request(seconds, fps, k, seed, speed, phase)
        return Markers(MARKERS, walker.positions(angles, overground=overground), fps, name="eigenwalker")

    def walker_motion(self, seconds: float, fps: float = 60.0, *, k=None, seed=None, speed: float | None = None,
                      phase: float = 0.0, overground: bool = True) -> Motion:  # fmt: skip
        """The cylinder body that does what `synthesize` does with the same arguments.

        Limbs are as long as between the markers, angles are fitted to them; the markers then lie within about 1 cm.

        Args:
            seconds: duration [s].
            fps: frames per second.
            k: scores (N,) [m], or None.
            seed: int or Generator.
            speed: walking speed [m/s], or None.
            phase: where in the cycle to start [cycles].
            overground: False keeps the walker in place.

        Raises:
            MotionError: a number out of range.
            ModelError: not fitted.
        """
        walker, angles = self._request(seconds, fps, k, seed, speed, phase)
        return walker.motion(angles, fps, overground=overground, name="eigenwalker")

    def save(self, path, card: dict | None = None) -> None:
        """Write the fitted model to `path` (.npz) with a model `card` (a dict for people: data, licence, command)."""
        arrays, meta = self.to_arrays()
        save_model(path, self.kind, arrays, {**meta, "card": card or self.card_})

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and JSON-able settings from which `from_arrays` makes the same model."""
        self._check_fitted()
        settings = {name: getattr(self, name) for name in self._settings}
        counts = {"n_people": self.n_people_, "n_walkers": self.n_walkers_}
        return {name: np.asarray(getattr(self, name)) for name in self._stored}, {"settings": settings, **counts}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """The model that `to_arrays` took apart into `arrays` and `meta`; without labels and scores of the people.

        Raises:
            ModelError: shapes that don't belong together.
        """
        model = cls(**meta["settings"])
        n = len(arrays["components_"])
        shapes = dict.fromkeys(cls._stored, (n,)) | cls._shapes | {"components_": (n, *_SHAPE)}
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                raise ModelError(f"{name} has shape {arrays[name].shape}, expected {shape}: fit the model again")
            setattr(model, name, arrays[name] if arrays[name].ndim else float(arrays[name]))
        model.n_people_, model.n_walkers_, model.card_ = meta["n_people"], meta["n_walkers"], meta.get("card", {})
        return model

    def _learn(self, coefficients: np.ndarray, rank: int) -> None:
        """Mean, components, variances and scores of columns (R, 5, 15, 3)."""
        self.mean_, self.components_, self.explained_variance_, total = self._decomposed(coefficients, rank)
        self.explained_variance_ratio_ = self.explained_variance_ / total
        self.scores_ = self._scores(coefficients)

    def _decomposed(self, coefficients: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Mean (5, 15, 3), components (rank, 5, 15, 3), λ (rank,) and the sum of all λ, of columns (R, 5, 15, 3)."""
        _check_markers(coefficients)
        decompose = _by_svd if np.isfinite(coefficients).all() else self._by_likelihood
        mean, components, variance, total = decompose(coefficients.reshape(len(coefficients), -1), rank)
        signs = np.sign(np.take_along_axis(components, np.abs(components).argmax(axis=1)[:, None], axis=1))
        return mean.reshape(_SHAPE), (signs * components).reshape(-1, *_SHAPE), variance, total

    def _rank(self) -> int:
        """N.

        Raises:
            MotionError: too few people.
        """
        most = self.n_people_ - 1
        if most < 1:
            raise MotionError(
                f"eigenwalkers are how people differ, and the walks are of {self.n_people_}: add other people's "
                "(subjects= says who is who; of files, the name up to the first '_')"
            )
        rank = min(_USUAL, most) if self.n_components is None else self.n_components
        if not (1 <= rank <= most and rank == int(rank)):
            raise MotionError(
                f"{self.n_people_} people can have 1 to {most} eigenwalkers, asked for {rank}: "
                "fit more people (subjects= says who is who), or fewer components"
            )
        return int(rank)

    def _by_likelihood(self, x: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """What `_by_svd` gives, for x (R, 225) with NaN: eigenvalues of the model's covariance W Wᵀ + σ² I."""
        values, groups, basis = x[:, :, None], np.zeros(len(x), dtype=np.int64), np.eye(x.shape[1])
        centre = group_centres(column_sums(values, groups), basis)
        data = Observations(values, basis, centre, groups)
        means, components, signal, noise, _ = fit_ppca(data, rank, self.tol, self.max_iter)
        unbiased = len(x) / (len(x) - 1)
        total = unbiased * (signal.sum() + noise[0] * x.shape[1])
        return means[0, :, 0], components[:, :, 0], unbiased * (signal + noise[0]), float(total)

    def _scores(self, w: np.ndarray) -> np.ndarray:
        """Least-squares scores (..., N) of coefficients (..., 5, 15, 3); of least norm if too few are known."""
        deviations = (w - self.mean_).reshape(-1, self.mean_.size)
        flat = self.components_.reshape(len(self.components_), -1)
        scores = np.empty((len(deviations), len(flat)))
        patterns, which = np.unique(np.isfinite(deviations), axis=0, return_inverse=True)
        for j, known in enumerate(patterns):
            rows = which.reshape(-1) == j
            scores[rows] = deviations[np.ix_(rows, known)] @ np.linalg.pinv(flat[:, known])
        return scores.reshape(*w.shape[:-3], len(flat))

    def _draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Gait]:
        """Scores (N,) of a walker whose body keeps to its joint limits, and how it walks.

        Raises:
            ModelError: hardly any of the model's walkers does.
        """
        for _ in range(_TRIES):
            scores = rng.standard_normal(len(self.components_)) * np.sqrt(self.explained_variance_)
            walker = gait(self.inverse_transform(scores))
            if walker.excess < _EXCESS:
                return scores, walker
        raise ModelError(
            f"{_TRIES} walkers drawn from this model in a row bend their joints beyond their limits: it was fitted to "
            "too few or too noisy walkers; use fewer components, or give scores k="
        )

    def _request(self, seconds, fps, k, seed, speed, phase) -> tuple[Gait, np.ndarray]:
        """The walker asked for, and its phase (frames,) [rad] in each frame."""
        self._check_fitted()
        fps = checked_fps(fps)
        if not (0 < seconds <= 3600 and round(seconds * fps) >= 1 and np.isfinite(phase)):
            raise MotionError(
                f"seconds must be up to 3600, at least one frame, and phase finite; got {seconds!r}, {phase!r}"
            )
        if speed is not None and not 0.1 <= speed <= _FASTEST:
            raise MotionError(f"speed must be from 0.1 to {_FASTEST} m/s, got {speed!r}")
        if k is None:
            scores, walker = self._draw(np.random.default_rng(seed))
        else:
            scores, walker = self._checked_scores(k), gait(self.inverse_transform(k))
        frequency = float(self.frequency(scores)) if speed is None else speed / walker.stride_length
        return walker, 2 * np.pi * (phase + frequency * np.arange(round(seconds * fps)) / fps)

    def _checked_scores(self, scores) -> np.ndarray:
        """Scores as float64 (..., N).

        Raises:
            MotionError: another shape, or not finite.
        """
        self._check_fitted()
        scores = np.asarray(scores, dtype=np.float64)
        if scores.ndim == 0 or scores.shape[-1] != len(self.components_) or not np.isfinite(scores).all():
            raise MotionError(f"scores must be finite, of shape (..., {len(self.components_)}), got {scores.shape}")
        return scores

    def _check_fitted(self) -> None:
        if not hasattr(self, "components_"):
            raise ModelError("these Eigenwalkers are not fitted: call fit(walkers) first, or motionenv.load(name)")


def labelled(walkers, subjects) -> tuple[list[Walker], list[str]]:
    """The walkers, and the label of each.

    Args:
        walkers: `Walker`s.
        subjects: a person's label for each; None makes each a person of its own.

    Raises:
        MotionError: not Walkers, or not as many labels.
    """
    walkers = list(walkers)
    subjects = [str(s) for s in (range(len(walkers)) if subjects is None else subjects)]
    if len(subjects) != len(walkers) or not all(isinstance(w, Walker) for w in walkers):
        raise MotionError(f"fit needs Walkers and a subject for each, got {len(walkers)} and {len(subjects)}")
    return walkers, subjects


def mean_walkers(walkers: list[Walker], subjects: list[str]) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Per person the mean coefficients (R, 5, 15, 3) of what is known, the mean log frequency (R,), and the label.

    Args:
        walkers: n of them.
        subjects: (n,) the label of each one's person.
    """
    people = tuple(dict.fromkeys(subjects))
    w, log_frequencies = np.full((len(people), *_SHAPE), np.nan), np.empty(len(people))
    for i, person in enumerate(people):
        mine = [walker for walker, subject in zip(walkers, subjects, strict=True) if subject == person]
        stack = np.stack([walker.coefficients for walker in mine])
        known = np.isfinite(stack).sum(axis=0)
        np.divide(np.nansum(stack, axis=0), known, out=w[i], where=known > 0)
        log_frequencies[i] = np.mean([np.log(walker.frequency) for walker in mine])
    return centred(in_phase(w)), log_frequencies, people


def _check_markers(coefficients: np.ndarray) -> None:
    """Refuse markers that nobody shows: nothing says where they are."""
    unseen = np.flatnonzero(~np.isfinite(coefficients).all(axis=(1, 3)).any(axis=0))
    if unseen.size:
        raise GapError(f"no walker shows {', '.join(MARKERS[i] for i in unseen)}: add walkers that do")


def _by_svd(x: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Mean (225,), components (rank, 225), λ = s² / (R - 1) (rank,) and the sum of all λ, of complete x (R, 225)."""
    mean = x.mean(axis=0)
    _, s, vt = np.linalg.svd(x - mean, full_matrices=False)
    variance = s**2 / (len(x) - 1)
    return mean, vt[:rank], variance[:rank], float(variance.sum())
