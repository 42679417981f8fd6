"""Published norms of step parameters by age, for what a report compares them with."""

from dataclasses import asdict, dataclass

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.errors import MotionError

SEXES = ("female", "male")
_OLDEST = 120  # [years]
_BOHANNON = "Bohannon & Williams Andrews 2011, Physiotherapy 97:182-189 (meta-analysis)"
_OBERG = "Öberg et al. 1993, J Rehabil Res Dev 30:210-223"
_HAUSDORFF = "Hausdorff et al. 1999, J Appl Physiol 86:1040-1047"
_ENTROPY = "Entropy 2013, 15:753-766 (doi:10.3390/e15030753), on the children of Hausdorff et al. 1999"


@dataclass(frozen=True, repr=False)
class Norm(OneLine):
    """A step parameter of healthy people who walk over ground at a comfortable speed.

    Attributes:
        name, unit: of the parameter, as in `motionenv.gait.Parameter`.
        sex: "female", "male", or "" where the source doesn't part them.
        youngest, oldest: of the people, in whole years.
        mean, sd: over people; the latter is None where the source doesn't state it.
        source: where the figures were published.
    """

    name: str
    unit: str
    sex: str
    youngest: int
    oldest: int
    mean: float
    sd: float | None
    source: str

    def to_dict(self) -> dict:
        """The figures for JSON."""
        return asdict(self)


_DECADES = ((20, 29), (30, 39), (40, 49), (50, 59), (60, 69), (70, 79), (80, 99))
_SPEEDS = {
    "male": (1.358, 1.433, 1.434, 1.433, 1.339, 1.262, 0.968),
    "female": (1.341, 1.337, 1.390, 1.313, 1.241, 1.132, 0.943),
}
_OF_MEN = ((10, 14), (15, 19), *_DECADES[:6])
_STEPS = (0.615, 0.660, 0.616, 0.649, 0.647, 0.635, 0.650, 0.615)
_OF_STEPS = (0.039, 0.048, 0.035, 0.046, 0.037, 0.060, 0.036, 0.051)  # standard deviations

#: All norms. Those of which no public source could be checked are left out, such as the step lengths of women.
NORMS = (
    *(Norm("speed", "m/s", "", *ages, mean, None, _HAUSDORFF)
      for ages, mean in (((3, 4), 1.00), ((6, 7), 1.20), ((11, 14), 1.28))),
    *(Norm("speed", "m/s", sex, *ages, mean, None, _BOHANNON)
      for sex in SEXES for ages, mean in zip(_DECADES, _SPEEDS[sex], strict=True)),
    *(Norm("stride_time", "s", "", *ages, mean, sd, _ENTROPY)
      for ages, mean, sd in (((3, 5), 0.904, 0.041), ((6, 8), 0.960, 0.056), ((10, 14), 1.059, 0.063))),
    *(Norm("step_length", "m", "male", *ages, mean, sd, _OBERG)
      for ages, mean, sd in zip(_OF_MEN, _STEPS, _OF_STEPS, strict=True)),
)  # fmt: skip


def norms_for(age: float | None, sex: str | None = None) -> tuple[Norm, ...]:
    """The norms for an `age` [years], None for none, and a `sex`, "female" or "male", None for both.

    Raises:
        MotionError: `age` or `sex` out of range, or `sex` without `age`.
    """
    if sex is not None and sex not in SEXES:
        raise MotionError(f"sex must be {' or '.join(SEXES)}, got {sex!r}")
    if age is None:
        if sex is not None:
            raise MotionError(f"sex={sex!r} chooses norms of an age: give age= [years] too")
        return ()
    years = int(checked_number(age, "age", 0, _OLDEST, "years"))
    return tuple(n for n in NORMS if n.youngest <= years <= n.oldest and (not n.sex or sex in (None, n.sex)))
