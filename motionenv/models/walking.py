r"""A person who walks: the functional PCA of paper A, given a root that carries it over the ground.

Paper A models the 19 relative joint angles. Here five more channels ride along in the same components: the three
rotations of the root and the heights of the two ankles. What remains, the way of the root, follows from contact:
the foot that moves back fastest under the body stands, so the body moves forward as fast, and as high as that
ankle's height says.
"""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv.body.skeleton import limb_radii, symmetric
from motionenv.errors import ModelError, MotionError
from motionenv.models.fpca import FunctionalPCA
from motionenv.models.store import save_model
from motionenv.types import Cycles, Motion, Skeleton

_RATE = 60.0  # frames per second at least, at which contact is integrated
_PADDING = 0.2  # seconds before and after, so that smoothing has no ends
_TOGETHER = 16  # walkers that are worth a thread
_USUAL = 8  # components
_NO_VARIANCE = 1e-9  # relative to the largest: what rounding leaves of none
_FASTEST = 3.0  # [m/s]
_SHORTEST = 0.5  # [s] stride time


@dataclass(frozen=True)
class Stride:
    """What one draw of a walker is: a person's mean scores and stride time."""

    scores: np.ndarray
    seconds: np.ndarray


@dataclass(frozen=True)
class _Tables:
    """What each walk needs and the model alone decides.

    Attributes:
        body: the mean body.
        people: (q + 1, q + 1) square root of the covariance of scores and log stride times.
        pace: (q,) change of the expected log stride time with each score.
        cycles: (q, q) square root of that of the control points of score splines.
        terms, heights: what `motionenv.models._walk_kernels.walk` takes.
    """

    body: Skeleton
    people: np.ndarray
    pace: np.ndarray
    cycles: np.ndarray
    terms: np.ndarray
    heights: np.ndarray


