"""Types of the gait models' interface: walkers, components, cycles, targets, traits."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.models.people.population import Person
from motionenv.types import Skeleton


@dataclass(frozen=True, repr=False)
class Walker(OneLine):
    """One person of a model: comparable, and storable as JSON with `dataclasses.asdict` and `Walker(**stored)`.

    Attributes:
        kind: kind of the model.
        scores: scores along the model's components, if it has any.
        stride_seconds: stride time [s] at the walker's own speed; None takes what makes the person's speed
            or, without a person, what the model expects of the scores.
        person: the person's body, comfortable speed and walk ratio; None takes the model's average body.
        start: index of the database window at which the motion starts, in a model that has a database.
    """

    kind: str
    scores: tuple[float, ...] = ()
    stride_seconds: float | None = None
    start: int | None = None
    person: Person | None = None

    def __post_init__(self) -> None:
        if isinstance(self.person, dict):
            object.__setattr__(self, "person", Person(**self.person))
        object.__setattr__(self, "scores", tuple(float(score) for score in self.scores))

    def weighing(self, weight: float, height: float | None = None) -> "Walker":
        """The same walker with a body of `weight` [kg], if of `height` [m], None is the walker's own.

        Raises:
            MotionError: a body mass index that nobody has, or a walker without a person.
        """
        if self.person is None:
            raise MotionError("weight needs a walker that is a person: draw one with a seed, or give deviations")
        return replace(self, person=self.person.weighing(weight, height))


@dataclass(frozen=True, eq=False, repr=False)
class Components(OneLine):
    """The components along which a model's walkers differ; the page shows one slider for each.

    Attributes:
        means: (q,) scores of the average walker.
        deviations: (q,) standard deviations of the scores.
        shares: (q,) share of the variance that each component explains.
    """

    means: np.ndarray = field(default_factory=lambda: np.zeros(0))
    deviations: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shares: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def names(self) -> tuple[str, ...]:
        """Display names of the q components."""
        return tuple(f"component {k + 1}" for k in range(len(self)))


@dataclass(frozen=True, eq=False, repr=False)
class Cycle(OneLine):
    """One stride of one walker in place, along x on ground z = 0 that moves back evenly.

    Sample j is at phase j / samples; at phase 0 the left leg is furthest ahead. The root is at x = y = 0 on average.

    Attributes:
        markers: (samples, 15, 3) [m], in the order of `motionenv.types.MARKERS`; NaN for limbs that the model doesn't
            know.
        poses: (samples, 25) [m, rad], in the order of `motionenv.types.POSE`; NaN likewise.
        standing: (samples, 2) share of the weight on the left and on the right foot.
        body: the body in `poses`.
        stride: length of a stride [m], by which the ground moves back in a cycle.
        seconds: duration of a cycle [s].
    """

    markers: np.ndarray
    poses: np.ndarray
    standing: np.ndarray
    body: Skeleton
    stride: float
    seconds: float

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return self.stride / self.seconds

    @property
    def contacts(self) -> np.ndarray:
        """Phases (2,) [cycles] at which the left and the right foot take over from the other."""
        more = self.standing - 0.5
        rises = (more <= 0) & (np.roll(more, -1, axis=0) > 0)
        first = rises.argmax(axis=0)
        before, after = more[first, [0, 1]], more[(first + 1) % len(more), [0, 1]]
        return (first + before / (before - after)) / len(more) % 1.0


@dataclass(frozen=True, eq=False, repr=False)
class Treadmill(OneLine):
    """Walking in place in closed form.

    Attributes:
        frame: quantity of the Fourier series in `arrays`: "poses" or "markers".
        arrays: see `motionenv.models.parameters`.
        offsets: (16, 3) node offsets of the drawn body, in body heights.
        height: height of the average body [m].
        crowd: maps scores (n, q) of many walkers to markers (n, samples, 15, 3) [m] in place, at the mean pace of
            people, and body heights (n,) [m].
    """

    frame: str
    arrays: dict[str, np.ndarray]
    offsets: np.ndarray
    height: float
    crowd: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Target:
    """Target to which a steerable model steers its motion; None leaves an attribute free.

    Attributes:
        activity: one of the model's `activities`, such as "walk".
        heading: heading of the pelvis in the world [rad], 0 along x.
        speed: ground speed [m/s].

    Raises:
        MotionError: a number out of range.
    """

    activity: str | None = None
    heading: float | None = None
    speed: float | None = None

    def __post_init__(self) -> None:
        if self.heading is not None:
            checked_number(self.heading, "heading", unit="radians")
        if self.speed is not None:
            checked_number(self.speed, "speed", 0, unit="m/s")


@dataclass(frozen=True, eq=False, repr=False)
class Trait(OneLine):
    """A direction in the space of a model's walkers.

    Attributes:
        name, unit: of the feature.
        low, high: words for walkers with little or much of it.
        direction: (q,) unit vector, in standard deviations along each component.
        mean, gain: of the feature over walkers, and its change for one step along `direction`, by the regression.
        share: share of the feature's variance over walkers that the regression explains.
        note: a remark for users.
    """

    name: str
    low: str
    high: str
    direction: np.ndarray
    mean: float
    gain: float
    unit: str
    share: float
    note: str = ""
