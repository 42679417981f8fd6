"""One person's walks, taken together: what a report shows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from motionenv._core.representation import OneLine, counted
from motionenv._core.validation import checked_choice
from motionenv.errors import MotionError
from motionenv.gait.bands import Band, band_of
from motionenv.gait.norms import Norm, norms_for
from motionenv.gait.profile import Score, profile_of
from motionenv.gait.strides import Stride, mean_and_sd
from motionenv.gait.summary import Parameter, summarise
from motionenv.gait.trial import ANGLES, Trial, read_trial
from motionenv.mocap import SUFFIXES, MarkerMap, person_label, read_static
from motionenv.mocap.clinical.lower_body import WANDS


@dataclass(frozen=True, eq=False, repr=False)
class Session(OneLine):
    """The analysed walks of one person.

    `trials` are those of each capture, `left_out` the reasons by name of each file that couldn't be used, and `band`
    the reference that the angles are shown against, None for none. `age` [years] and `sex`, "female" or "male", choose
    norms; None if unknown.
    """

    trials: tuple[Trial, ...]
    left_out: dict[str, str]
    band: Band | None = None
    age: float | None = None
    sex: str | None = None

    def _shown(self) -> str:
        captures, strides = counted(len(self.trials), "capture"), counted(len(self.strides), "stride")
        out = f", {counted(len(self.left_out), 'file')} left out" if self.left_out else ""
        return f"{self.person!r}, {captures}, {strides}{out}"

    @property
    def person(self) -> str:
        """The person's label, or the first capture's name."""
        return next((t.person for t in self.trials if t.person), self.trials[0].name)

    @cached_property
    def used(self) -> tuple[Trial, ...]:
        """The captures that figures are taken from: those with steady strides, or all if none has any."""
        return tuple(t for t in self.trials if any(s.kind == "steady" for s in t.strides)) or self.trials

    @property
    def strides(self) -> tuple[Stride, ...]:
        """The strides that figures are taken from: the steady ones of all captures, or all if none is."""
        return tuple(stride for trial in self.used for stride in trial.steady)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The step parameters over all captures."""
        lengths = [t.leg_length for t in self.trials if t.leg_length]
        return summarise(self.strides, float(np.mean(lengths)) if lengths else None)

    @cached_property
    def curves(self) -> dict[str, np.ndarray]:
        """By side, the angles of all strides (strides, 101, 13) [degrees], in the order of `ANGLES`."""
        return {side: np.concatenate([t.curves(side) for t in self.used]) for side in ("left", "right")}

    @cached_property
    def profile(self) -> tuple[Score, ...]:
        """Differences of the angles from the band's over the gait cycle; none without a band or strides."""
        return profile_of(self.curves, self.band) if self.band else ()

    @property
    def norms(self) -> tuple[Norm, ...]:
        """Published norms for the person's age and sex of parameters that are known."""
        known = {p.name for p in self.parameters}
        return tuple(norm for norm in norms_for(self.age, self.sex) if norm.name in known)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the figures should know, beside the notes of each capture."""
        found = [
            f"the {side} side has one stride: its figures are those of this stride, and no means"
            for side in ("left", "right") if len(self.curves[side]) == 1
        ]  # fmt: skip
        if self.age is not None and not self.norms:
            found.append(f"no norms are at hand for what was measured at the age of {self.age:g}")
        return tuple(found)

    def toe_off(self, side: str) -> float:
        """Mean toe-off of one `side` [% of its cycle]; NaN if unknown."""
        found = next((p.mean for p in self.parameters if (p.name, p.side) == ("stance", side)), np.nan)
        return float(found)

    def mean_curve(self, side: str, angle: str) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (101,) [degrees] over the strides of one `angle` of one `side`."""
        return mean_and_sd(self.curves[side][:, :, ANGLES.index(angle)])


def read_session(
    paths: Sequence[Path], *, static: Path | None = None, marker_map: MarkerMap | str | None = None,
    fps: float | None = None, unit: str | float | None = None, up: str | None = None, person: str | None = None,
    wands: str = "auto", band: Band | None = None, age: float | None = None, sex: str | None = None,
    on_step: Callable[[str], None] = lambda name: None,
) -> Session:  # fmt: skip
    """Read and analyse the captures of one person.

    Args:
        paths: capture files.
        static: a standing trial of the person.
        marker_map, fps, unit, up, person, wands: as in `motionenv.gait.trial.read_trial`; `fps` and `unit` override.
        band: the reference to show the angles against.
        age: the person's [years], to show the step parameters beside published norms; None for none.
        sex: "female" or "male", for norms that part them.
        on_step: called with each file's name once it is analysed.

    Raises:
        MotionError: no file, or none that can be analysed (the first reason is told); `age` or `sex` out of range.
    """
    norms_for(age, sex)
    checked_choice(wands, "wands", WANDS)
    if not paths:
        raise MotionError("a report needs at least one capture file")
    standing = None if static is None else read_static(static, fps=fps, unit=unit, up=up)
    how: dict[str, Any] = {
        "marker_map": marker_map, "fps": fps, "unit": unit, "up": up, "person": person, "wands": wands
    }  # fmt: skip
    trials, left_out = [], {}
    for path in paths:
        try:
            trials.append(read_trial(path, static=standing, override=True, **how))
        except MotionError as error:
            left_out[Path(path).name] = str(error)
        on_step(Path(path).name)
    if not trials:
        name, why = next(iter(left_out.items()))
        raise MotionError(f"no file can be analysed; the first, {name}: {why}")
    return Session(tuple(trials), left_out, band, age, sex)


def read_people(
    folder: Path, *, marker_map: MarkerMap | str | None = None, fps: float | None = None,
    unit: str | float | None = None, wands: str = "auto", on_file: Callable[[str], None] = lambda name: None,
) -> tuple[dict[str, list[Trial]], dict[str, str]]:  # fmt: skip
    """Each person's walks in a folder and its subfolders, and the reasons why files are left out.

    A file's name up to the first "_" is the person's label.

    Args:
        folder: searched with its subfolders.
        marker_map, fps, unit, wands: as in `motionenv.gait.trial.read_trial`.
        on_file: called with each file's name before it is read.
    """
    checked_choice(wands, "wands", WANDS)
    people: dict[str, list[Trial]] = {}
    left_out = {}
    for path in sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in SUFFIXES):
        on_file(path.name)
        try:
            trial = read_trial(path, marker_map=marker_map, fps=fps, unit=unit, wands=wands)
        except MotionError as error:
            left_out[path.name] = str(error)
            continue
        if any(stride.kind == "steady" for stride in trial.strides):
            people.setdefault(person_label(path), []).append(trial)
        else:
            left_out[path.name] = "no stride lies wholly in a steady stretch"
    return people, left_out


def read_group(folder: Path, **how: Any) -> tuple[Band, dict[str, str]]:
    """The band of the people whose walks are in a `folder`, and the reasons why files aren't in it.

    `how` are further arguments of `read_people`. A `MotionError` if fewer than three people have strides.
    """
    people, left_out = read_people(folder, **how)
    return band_of(people, f"{len(people)} people with captures in the folder {Path(folder).name}."), left_out
