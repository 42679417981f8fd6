"""The protocol of gait models, used by the environments, the service, the page, the command line and the exporters.

To add a model, subclass `GaitModel`, or `FixedModel` if there is nothing to learn, and define the abstract methods.
Don't override the methods implemented here: all models share them. Class attributes declare what a model can do.
`motionenv.models.registry` describes how to register it; docs/models.md has an example.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import random_generator
from motionenv.arguments import ARGUMENTS, Request, WalkArguments, keyword_arguments
from motionenv.body.limbs import from_height
from motionenv.errors import ExtrapolationWarning, MotionError
from motionenv.models.contact_rule import SAMPLES
from motionenv.models.people.population import Person
from motionenv.models.storage.model_file import StoredModel
from motionenv.models.traits import traits
from motionenv.models.types import Components, Cycle, Trait, Treadmill, Walker
from motionenv.types import Motion, Skeleton

_FARTHEST = 10  # standard deviations; nobody is half as far, and kernels need not end on numbers without bounds


class GaitModel(StoredModel):
    """A model of human motion, usually walking.

    Attributes:
        kind: identifies the class in model files and in the registry.
        about: one sentence for people.
        batch_size: number of walkers that `synthesize_batch` makes about as fast as one. 1 means one by one. A model
            with more defines `make_motions` and synthesises within about a millisecond.
        steady: whether each motion is a steady walk along x from the origin at the requested speed. Otherwise the
            motion is of any kind and has no cycles: the model takes neither phase nor variation, and is steered
            towards the speed.
        steerable: whether it generates motion frame by frame with `generator`.
        learns_from: type of captured walks that `fit` takes: "motions" or "markers".
        activities: targets of a steerable model.
        card_: the model card (Mitchell et al. 2019): data, licence, how it was made.
        make_motions: `synthesize_batch` with `rng` instead of `seed`; only where `batch_size` exceeds 1.
        generator: only of a steerable model. `generator(start, seed=..., temperature=..., target=...)` returns an
            object with `step(frames)` → the next poses (frames, 25), a settable `target`, `skeleton` and `fps`. `start`
            is poses to continue, an activity, or None for a random start.
    """

    about: ClassVar[str] = ""
    batch_size: ClassVar[int] = 1
    steady: ClassVar[bool] = True
    steerable: ClassVar[bool] = False
    learns_from: ClassVar[str] = "motions"
    activities: tuple[str, ...] = ()
    make_motions: Callable[..., list[Motion]]
    generator: Callable[..., Any]

    @abstractmethod
    def fit(self, motions: Any, subjects: Sequence | None = None) -> Self:
        """Learn from captured motion.

        Args:
            motions: one or more (frames, 25).
            subjects: the person's label for each motion; None takes each motion for a different person.

        Raises:
            MotionError: too little data, or a model that can't be fitted.
        """

    @abstractmethod
    def components(self) -> Components:
        """The model's components; empty if it has none, and then it takes no scores or deviations.

        Raises:
            ModelError: not fitted.
        """

    @abstractmethod
    def treadmill(self) -> Treadmill | None:
        """The walk in place in closed form; None if motion has no cycles or no closed form.

        A model that has one defines `in_place`.
        """

    @abstractmethod
    def body(self, height: float | None = None) -> Skeleton | None:
        """The average body, scaled to `height` [m]; None if each walker has a different body.

        Raises:
            MotionError: `height` isn't from 0.5 to 2.5 m.
        """

    @abstractmethod
    def dimensions(self) -> dict[str, int]:
        """Sizes of the model by name, other than the number of components."""

    @abstractmethod
    def draw_walker(
        self, rng: np.random.Generator, speed: float | None = None, height: float | None = None, person: str = "adult"
    ) -> Walker:
        """Draw a person from the model.

        Args:
            rng: random generator.
            speed: walking speed [m/s]; None lets the model choose.
            height: body height [m]; None draws it, or takes the model's where that has one body.
            person: kind of people, one of `motionenv.types.PEOPLE`, if the model has people.
        """

    @abstractmethod
    def make_motion(self, walker: Walker, request: Request, rng: np.random.Generator) -> Motion:
        """Motion (request.frames, 25) of `walker`, as `synthesize` describes.

        Args:
            walker: a walker of this model.
            request: validated arguments of `synthesize`.
            rng: random generator for everything that the request leaves open.
        """

    def learned_speeds(self) -> tuple[float, float]:
        """Range of speeds [m/s] that the model learned from; beyond it, `synthesize` warns. By default any."""
        return 0.0, np.inf

    def extrapolation(self, speeds: Iterable[float | None]) -> str | None:
        """Warning text if one of `speeds` [m/s], which may be None, is beyond `learned_speeds`; None if none is."""
        low, high = self.learned_speeds()
        beyond = [v for v in speeds if v is not None and not 0.99 * low <= v <= 1.01 * high]
        if not beyond:
            return None
        learned = f"the walks that this model learned from, {low:.2f} to {high:.2f} m/s"
        return f"speed {beyond[0]:g} m/s is beyond {learned}: step length and angles are extrapolated"

    def _warn_beyond(self, speeds, stacklevel: int = 3) -> None:
        if told := self.extrapolation(speeds):
            warnings.warn(told, ExtrapolationWarning, stacklevel=stacklevel)

    def traits(self) -> list[Trait]:
        """Directions in which walks change in ways that people name; empty without components or treadmill."""
        components, treadmill = self.components(), self.treadmill()
        return [] if treadmill is None else [*self.own_traits(), *traits(components, treadmill)]

    def own_traits(self) -> list[Trait]:
        """Traits that were learned with the model, such as an axis between groups of people; by default none."""
        return []

    def walker(
        self, seed: int | np.random.Generator | None = None, *, scores: ArrayLike | None = None,
        deviations: ArrayLike | None = None,
    ) -> Walker:  # fmt: skip
        """One person, drawn at random or given by scores. Components without a score are average.

        Who is given by scores or deviations walks at the mean pace of people of that height, or if the model learned
        from slower or faster walks only, at theirs: scores are a style, which doesn't change speed.

        Args:
            seed: int or Generator to draw with.
            scores: up to q scores along the components.
            deviations: up to q standard deviations from the average scores.

        Raises:
            MotionError: more than one argument, too many or non-finite numbers, or a model without components.
        """
        if deviations is not None and scores is not None:
            raise MotionError("deviations and scores both define the walker: give one of them")
        if deviations is None and scores is None:
            return self.draw_walker(random_generator(seed))
        name, given = ("scores", scores) if deviations is None else ("deviations", deviations)
        if seed is not None:
            raise MotionError(f"seed and {name} both define the walker: give one of them")
        components = self.components()
        values = np.asarray(given, dtype=np.float64)
        if not len(components) and values.size:
            raise MotionError(f"a {self.kind} model has no components: leave deviations and scores out", name)
        if values.ndim != 1 or len(values) > len(components) or not np.isfinite(values).all():
            raise MotionError(
                f"{name} must be up to {len(components)} finite numbers, one per component; got {given!r}", name
            )
        made, first = components.means.copy(), slice(len(values))
        made[first] = values if deviations is None else made[first] + values * components.deviations[first]
        if (np.abs(made - components.means) > _FARTHEST * components.deviations).any():
            raise MotionError(f"{name} must be within {_FARTHEST} standard deviations of the average", name)
        return Walker(self.kind, tuple(made), person=self._person_of(made))

    def _person_of(self, scores: np.ndarray) -> Person | None:
        """Body and pace of whoever is given by `scores` (q,) alone; None where scores say nothing of them."""
        return None

    def _at_known_pace(self, who: Person, speed: float, stride: float) -> Person:
        """`who`, at the `speed` [m/s] and `stride` [m] of the model where people's pace is beyond what it learned."""
        low, high = self.learned_speeds()
        beyond = who.speed < low or who.speed > high
        return replace(who, speed=speed, walk_ratio=(0.5 * stride) ** 2 / (60 * speed)) if beyond else who

    @keyword_arguments(WalkArguments)
    def synthesize(
        self, seconds: float, fps: float = 30.0, *, walker: Walker | None = None,
        seed: int | np.random.Generator | None = None, speed: float | None = None, **walk: Unpack[WalkArguments],
    ) -> Motion:  # fmt: skip
        """New motion (frames, 25). A steady model walks along x from the origin, on the ground z = 0.

        Args:
            seconds: duration [s], up to an hour.
            fps: frames per second, from 1 to 1000.
            walker: the walker, from `walker`; None draws one with the seed.
            seed: int or Generator, also for the variation between cycles.
            speed: speed along x [m/s], from 0.1 to 3; None takes the walker's own.
            walk: the further arguments of `motionenv.arguments.Request`.

        Raises:
            MotionError: a number out of range, a walker of another model, or phase or variation given to a model
                without cycles.
            ModelError: not fitted.
        """
        request = Request(seconds, fps, speed, **walk)
        if not self.steady:
            request.check_cycles(self.kind)
        self._warn_beyond([speed], stacklevel=4)
        rng = random_generator(seed)
        if walker is None:
            walker = self.draw_walker(rng, speed, request.height, request.person)
        else:
            self.check_walker(walker)
        if request.weight is not None:
            walker = walker.weighing(request.weight, request.height)
        return self.make_motion(walker, request, rng)

    def check_walker(self, walker: Walker) -> None:
        """Raise a `MotionError` if `walker` is of another model."""
        if walker.kind != self.kind or len(walker.scores) != len(self.components()):
            raise MotionError(
                f"walker is of a {walker.kind} model with {len(walker.scores)} components: make one with "
                f"this {self.kind} model's walker()"
            )

    def in_place(
        self, walkers: Sequence[Walker], *, speed: float | None = None, height: float | None = None,
        samples: int = SAMPLES,
    ) -> list[Cycle]:  # fmt: skip
        """One stride in place, at `samples` phases, of each of `walkers` of this model; only with a `treadmill`.

        `speed` [m/s] and `height` [m] are as of `synthesize`. `motionenv.models.cycle` checks these arguments.
        """
        raise MotionError(f"a {self.kind} model makes no cycles in place: take walk/fpca or walk/eigenwalkers")

    def synthesize_batch(
        self, seconds: float, fps: float, *, heights: Sequence[float | None] | np.ndarray,
        speeds: Sequence[float | None], person: str = "adult", seed: int | np.random.Generator | None = None,
    ) -> list[Motion]:  # fmt: skip
        """Motion of `n` new walkers, computed together if `batch_size` exceeds 1, otherwise one by one.

        Walks computed together meet their speeds within a few percent.

        Args:
            seconds: duration [s].
            fps: frames per second.
            heights: (n,) body heights [m]; None is the person's own.
            speeds: (n,) speeds [m/s]; all numbers or all None.
            person: kind of people, one of `motionenv.types.PEOPLE`, if the model has people.
            seed: int or Generator.

        Raises:
            MotionError: a number out of range.
        """
        rng = random_generator(seed)
        if self.batch_size > 1:
            self._warn_beyond(speeds)
            return self.make_motions(seconds, fps, heights=heights, speeds=speeds, rng=rng, person=person)
        pairs = zip(heights, speeds, strict=True)
        return [self.synthesize(seconds, fps, seed=rng, speed=v, height=h, person=person) for h, v in pairs]

    def describe(self) -> dict[str, Any]:
        """JSON-serialisable description of the model and of the arguments that it takes."""
        components, body, treadmill = self.components(), self.body(), self.treadmill()
        columns = components.names, components.means.tolist(), components.deviations.tolist()
        shares = np.clip(components.shares, 0, 1).tolist()
        takes = [name for name, argument in ARGUMENTS.items() if self.steady or not argument.meaning.cyclic]
        counted = {"components": len(components)} if len(components) else {}
        return {
            "kind": self.kind,
            "about": self.about,
            "card": self.card_,
            "dimensions": counted | self.dimensions(),
            "height": None if body is None else body.height,
            "components": [
                {"name": name, "mean": mean, "deviation": deviation, "share": share}
                for name, mean, deviation, share in zip(*columns, shares, strict=True)
            ],
            "activities": list(self.activities),
            "takes": [*takes, "deviations"] if len(components) else takes,
            "treadmill": None if treadmill is None else treadmill.frame,
            "steady": self.steady,
            "steerable": self.steerable,
        }


class FixedModel(GaitModel):
    """A model without parameters: one walker, whose body has average proportions and any height.

    Subclasses define only `make_motion`.
    """

    def fit(self, motions: Any, subjects: Sequence | None = None) -> Self:
        """Not supported, whatever `motions` and `subjects` are.

        Raises:
            MotionError: always.
        """
        raise MotionError(f"a {self.kind} model has no parameters: there is nothing to fit")

    def components(self) -> Components:
        """No components."""
        return Components()

    def treadmill(self) -> None:
        """No treadmill."""

    def body(self, height: float | None = None) -> Skeleton:
        """A body of average proportions with the given `height` [m], by default 1.75 m."""
        return from_height(1.75 if height is None else height)

    def dimensions(self) -> dict[str, int]:
        """No dimensions."""
        return {}

    def draw_walker(
        self, rng: np.random.Generator, speed: float | None = None, height: float | None = None, person: str = "adult"
    ) -> Walker:
        """The only walker; `rng`, `speed`, `height` and `person` have no effect."""
        return Walker(self.kind)

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """No arrays and no settings."""
        return {}, {}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> Self:
        """The model; `arrays` and `meta` have no effect."""
        return cls()
