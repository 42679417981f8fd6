"""Step parameters of a walk: speed, cadence, lengths, times, symmetry and variability, each with its interval."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import chdtri, stdtrit  # of scipy.stats, which takes half a second to import

from motionenv._core.representation import OneLine
from motionenv.gait.strides import Stride

_LEVEL = 0.95  # of all intervals
_NAN = float("nan")
_GRAVITY = 9.81  # [m/s²]


@dataclass(frozen=True, repr=False)
class Parameter(OneLine):
    """One figure of a walk, such as the `name` "step_length", in a `unit`.

    Attributes:
        name, unit: of the figure.
        side: "left", "right", or "" where it concerns both.
        mean, sd: mean and standard deviation over the strides; of one stride, its value and NaN.
        low, high: ends of the 95 % interval of the mean; NaN of fewer than two strides.
        n: number of strides.
    """

    name: str
    unit: str
    side: str
    mean: float
    sd: float
    low: float
    high: float
    n: int

    def to_dict(self) -> dict:
        """The figures for JSON: None where unknown."""
        return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(self).items()}


#: What is measured on each stride: name, unit, and its value from the stride.
_OF_STRIDES: tuple[tuple[str, str, Callable[[Stride], float]], ...] = (
    ("stride_length", "m", lambda s: s.length), ("step_length", "m", lambda s: s.step_length),
    ("step_width", "m", lambda s: s.step_width), ("stride_time", "s", lambda s: s.seconds),
    ("step_time", "s", lambda s: s.end - s.opposite_contact),
    ("stance", "%", lambda s: 100 * (s.toe_off - s.start) / s.seconds),
    ("swing", "%", lambda s: 100 * (s.end - s.toe_off) / s.seconds),
    ("single_support", "%", lambda s: 100 * (s.opposite_contact - s.opposite_off) / s.seconds),
    ("double_support", "%", lambda s: 100 * (s.opposite_off - s.start + s.toe_off - s.opposite_contact) / s.seconds),
)  # fmt: skip

#: What concerns both sides at once.
_OF_BOTH: tuple[tuple[str, str, Callable[[Stride], float]], ...] = (
    ("speed", "m/s", lambda s: s.speed),
    ("cadence", "steps/min", lambda s: 120 / s.seconds),
    ("walk_ratio", "m/(steps/min)", lambda s: 0.5 * s.length * s.seconds / 120),
)

_VALUE = {name: value for name, _, value in (*_OF_STRIDES, *_OF_BOTH)}
_SYMMETRIES = ("step_length", "step_time", "stance")
_VARIABILITIES = ("stride_time", "stride_length", "step_width")


def summarise(strides: Sequence[Stride], leg_length: float | None = None) -> tuple[Parameter, ...]:
    """The step parameters of a walk, or of several walks of one person, in a fixed order, without those unknown.

    Walk ratio is step length over cadence (Sekiya & Nagasaki 1998); the dimensionless speed is relative to the square
    root of leg length times gravity (Hof 1996). Symmetry is the left's excess over the right relative to their mean
    (Robinson et al. 1987), of sides with two strides or more. Variability is the coefficient of
    variation, with its chi-square interval.

    `strides` are of both sides, from one or several captures; `leg_length` is in m, None if unknown.
    """
    found = [_mean(name, unit, "", [value(s) for s in strides]) for name, unit, value in _OF_BOTH]
    if leg_length:
        root = np.sqrt(_GRAVITY * leg_length)
        found.append(_mean("dimensionless_speed", "", "", [_VALUE["speed"](s) / root for s in strides]))
    for name, unit, value in _OF_STRIDES:
        for side in ("left", "right", ""):
            found.append(_mean(name, unit, side, [value(s) for s in strides if s.side == side or not side]))
    found += [_symmetry(name, strides) for name in _SYMMETRIES]
    found += [_variability(name, strides) for name in _VARIABILITIES]
    return tuple(p for p in found if p.n)


def _mean(name: str, unit: str, side: str, values: Sequence[float]) -> Parameter:
    """Mean with its t interval."""
    known = _known(values)
    n = len(known)
    if n < 2:
        return Parameter(name, unit, side, float(known[0]) if n else _NAN, _NAN, _NAN, _NAN, n)
    mean, sd = float(known.mean()), float(known.std(ddof=1))
    half = float(stdtrit(n - 1, 0.5 + _LEVEL / 2)) * sd / np.sqrt(n)
    return Parameter(name, unit, side, mean, sd, mean - half, mean + half, n)


def _symmetry(name: str, strides: Sequence[Stride]) -> Parameter:
    """Left's excess over right [%], with Welch's interval of the difference."""
    left, right = (_known([_VALUE[name](s) for s in strides if s.side == side]) for side in ("left", "right"))
    n = min(len(left), len(right))
    if n < 2:  # of one stride, it would be the difference of two strides and not of two legs
        return Parameter(f"{name}_symmetry", "%", "", _NAN, _NAN, _NAN, _NAN, 0)
    scale = 100 / (0.5 * (left.mean() + right.mean()))
    index = float(scale * (left.mean() - right.mean()))
    spread = [values.var(ddof=1) / len(values) for values in (left, right)]
    within = sum(v**2 / (len(values) - 1) for v, values in zip(spread, (left, right), strict=True))
    free = sum(spread) ** 2 / within if within > 0 else 1.0  # Welch-Satterthwaite
    half = float(abs(scale) * stdtrit(free, 0.5 + _LEVEL / 2) * np.sqrt(sum(spread)))
    return Parameter(f"{name}_symmetry", "%", "", index, _NAN, index - half, index + half, n)


def _variability(name: str, strides: Sequence[Stride]) -> Parameter:
    """Coefficient of variation [%] within a side, pooled over the sides."""
    sides = [_known([_VALUE[name](s) for s in strides if s.side == side]) for side in ("left", "right")]
    sides = [values for values in sides if len(values) > 1]
    free = sum(len(values) - 1 for values in sides)
    if not free:
        return Parameter(f"{name}_cv", "%", "", _NAN, _NAN, _NAN, _NAN, 0)
    variance = sum(((values - values.mean()) ** 2).sum() for values in sides) / free
    cv = float(100 * np.sqrt(variance) / abs(np.concatenate(sides).mean()))
    low, high = (cv * np.sqrt(free / chdtri(free, q)) for q in (0.5 - _LEVEL / 2, 0.5 + _LEVEL / 2))
    return Parameter(f"{name}_cv", "%", "", cv, _NAN, float(low), float(high), free + len(sides))


def _known(values: Sequence[float]) -> np.ndarray:
    array = np.array(values, dtype=np.float64)
    return array[np.isfinite(array)]