class WalkingModel:
    """Walks of people, learned from captured ones.

    A walker has mean scores s̄ and a stride time, jointly Gaussian over people and speeds; each of its cycles
    deviates from s̄ by what one person's cycles differ. Scores change along a cubic B-spline from cycle to cycle,
    and components are Fourier series, so that walks are smooth across the cycles' borders.

    Args:
        n_components: of the functional PCA; None takes 8, or one less than there are cycles if that is fewer.
        n_harmonics: constant and n_harmonics - 1 pairs per channel.

    Attributes:
        fpca_: the fitted `FunctionalPCA` of `motionenv.models.gait.CHANNELS`; phase 0 is where the left leg is
            furthest ahead of the right.
        proportions_: (16, 3) mean offsets of the body's nodes, both sides alike, shares of the body height.
        height_: mean body height [m].
        person_mean_, person_covariance_: of (scores, log stride time [s], log speed [body heights / s]) between
            trials, each person weighing the same.
        cycle_covariance_: (q, q) of the scores of one trial's cycles about their mean.
        card_: the model card.
    """

    kind = "walking"

    def __init__(self, n_components: int | None = None, n_harmonics: int = 12):
        self.n_components = n_components
        self.n_harmonics = n_harmonics
        self.card_: dict = {}

    def fit(self, motions, subjects) -> "WalkingModel":
        """Learn from straight walks.

        Args:
            motions: walks (frames, 25), each of at least two strides; gaps allowed.
            subjects: a person's label for each.

        Raises:
            MotionError: nothing to learn from, or a walk without a period.
        """
        # Here, because those who only synthesise would wait two seconds for what finds cycles in captured walks.
        from motionenv.models.gait import forward_speed, gait_channels, walking_cycles

        motions, subjects = list(motions), [str(s) for s in subjects]
        if len(motions) != len(subjects) or not motions:
            raise MotionError(f"fit needs a subject for each motion, got {len(motions)} and {len(subjects)}")
        channels = [gait_channels(m) for m in motions]
        cycles = walking_cycles(channels, [m.fps for m in motions], subjects)
        self.__dict__.pop("_tables", None)
        rank = min(_USUAL, len(cycles.values) - 1) if self.n_components is None else self.n_components
        self.fpca_ = FunctionalPCA(rank, self.n_harmonics).fit(cycles)
        self.proportions_ = symmetric(np.mean([m.skeleton.offsets / m.skeleton.height for m in motions], axis=0))
        self.height_ = float(np.mean([m.skeleton.height for m in motions]))
        speeds = np.array([forward_speed(m) / m.skeleton.height for m in motions])
        self._fit_people(cycles, speeds)
        return self

    def _fit_people(self, cycles: Cycles, speeds: np.ndarray) -> None:
        """Gaussian of trials' mean scores, stride times and speeds, and of cycles about their trial's mean."""
        seen = np.isfinite(cycles.values).mean((1, 2))
        trials = np.unique(cycles.sequence)
        rows, people, within = [], [], []
        for trial in trials:
            mine = cycles.sequence == trial
            weight = seen[mine] / seen[mine].sum()
            mean = weight @ self.fpca_.scores_[mine]
            rows.append([*mean, np.log(cycles.seconds[mine][0]), np.log(speeds[trial])])
            people.append(cycles.subject[np.flatnonzero(mine)[0]])
            within.append((self.fpca_.scores_[mine] - mean)[seen[mine] > 0.8])
        _, which, count = np.unique(people, return_inverse=True, return_counts=True)
        weight = 1.0 / count[which]
        self.person_mean_ = np.average(rows, axis=0, weights=weight)
        # One walk says nothing about others.
        self.person_covariance_ = (
            np.cov(np.transpose(rows), aweights=weight) if len(rows) > 1 else np.zeros(2 * [len(rows[0])])
        )
        spread = np.concatenate(within)
        self.cycle_covariance_ = spread.T @ spread / max(len(spread) - len(trials), 1)

    def sample(self, n: int, *, seed=None, speed: float | None = None) -> Stride:
        """Draw `n` walkers: their mean scores (n, q) and stride times (n,) [s].

        Args:
            n: how many.
            seed: int or Generator.
            speed: walking speed [m/s] of a body of mean height, on which to condition; None draws speeds too.

        Raises:
            MotionError: `speed` isn't between 0.1 and 3 m/s.
            ModelError: not fitted.
        """
        self._check_fitted()
        rng = np.random.default_rng(seed)
        mean, root = self.person_mean_[:-1], self._tables.people
        if speed is not None:
            if not 0.1 <= speed <= _FASTEST:
                raise MotionError(f"speed must be from 0.1 to {_FASTEST} m/s, got {speed!r}")
            gain = self.person_covariance_[:-1, -1] / max(self.person_covariance_[-1, -1], np.finfo(float).tiny)
            mean = mean + gain * (np.log(speed / self.height_) - self.person_mean_[-1])
            root = _root_of(self.person_covariance_[:-1, :-1] - np.outer(gain, self.person_covariance_[-1, :-1]))
        drawn = mean + rng.standard_normal((n, len(mean))) @ root.T
        return Stride(drawn[:, :-1], np.exp(drawn[:, -1]))

    def stride_seconds(self, scores) -> np.ndarray:
        """Stride times (...) [s] of people with `scores` (..., q): exp of the conditional mean of their logarithm."""
        self._check_fitted()
        deviations = np.asarray(scores, dtype=np.float64) - self.person_mean_[:-2]
        return np.exp(self.person_mean_[-2] + deviations @ self._tables.pace)

    def synthesize(
        self,
        seconds: float,
        fps: float = 60.0,
        *,
        n: int | None = None,
        seed=None,
        stride: Stride | None = None,
        speed: float | None = None,
        phase: float = 0.0,
        variation: float = 1.0,
        height: float | None = None,
    ) -> Motion:
        """New walks along x (as people do: within a few degrees), from the origin, on the ground z = 0.

        Args:
            seconds: duration [s].
            fps: frames per second.
            n: None for one walk (frames, 25), else a batch (n, frames, 25).
            seed: int or Generator for the walker and for how its cycles vary.
            stride: the walkers, from `sample`; None draws them.
            speed: walking speed along x [m/s]; None takes the walker's own.
            phase: where in the cycle to start [cycles]; 0 is the left leg furthest ahead.
            variation: factor on how much the cycles of one walker differ; 0 repeats one cycle exactly.
            height: body height [m]; None takes the mean.

        Raises:
            MotionError: a number out of range.
            ModelError: not fitted.
        """
        self._check_fitted()
        _check_request(seconds, fps, variation, phase, n)
        if speed is not None and not 0.1 <= speed <= _FASTEST:
            raise MotionError(f"speed must be from 0.1 to {_FASTEST} m/s, got {speed!r}")
        if stride is not None:
            self._check_stride(stride, n or 1)
        rng = np.random.default_rng(seed)
        body = self.skeleton(height)
        # Fitted speeds are in body heights per second, so that a tall person walks faster with the same scores.
        relative = None if speed is None else speed * self.height_ / body.height
        stride = self.sample(n or 1, seed=rng, speed=relative) if stride is None else stride
        frames = round(seconds * fps)
        shortest = min(_SHORTEST, *stride.seconds.tolist())  # [s], however fast they are asked to walk
        wobble = variation * self._wobble(stride, frames / fps, shortest, rng)
        poses = np.empty((n or 1, frames, 25))
        self._walk(stride, wobble, fps, phase, speed or 0.0, shortest, body, poses)
        return Motion(poses if n is not None else poses[0], body, fps, "walk")

    def skeleton(self, height: float | None = None) -> Skeleton:
        """The mean body, scaled to `height` [m]; None keeps the mean height.

        Raises:
            MotionError: `height` isn't between 0.5 and 2.5 m.
        """
        self._check_fitted()
        if height is None:
            return self._tables.body
        if not 0.5 <= height <= 2.5:
            raise MotionError(f"height must be from 0.5 to 2.5 m, got {height!r}")
        return Skeleton(self.proportions_ * height, limb_radii(height), height)

    def score(self, motions) -> float:
        """Mean log-density, under the model, of the scores of the cycles of captured walks.

        Args:
            motions: straight walks (frames, 25).
        """
        from motionenv.models.gait import gait_channels, walking_cycles

        self._check_fitted()
        motions = list(motions)
        cycles = walking_cycles([gait_channels(m) for m in motions], [m.fps for m in motions], range(len(motions)))
        return self.fpca_.score(cycles.values)

    def _wobble(self, stride: Stride, seconds: float, shortest: float, rng) -> np.ndarray:
        """Control points (n, cycles + 4, q) of the B-splines along which scores leave their mean."""
        n, q = stride.scores.shape
        count = math.ceil((seconds + 2 * _PADDING) / shortest) + 5
        return rng.standard_normal((n, count, q)) @ self._tables.cycles.T

    def _walk(self, stride: Stride, wobble, fps: float, phase: float, speed: float, shortest, body, poses) -> None:
        """Fill `poses` (n, frames, 25) with walks; many in as many threads as there are cores."""
        from motionenv.models._walk_kernels import walk

        finer = math.ceil(_RATE / fps)
        rate = float(fps * finer)
        scores = np.ascontiguousarray(stride.scores, dtype=np.float64)
        seconds = np.ascontiguousarray(stride.seconds, dtype=np.float64)
        clock = rate, math.ceil(_PADDING * rate), finer, float(phase), float(speed), shortest
        person = body.offsets, body.height
        terms, heights = self._tables.terms, self._tables.heights

        def fill(start: int, stop: int) -> None:
            walk(start, stop, scores, seconds, wobble, clock, terms, heights, person, poses)

        n = len(poses)
        if n <= _TOGETHER:
            return fill(0, n)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(lambda start: fill(start, min(start + _TOGETHER, n)), range(0, n, _TOGETHER)))

    @cached_property
    def _tables(self) -> _Tables:
        """What each walk needs; `fit` makes it anew."""
        from motionenv.models._walk_kernels import ORDER

        fpca, height = self.fpca_, self.height_
        samples, harmonics = len(fpca.mean_), fpca.n_harmonics
        series = np.concatenate([fpca.mean_coefficients_[None], fpca.component_coefficients_])
        series[:, 0] *= np.sqrt(1 / samples)
        series[:, 1:] *= np.sqrt(2 / samples)
        # The constant, then sine and cosine of each harmonic by turns.
        columns = [0, *np.column_stack([np.arange(harmonics, 2 * harmonics - 1), np.arange(1, harmonics)]).ravel()]
        ankles = np.concatenate([fpca.mean_[None], fpca.components_])[..., 22:]
        return _Tables(
            Skeleton(self.proportions_ * height, limb_radii(height), height),
            _root_of(self.person_covariance_[:-1, :-1]),
            # Of few walks it has no inverse: what they don't tell of the pace is left at the mean.
            np.linalg.pinv(self.person_covariance_[:-2, :-2], _NO_VARIANCE, hermitian=True)
            @ self.person_covariance_[:-2, -2],
            # A uniform cubic B-spline of unit-variance points has variance 0.46 to 0.5: scaled to keep the cycles'.
            _root_of(self.cycle_covariance_) / np.sqrt(0.48),
            np.ascontiguousarray(series[:, columns][..., ORDER]).reshape(len(series), -1),
            np.ascontiguousarray(np.moveaxis(ankles, -1, 0)),
        )

    def save(self, path, card: dict | None = None) -> None:
        """Write the fitted model to `path` (.npz) with a model `card`."""
        arrays, meta = self.to_arrays()
        save_model(path, self.kind, arrays, {**meta, "card": card or self.card_})

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and settings from which `from_arrays` makes the same model."""
        self._check_fitted()
        arrays, meta = self.fpca_.to_arrays()
        arrays = {f"fpca_{name}": value for name, value in arrays.items()}
        arrays |= {name: getattr(self, name) for name in _STORED}
        return arrays, {"fpca": meta, "height": self.height_}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> "WalkingModel":
        """The model that `to_arrays` took apart into `arrays` and `meta`.

        Raises:
            ModelError: shapes that don't belong together.
        """
        parts = {name.removeprefix("fpca_"): value for name, value in arrays.items() if name.startswith("fpca_")}
        fpca = FunctionalPCA.from_arrays(parts, meta["fpca"])
        model = cls(fpca.n_components, fpca.n_harmonics)
        model.fpca_, model.height_, model.card_ = fpca, float(meta["height"]), meta.get("card", {})
        q = fpca.n_components
        shapes = {"proportions_": (16, 3), "person_mean_": (q + 2,), "person_covariance_": (q + 2, q + 2)}
        for name in _STORED:
            if arrays[name].shape != shapes.get(name, (q, q)):
                raise ModelError(f"{name} has shape {arrays[name].shape}: fit the model again")
            setattr(model, name, arrays[name])
        return model

    def _check_stride(self, stride: Stride, n: int) -> None:
        """Refuse walkers that are not `n` of this model's."""
        if len(stride.seconds) != n:
            raise MotionError(f"stride holds {len(stride.seconds)} walkers and n asks for {n}: they must agree")
        seconds, want = np.asarray(stride.seconds), (n, self.fpca_.n_components)
        if np.shape(stride.scores) != want or not np.isfinite(stride.scores).all() or seconds.shape != (n,):
            raise MotionError(f"stride must hold finite scores {want} and stride times ({n},), as sample() draws them")
        if not (0.0 < seconds.min() and seconds.max() < np.inf):
            raise MotionError(f"stride times must be finite and above 0 s, got {seconds.min()!r} to {seconds.max()!r}")

    def _check_fitted(self) -> None:
        if not hasattr(self, "fpca_"):
            raise ModelError("this WalkingModel is not fitted: call fit(motions, subjects) first, or motionenv.load")


_STORED = ("proportions_", "person_mean_", "person_covariance_", "cycle_covariance_")


def _root_of(covariance: np.ndarray) -> np.ndarray:
    """The symmetric square root (k, k) of a covariance that may be singular.

    Unlike eigenvectors, whose signs differ between CPUs and libraries, it is unique: a seed gives one walk everywhere.
    """
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T


def _check_request(seconds, fps, variation, phase, n) -> None:
    """Refuse what can't be synthesised."""
    if not (0 < seconds <= 3600 and 1 <= fps <= 1000 and round(seconds * fps) >= 1):
        raise MotionError(
            f"seconds must be up to 3600 and fps from 1 to 1000, at least one frame; got {seconds!r}, {fps!r}"
        )
    if not 0 <= variation <= 10 or not math.isfinite(phase):
        raise MotionError(f"variation must be from 0 to 10 and phase finite, got {variation!r}, {phase!r}")
    if n is not None and (n != int(n) or n < 1):
        raise MotionError(f"n must be None or a whole number from 1, got {n!r}")
