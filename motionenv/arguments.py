"""The arguments of a walk, declared once: Python, HTTP and the command line derive theirs from `Request`.

docs/extending/argument.md shows how to add one.
"""

import functools
import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, TypedDict, TypeVar, get_args

import numpy as np

from motionenv._core.validation import checked_choice, checked_number, did_you_mean
from motionenv.errors import MotionError
from motionenv.types import FPS_RANGE, HEIGHT_RANGE, PEOPLE, SECONDS_MOST, SPEED_RANGE, WEIGHT_RANGE

__all__ = [
    "ARGUMENTS", "WALK_ARGUMENTS", "Argument", "Choice", "Number", "Request", "WalkArguments", "keyword_arguments",
]  # fmt: skip

_KEYWORD_ONLY = inspect.Parameter.KEYWORD_ONLY
_Function = TypeVar("_Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Number:
    """What a numeric argument means and which values it may have.

    Attributes:
        help: a sentence for users, with the unit in brackets.
        low, high: least and greatest value.
        unit: in words, for error messages.
        above: value that the argument must exceed.
        cyclic: whether only models of gait cycles take the argument.
    """

    help: str
    low: float = -np.inf
    high: float = np.inf
    unit: str = ""
    above: float = -np.inf
    cyclic: bool = False

    def __str__(self) -> str:
        bounds = f" From {self.low:g} to {self.high:g}." if np.isfinite([self.low, self.high]).all() else ""
        return self.help + bounds

    def check(self, value: Any, name: str) -> None:
        """Refuse a `value` of the argument `name` that is out of range by a `MotionError`."""
        checked_number(value, name, self.low, self.high, self.unit, above=self.above)


@dataclass(frozen=True)
class Choice:
    """What an argument that is one of some words means: `help`, `words`, and `cyclic` as of `Number`."""

    help: str
    words: tuple[str, ...]
    cyclic: bool = False

    def __str__(self) -> str:
        return f"{self.help} One of {', '.join(self.words)}."

    def check(self, value: Any, name: str) -> None:
        """Refuse another `value` of the argument `name` by a `MotionError`."""
        checked_choice(value, name, self.words)


@dataclass(frozen=True)
class Request:
    """Validated arguments of a walk. Each field declares its meaning, bounds and unit.

    Raises:
        MotionError: a number out of range.
    """

    seconds: Annotated[float, Number("Duration [s].", high=SECONDS_MOST, unit="seconds", above=0)]
    fps: Annotated[float, Number("Frames per second.", *FPS_RANGE)]
    speed: Annotated[float | None, Number("Walking speed [m/s]; by default the walker's own.", *SPEED_RANGE)] = None
    height: Annotated[float | None, Number("Body height [m]; by default the walker's own.", *HEIGHT_RANGE)] = None
    phase: Annotated[
        float,
        Number("Phase at the start [cycles]; at 0 the left leg is furthest ahead.", -1000, 1000, "cycles", cyclic=True),
    ] = 0.0
    variation: Annotated[
        float, Number("Factor on the variation between cycles; 0 repeats one cycle exactly.", 0, 10, cyclic=True)
    ] = 1.0
    weight: Annotated[
        float | None, Number("Body weight [kg]; by default the walker's own.", *WEIGHT_RANGE, cyclic=True)
    ] = None
    person: Annotated[str, Choice("Who is drawn if no walker is given.", PEOPLE, cyclic=True)] = "adult"

    def __post_init__(self) -> None:
        for argument in ARGUMENTS.values():
            argument.check(getattr(self, argument.name))
        if self.frames < 1:
            raise MotionError(
                f"seconds must last one frame at least, got {self.seconds!r} at {self.fps:g} fps", "seconds", "fps"
            )

    @property
    def frames(self) -> int:
        """Number of frames of the motion."""
        return round(self.seconds * self.fps)

    def check_cycles(self, kind: str) -> None:
        """Refuse arguments that a model without gait cycles doesn't take.

        Args:
            kind: of the model.

        Raises:
            MotionError: such an argument isn't at its default.
        """
        cyclic = [argument for argument in ARGUMENTS.values() if argument.meaning.cyclic]
        wrong = [argument.name for argument in cyclic if getattr(self, argument.name) != argument.default]
        if wrong:
            names = " and ".join(argument.name for argument in cyclic)
            raise MotionError(f"a {kind} model has no cycles: leave {names} out", *wrong)


class WalkArguments(TypedDict, total=False):
    """Those arguments of `Request` that functions hand on by name."""

    height: float | None
    phase: float
    variation: float
    weight: float | None
    person: str


#: Names of `WalkArguments`.
WALK_ARGUMENTS = tuple(WalkArguments.__annotations__)


@dataclass(frozen=True)
class Argument:
    """One field of `Request`.

    Attributes:
        name: of the argument.
        type: its type, without `Number`.
        default: its default; `dataclasses.MISSING` if it has none.
        meaning: with its bounds, or words.
    """

    name: str
    type: Any
    default: Any
    meaning: Number | Choice

    def check(self, value: Any) -> None:
        """Refuse a `value` out of range by a `MotionError`."""
        if value is not None or self.default is not None:
            self.meaning.check(value, self.name)


#: The fields of `Request` by name.
ARGUMENTS = {
    field.name: Argument(field.name, kind, field.default, meaning)
    for field in fields(Request)
    for kind, meaning in [get_args(field.type)]
}
Request.__doc__ = f"{Request.__doc__}\n    Attributes:\n" + "".join(
    f"        {argument.name}: {argument.meaning}\n" for argument in ARGUMENTS.values()
)


def keyword_arguments(arguments: type) -> Callable[[_Function], _Function]:
    """Decorator of functions with `**walk: Unpack[arguments]`.

    The function's signature shows each argument in place of `walk`, and its docstring those of `Request` below `walk`.
    A call with another name raises a TypeError that suggests the nearest one.

    Args:
        arguments: a TypedDict.
    """

    def decorate(function: _Function) -> _Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        expanded = [
            inspect.Parameter(name, _KEYWORD_ONLY, default=getattr(Request, name, None), annotation=annotation)
            for name, annotation in inspect.get_annotations(arguments).items()
        ]
        names = [p.name for p in (*own, *expanded)]

        @functools.wraps(function)
        def checked(*args: Any, **named: Any) -> Any:
            for name in named.keys() - names:
                hint = did_you_mean(name, names)
                raise TypeError(f"{function.__name__}() got an unexpected keyword argument {name!r}{hint}")
            return function(*args, **named)

        checked.__signature__ = signature.replace(parameters=[*own, *expanded])  # type: ignore[attr-defined]
        entries = [rf"\g<1>{p.name}: {ARGUMENTS[p.name].meaning}\n" for p in expanded if p.name in ARGUMENTS]
        entry = re.compile(r"^( *)walk: .*\n", re.MULTILINE)
        checked.__doc__ = entry.sub(r"\g<0>" + "".join(entries), function.__doc__ or "")
        return checked  # type: ignore[return-value]

    return decorate
