r"""Overground walking: the functional PCA of paper A, with a root trajectory from ground contact.

Paper A models the 19 relative joint angles. This model adds five channels to the same components: the three rotations
of the root and the heights of the two ankles. The root's position follows from contact: the foot that moves backwards
fastest relative to the body is the stance foot, whose speed gives the body's forward speed and whose ankle height gives
the root's height.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv._core.threads import everywhere
from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.arguments import Request
from motionenv.body.gaps import known_markers
from motionenv.body.limbs import limb_radii
from motionenv.body.skeleton import NODES, symmetric
from motionenv.errors import FitWarning, GapError, ModelError, MotionError
from motionenv.models.base import GaitModel
from motionenv.models.contact_rule import SAMPLES
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.people.pace import Pace, fit_pace
from motionenv.models.people.population import Person, average_person, draw_person
from motionenv.models.types import Components, Cycle, Treadmill, Walker
from motionenv.models.walking.tables import CHANNELS, Tables, floors_of, lacking_angles, root_of, series_of, tables_of
from motionenv.types import HEIGHT_RANGE, SPEED_RANGE, Cycles, Motion, Skeleton

if TYPE_CHECKING:
    from motionenv.models.walking.strides import WalkStrides

_RATE = 60.0  # least frame rate [Hz] at which contact is integrated
_PADDING = 0.2  # [s] before and after, so that smoothing has no edge effects
_TOGETHER = 16  # walkers per thread, enough to pay for it
_USUAL = 8  # components
_LEG = [NODES.index("left_knee"), NODES.index("left_ankle")]
_SHORTEST = 0.5  # stride time [s]
_STRIDES = (0.05, 60.0)  # [s]; adults have 0.6 to 2.3 at 5 standard deviations, who is 0.5 m tall and fast 0.2
_WHOLE = 0.8  # least share of the samples that its walk could show, for a cycle to tell how cycles vary
_UNEVEN = 3.0  # times the median trial's variance between cycles
_DRAWN = 300  # walks that tell how long strides are


@dataclass(frozen=True, repr=False)
class WalkerScores(OneLine):
    """Walkers as arrays: mean scores (n, q) and stride times (n,) [s]."""

    scores: np.ndarray
    seconds: np.ndarray


class WalkingModel(GaitModel):
    """Model of overground walks.

    A walker has mean scores s̄ and a stride time, jointly Gaussian over people and speeds. The scores of its cycles
    vary around s̄ as one person's cycles do. Scores change from cycle to cycle along a cubic B-spline, and components
    are Fourier series, so that walks are smooth where cycles meet. People's bodies, speeds and walk ratios are those of
    `motionenv.models.people.population`; at another speed a person's steps are longer and quicker by `pace_`.

    Args:
        n_components: components of the functional PCA; None takes 8, or one less than the number of cycles if that is
            fewer.
        n_harmonics: a constant and n_harmonics - 1 cosine-sine pairs per channel.

    Attributes:
        fpca_: the fitted `FunctionalPCA` of `motionenv.models.walking.preprocessing.CHANNELS`. At phase 0 the left leg
            is furthest ahead of the right.
        proportions_: (16, 3) mean offsets of the body's nodes, left-right symmetric, in body heights.
        height_: mean body height [m].
        person_mean_, person_covariance_: mean and covariance over trials of (scores, log stride time [s], log speed
            [body heights / s]), with equal weight for each person.
        cycle_covariance_: (q, q) covariance of the scores of one trial's cycles about their mean.
        pace_: change of gait with speed.
        card_: the model card.
    """

    kind = "walking"
    about = "Joint angles of whole gait cycles as functions: an average and how people differ from it."
    batch_size: ClassVar[int] = 32
    person_mean_: np.ndarray
    person_covariance_: np.ndarray
    cycle_covariance_: np.ndarray
    pace_: Pace

    def __init__(self, n_components: int | None = None, n_harmonics: int = 12) -> None:
        self.n_components, self.n_harmonics = n_components, n_harmonics
        self.card_: dict = {}

    def fit(
        self, motions: Sequence[Motion], subjects: Sequence[str] | None = None,
        strides: Sequence[WalkStrides] | None = None,
    ) -> WalkingModel:  # fmt: skip
        """Fit the model to walks of one stride or more, straight or on curves, on a floor or on a treadmill.

        Args:
            motions: walks (frames, 25); gaps allowed. Neck and arms may be missing: in some walks, whose others then
                tell of them, or in all, and then they are NaN in what the model makes.
            subjects: the person's label for each walk; None takes each walk for a different person.
            strides: of each walk; None finds them (`motionenv.models.walking.strides.walk_strides`).

        Raises:
            MotionError: no walks, labels or strides that don't match them, or a walk without a stride.
            GapError: all walks lack a leg, without which feet can't stand.
        """
        # Imported here: it takes two seconds, and synthesis doesn't need it.
        from motionenv.models.walking.strides import captured_cycles, walk_strides

        motions = list(motions)
        subjects = [str(s) for s in (range(len(motions)) if subjects is None else subjects)]
        if len(motions) != len(subjects) or not motions:
            raise MotionError(f"fit needs a subject for each motion, got {len(motions)} and {len(subjects)}")
        walks = [walk_strides(m) for m in motions] if strides is None else list(strides)
        if len(walks) != len(motions):
            raise MotionError(f"fit needs the strides of each motion, got {len(walks)} for {len(motions)} motions")
        cycles = captured_cycles(motions, walks, subjects)
        self.__dict__.pop("_tables", None)
        rank = min(_USUAL, len(cycles.values) - 1) if self.n_components is None else self.n_components
        # Cycles that show less than half a stride would make the second component's variance half as large again.
        fpca = FunctionalPCA(rank, self.n_harmonics, residual_harmonics=0, least_seen=0.5, max_iter=2000)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FitWarning)  # what they advise isn't an argument here
            fpca.fit(cycles)
        _check_legs(fpca.channels_)
        self.fpca_ = fpca
        self.proportions_ = symmetric(np.mean([m.skeleton.offsets / m.skeleton.height for m in motions], axis=0))
        self.height_ = float(np.mean([m.skeleton.height for m in motions]))
        speeds = np.array([walk.speed / m.skeleton.height for m, walk in zip(motions, walks, strict=True)])
        self._fit_people(cycles, speeds)
        return self

    def _fit_people(self, cycles: Cycles, speeds: np.ndarray) -> None:
        """Fit the Gaussians of trials and of their `cycles`, and `pace_`; `speeds` (trials,) [body heights / s]."""
        scores, seen = self.fpca_.scores_, np.isfinite(cycles.values).mean((1, 2))
        rows, people, within = [], [], []
        for trial in np.unique(cycles.sequence):
            mine = cycles.sequence == trial
            weight = seen[mine] / seen[mine].sum()
            mean = weight @ scores[mine]
            whole = seen[mine] / np.isfinite(cycles.values[mine]).any((0, 1)).mean() > _WHOLE
            rows.append([*mean, np.log(cycles.seconds[mine]).mean(), np.log(speeds[trial])])
            people.append(cycles.subject[np.flatnonzero(mine)[0]])
            within.append((scores[mine] - mean)[whole])
        taken = np.array(rows)
        _, which, count = np.unique(people, return_inverse=True, return_counts=True)
        weight = 1.0 / count[which]
        self.person_mean_ = np.average(taken, axis=0, weights=weight)
        one = len(rows) == 1  # a single walk has no covariance
        self.person_covariance_ = np.zeros(2 * taken.shape[1:]) if one else np.cov(taken.T, aweights=weight)
        self.cycle_covariance_ = _even(within)
        self.pace_ = self._fitted_pace(taken, people)

    def _fitted_pace(self, rows: np.ndarray, people: list[str]) -> Pace:
        """Effect of speed, from trials' (scores, log stride time, log speed) and the strides of synthetic walks."""
        fpca, q = self.fpca_, self.fpca_.n_components_
        spread = 1.5 * root_of(self.person_covariance_[:q, :q])  # a little wider than people
        scores = self.person_mean_[:q] + np.random.default_rng(0).standard_normal((_DRAWN, q)) @ spread
        lengths = np.log(self._of_mean_body(scores, 0.0)[1] / self.height_)
        knees = [fpca.channels_.index(f"{side}_knee_flexion") for side in ("left", "right")]
        bend = np.mean([fpca.components_[:, fpca.mean_[:, i].argmax(), i] for i in knees], axis=0)
        own = self.standard(rows[:, :q]), people, rows[:, q + 1], rows[:, q] + rows[:, q + 1]
        return fit_pace(*own, self.standard(scores), lengths, bend * self.components().deviations)

    def standard(self, scores: np.ndarray) -> np.ndarray:
        """`scores` (..., q) in standard deviations from the average person."""
        components = self.components()
        return (scores - components.means) / (components.deviations + (components.deviations == 0))

    def _scores(self, z: np.ndarray) -> np.ndarray:
        components = self.components()
        return components.means + z * components.deviations

    def sample(
        self, n: int, *, seed: int | np.random.Generator | None = None, speed: float | None = None
    ) -> WalkerScores:
        """Draw `n` walkers by `seed`, int or Generator: mean scores (n, q) and stride times (n,) [s].

        `speed` conditions on this walking speed [m/s] of a body of mean height; None doesn't condition.

        Raises:
            MotionError: `speed` isn't between 0.1 and 3 m/s.
            ModelError: not fitted.
        """
        self._check_fitted()
        rng = random_generator(seed)
        mean, root = self.person_mean_[:-1], self._tables.people
        if speed is not None:
            checked_number(speed, "speed", *SPEED_RANGE)
            gain = self.person_covariance_[:-1, -1] / max(self.person_covariance_[-1, -1], np.finfo(float).tiny)
            mean = mean + gain * (np.log(speed / self.height_) - self.person_mean_[-1])
            root = root_of(self.person_covariance_[:-1, :-1] - np.outer(gain, self.person_covariance_[-1, :-1]))
        drawn = mean + rng.standard_normal((n, len(mean))) @ root.T
        return WalkerScores(drawn[:, :-1], np.exp(drawn[:, -1]))

    def stride_seconds(self, scores: ArrayLike) -> np.ndarray:
        """Stride times (...) [s] of people with `scores` (..., q): exp of the conditional mean of the log."""
        self._check_fitted()
        deviations = np.asarray(scores, dtype=np.float64) - self.person_mean_[:-2]
        return np.exp(self.person_mean_[-2] + deviations @ self._tables.pace)

    def walks(
        self, seconds: float, fps: float = 30.0, *, n: int, seed: int | np.random.Generator | None = None,
        stride: WalkerScores | None = None, speed: float | None = None, phase: float = 0.0, variation: float = 1.0,
        skeleton: Skeleton | None = None,
    ) -> Motion:  # fmt: skip
        """Walks (n, frames, 25) of many people with one body, otherwise like `synthesize`, of `seconds` [s] at `fps`.

        Args:
            n, seed: number of walks, and int or Generator for the walkers and the variation between cycles.
            stride: the walkers, from `sample`; None draws them.
            speed: walking speed along x [m/s]; None takes the walkers' own.
            phase: phase at the start [cycles]; at 0 the left leg is furthest ahead.
            variation: factor on the variation between the cycles of one walker; 0 repeats one cycle exactly.
            skeleton: their body; None takes the mean.

        Raises:
            MotionError: a number out of range.
            ModelError: not fitted.
        """
        self._check_fitted()
        request = Request(seconds, fps, speed, None, phase, variation)
        self._warn_beyond([speed])
        checked_whole(n, "n", 1)
        rng = random_generator(seed)
        body = self.skeleton() if skeleton is None else skeleton
        if stride is None:
            known = None if speed is None else float(np.clip(speed / body.height, *self.pace_.speeds) * self.height_)
            stride = self.sample(n, seed=rng, speed=known)
        else:
            self._check_stride(stride, n)
        offsets, heights, speeds = (np.repeat(a, n, axis=0) for a in (body.offsets[None], [body.height], [speed or 0]))
        return Motion(self._poses(stride, request, rng, (offsets, heights), speeds), body, fps, "walk")

    def components(self) -> Components:
        """The components of `fpca_`, about the average person."""
        self._check_fitted()
        deviations = np.sqrt(self.fpca_.explained_variance_)
        return Components(self.person_mean_[: len(deviations)], deviations, self.fpca_.explained_variance_ratio_)

    def treadmill(self) -> Treadmill:
        """The walk in place as Fourier series of poses."""
        components, seconds = self.components(), self.stride_seconds
        steps = components.means + np.diag(components.deviations)
        arrays = {
            **series_of(self.fpca_),
            "log_seconds_mean": np.log(seconds(components.means)),
            "log_seconds_weights": np.log(seconds(steps) / seconds(components.means)),
        }
        return Treadmill("poses", arrays, self.proportions_, self.height_, self.crowd)

    def in_place(
        self, walkers: Sequence[Walker], *, speed: float | None = None, height: float | None = None,
        samples: int = SAMPLES,
    ) -> list[Cycle]:  # fmt: skip
        """One stride in place, at `samples` phases, of each of `walkers`, at a `speed` [m/s], of a `height` [m]."""
        stride, bodies, shapes = self._people(walkers, [height] * len(walkers))
        speeds = self._asked(walkers, [speed] * len(walkers))
        markers, poses, standing, strides, seconds = self._cycles(stride, shapes, speeds, samples)
        return [
            Cycle(markers[i], poses[i], standing[i], bodies[i], float(strides[i]), float(seconds[i]))
            for i in range(len(walkers))
        ]

    def crowd(self, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`Treadmill.crowd` of `scores` (n, q): walkers of the mean body at the pace of who is given by scores."""
        markers, _, heights = self._of_mean_body(scores, self._person_of(scores).speed)
        return markers, heights

    def _of_mean_body(self, scores: np.ndarray, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Markers of cycles in place, strides (n,) [m] and heights (n,) [m] at a `speed`, or with 0 their own."""
        n, body = len(scores), self.skeleton()
        shapes = np.repeat(body.offsets[None], n, axis=0), np.full(n, body.height)
        own = WalkerScores(scores, self.stride_seconds(scores))
        markers, _, _, strides, _ = self._cycles(own, shapes, np.full(n, speed), SAMPLES)
        return markers, strides, shapes[1]

    def body(self, height: float | None = None) -> Skeleton:
        """The mean body, scaled to `height` [m]."""
        return self.skeleton(height)

    def learned_speeds(self) -> tuple[float, float]:
        """The slowest and the fastest captured walk [m/s]."""
        self._check_fitted()
        return tuple((self.pace_.speeds * self.height_).tolist())

    def dimensions(self) -> dict[str, int]:
        """Channels and harmonics of the functional PCA."""
        self._check_fitted()
        return {"channels": len(self.fpca_.channels_), "harmonics": self.fpca_.n_harmonics}

    def draw_walker(
        self, rng: np.random.Generator, speed: float | None = None, height: float | None = None, person: str = "adult"
    ) -> Walker:
        """Draw a `person` with `rng`, of `height` [m], who then walks at `speed` [m/s].

        Scores are as those of the model's people with such steps, which are as long as the person's.
        """
        self._check_fitted()
        who = draw_person(rng, person=person, height=height, about=self.height_)
        scale = who.height * who.legs
        length = np.log(2 * who.step_length / scale)
        z = self.standard(self.sample(1, seed=rng).scores)
        z = self.pace_.longer(z, length - self.pace_.log_length(z), self.pace_.between)
        seconds = np.array([2 * who.step_length / who.speed])
        if speed is not None:
            z, seconds = self.pace_.at_speed(z, seconds, scale, speed)
        return Walker(self.kind, tuple(self._scores(z)[0]), float(seconds[0]), person=who)

    def make_motion(self, walker: Walker, request: Request, rng: np.random.Generator) -> Motion:
        """The walk of `walker` for a `request`; `rng` draws the variation between cycles."""
        self._check_fitted()
        return self._motions([walker], [request.height], [request.speed], request, rng)[0]

    def make_motions(
        self, seconds: float, fps: float, *, heights: Sequence[float | None] | np.ndarray,
        speeds: Sequence[float | None], rng: np.random.Generator, person: str = "adult",
    ) -> list[Motion]:  # fmt: skip
        """Walks of n people, computed together, which takes a fraction of the time of one by one.

        They take `seconds` [s] at `fps`, with body `heights` (n,) [m], None the person's own, and `speeds` (n,) [m/s],
        all numbers or all None. `rng` draws walkers, each a `person`, and the variation between cycles.
        """
        asked = [Request(seconds, fps, v, h, person=person) for h, v in zip(heights, speeds, strict=True)]
        walkers = [self.draw_walker(rng, height=request.height, person=person) for request in asked]
        return self._motions(walkers, heights, speeds, asked[0], rng)

    def _motions(self, walkers: list[Walker], heights, speeds, request: Request, rng) -> list[Motion]:
        """Walks of people with their own bodies, heights [m] and speeds [m/s], which may be None."""
        stride, bodies, shapes = self._people(walkers, heights)
        poses = self._poses(stride, request, rng, shapes, self._asked(walkers, speeds))
        return [Motion(p, body, request.fps, "walk") for p, body in zip(poses, bodies, strict=True)]

    def _asked(self, walkers: Sequence[Walker], speeds) -> np.ndarray:
        """Speeds (n,) [m/s] to walk at, 0 for that of the stride time; None is the person's of who has no such time."""
        own = [w.person.speed if w.person is not None and w.stride_seconds is None else 0.0 for w in walkers]
        return np.array([mine if speed is None else speed for mine, speed in zip(own, speeds, strict=True)])

    def _person_of(self, scores: np.ndarray) -> Person:
        seconds, speed = np.exp(self.person_mean_[-2:]) * [1.0, self.height_]
        return self._at_known_pace(average_person(self.height_), float(speed), float(speed * seconds))

    def _people(self, walkers: Sequence[Walker], heights) -> tuple[WalkerScores, list[Skeleton], tuple]:
        """Scores and stride times of people, their bodies, and these as offsets (n, 16, 3) and heights (n,) [m]."""
        scores = np.array([walker.scores for walker in walkers])
        own = [walker.stride_seconds for walker in walkers]
        seconds = np.array([self.stride_seconds(s) if t is None else t for s, t in zip(scores, own, strict=True)])
        self._check_stride(stride := WalkerScores(scores, seconds), len(walkers))
        bodies = [
            self.skeleton(height) if walker.person is None else walker.person.body(self.proportions_, height)
            for walker, height in zip(walkers, heights, strict=True)
        ]
        return stride, bodies, (np.array([b.offsets for b in bodies]), np.array([b.height for b in bodies]))

    def skeleton(self, height: float | None = None) -> Skeleton:
        """The mean body, scaled to `height` [m]; None keeps the mean height.

        Raises:
            MotionError: `height` isn't between 0.5 and 2.5 m.
        """
        self._check_fitted()
        if height is None:
            return self._tables.body
        checked_number(height, "height", *HEIGHT_RANGE)
        return Skeleton(self.proportions_ * height, limb_radii(height), height)

    def score(self, motions: Sequence[Motion]) -> float:
        """Mean log-density of the scores of the cycles of captured `motions`, walks (frames, 25)."""
        from motionenv.models.walking.strides import captured_cycles, walk_strides

        self._check_fitted()
        motions = list(motions)
        cycles = captured_cycles(motions, [walk_strides(m) for m in motions], [""] * len(motions))
        return self.fpca_.score(cycles.values[..., [CHANNELS.index(name) for name in self.fpca_.channels_]])

    def _poses(self, stride: WalkerScores, request: Request, rng: np.random.Generator, bodies, speeds) -> np.ndarray:
        """Walks (n, frames, 25) of bodies of offsets (n, 16, 3) and heights (n,), at speeds (n,) [m/s] above 0."""
        if speeds.any():
            stride = self._at_speeds(stride, bodies, speeds)
        shortest = min(_SHORTEST, *stride.seconds.tolist())  # lower bound of the stride time [s] at any speed
        wobble = request.variation * self._wobble(stride, request.frames / request.fps, shortest, rng)
        poses = np.empty((len(stride.seconds), request.frames, 25))
        self._walk(stride, wobble, request.fps, request.phase, speeds, shortest, bodies, poses)
        if lacking := lacking_angles(self):
            poses[..., lacking] = np.nan
        return poses

    def _at_speeds(self, stride: WalkerScores, bodies, speeds: np.ndarray) -> WalkerScores:
        scale = bodies[0][:, _LEG, 2].sum(1) / self.proportions_[_LEG, 2].sum()
        asked = speeds > 0.0
        goal = np.where(asked, speeds, 1.0)
        z, seconds = self.pace_.at_speed(self.standard(stride.scores), stride.seconds, scale, goal)
        scores = np.where(asked[:, None], self._scores(z), stride.scores)
        return WalkerScores(scores, np.where(asked, seconds, stride.seconds))

    def _wobble(self, stride: WalkerScores, seconds: float, shortest: float, rng) -> np.ndarray:
        """Control points (n, cycles + 4, q) of the B-splines of the scores' deviations from their mean."""
        n, q = stride.scores.shape
        count = math.ceil((seconds + 2 * _PADDING) / shortest) + 5
        return rng.standard_normal((n, count, q)) @ self._tables.cycles.T

    def _walk(self, stride: WalkerScores, wobble, fps: float, phase: float, speeds, shortest, bodies, poses) -> None:
        """Fill `poses` (n, frames, 25) with walks, on all cores if there are many."""
        from motionenv.models.walking._walk_kernels import walk

        finer = math.ceil(_RATE / fps)
        rate = float(fps * finer)
        scores, seconds, speeds = (
            np.ascontiguousarray(values, dtype=np.float64) for values in (stride.scores, stride.seconds, speeds)
        )
        clock = rate, math.ceil(_PADDING * rate), finer, float(phase), shortest
        terms, floors = self._tables.terms, np.ascontiguousarray(floors_of(self._tables, scores))

        n = len(poses)

        def fill(first: int, last: int) -> None:
            for start in range(first * _TOGETHER, min(last * _TOGETHER, n), _TOGETHER):
                stop = min(start + _TOGETHER, n)
                walk(start, stop, scores, floors, seconds, speeds, wobble, clock, terms, bodies, poses)

        everywhere.share(fill, -(-n // _TOGETHER))

    def _cycles(self, stride: WalkerScores, bodies, speeds: np.ndarray, samples: int) -> tuple[np.ndarray, ...]:
        """Markers, poses and standing (n, samples, ...) in place, stride lengths (n,) [m] and times (n,) [s].

        At `speeds` (n,) [m/s], 0 for that of the stride time.
        """
        from motionenv.models.walking._walk_kernels import walk_in_place

        n = len(stride.seconds)
        if speeds.any():
            stride = self._at_speeds(stride, bodies, speeds)
        scores, seconds = np.ascontiguousarray(stride.scores, dtype=np.float64), np.array(stride.seconds, dtype=float)
        markers, poses, standing = (np.empty((n, samples, *shape)) for shape in ((15, 3), (25,), (2,)))
        out = markers, poses, standing, np.empty(n), seconds
        walk_in_place(
            scores, floors_of(self._tables, scores), speeds, math.ceil(SAMPLES / samples), self._tables.terms, bodies,
            out,
        )  # fmt: skip
        if lacking := lacking_angles(self):
            poses[..., lacking] = np.nan
            markers[~known_markers(poses)] = np.nan
        return out

    @cached_property
    def _tables(self) -> Tables:
        """Precomputed tables; `fit` resets them."""
        return tables_of(self)

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and settings from which `from_arrays` restores the model."""
        self._check_fitted()
        arrays, meta = self.fpca_.to_arrays()
        arrays = {f"fpca_{name}": value for name, value in arrays.items()}
        arrays |= {name: getattr(self, name) for name in _STORED} | self.pace_.to_arrays()
        return arrays, {"fpca": meta, "height": self.height_}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> WalkingModel:
        """Restore a model from `arrays` and `meta` of `to_arrays`; a ModelError if shapes are inconsistent."""
        parts = {name.removeprefix("fpca_"): value for name, value in arrays.items() if name.startswith("fpca_")}
        fpca = FunctionalPCA.from_arrays(parts, meta["fpca"])
        model = cls(fpca.n_components_, fpca.n_harmonics)
        model.fpca_, model.height_ = fpca, float(meta["height"])
        q = fpca.n_components_
        shapes = {"proportions_": (16, 3), "person_mean_": (q + 2,), "person_covariance_": (q + 2, q + 2)}
        for name in _STORED:
            if arrays[name].shape != shapes.get(name, (q, q)):
                raise ModelError(f"{name} has shape {arrays[name].shape}: fit the model again")
            setattr(model, name, arrays[name])
        model.pace_ = Pace(*(arrays[f"pace_{field.name}"] for field in fields(Pace)))  # type: ignore[arg-type]
        return model

    def _check_stride(self, stride: WalkerScores, n: int) -> None:
        if len(stride.seconds) != n:
            raise MotionError(f"stride holds {len(stride.seconds)} walkers, but n is {n}: they must agree")
        seconds, want = np.asarray(stride.seconds), (n, self.fpca_.n_components_)
        if np.shape(stride.scores) != want or not np.isfinite(stride.scores).all() or seconds.shape != (n,):
            raise MotionError(f"stride must hold finite scores {want} and stride times ({n},), as sample() draws them")
        if not _STRIDES[0] <= seconds.min() <= seconds.max() <= _STRIDES[1]:
            told = f"stride times must be from {_STRIDES[0]:g} to {_STRIDES[1]:g} s, got {seconds.min():.2g} to"
            raise MotionError(f"{told} {seconds.max():.2g}: take scores nearer to the average", "scores")

    def _check_fitted(self) -> None:
        if not hasattr(self, "fpca_"):
            raise ModelError("this WalkingModel is not fitted: call fit(motions, subjects) first, or motionenv.load")


def _even(trials: list[np.ndarray]) -> np.ndarray:
    """Covariance (q, q) of the scores (cycles, q) of trials' cycles about their mean, in trials of even walking.

    In a few captures somebody starts, stops or turns; their cycles vary many times as much as others'.
    """
    free = np.array([max(len(trial) - 1, 0) for trial in trials])
    square = np.array([(trial**2).sum() for trial in trials]) / np.maximum(free, 1)
    kept = square <= _UNEVEN * np.median(square)
    spread = np.concatenate([trial for trial, is_kept in zip(trials, kept, strict=True) if is_kept])
    return spread.T @ spread / max(free[kept].sum(), 1)


def _check_legs(channels: tuple[str, ...]) -> None:
    missing = [name for name in CHANNELS[11:] if name not in channels]
    if missing:
        raise GapError(
            f"a walking model needs both legs, but no walk shows {', '.join(missing)}: add walks that do, or fill them "
            "with motionenv.fill"
        )


_STORED = ("proportions_", "person_mean_", "person_covariance_", "cycle_covariance_")
