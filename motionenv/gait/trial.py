"""One capture of a walk, analysed: joint angles, events, stretches and strides."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionenv._core.representation import OneLine, counted
from motionenv.errors import GapError
from motionenv.gait.events import Events, backward_share, find_events
from motionenv.gait.feet import Feet, feet_of
from motionenv.gait.stretches import Stretch, find_stretches, on_treadmill
from motionenv.gait.strides import Stride, find_strides, normalised, strides_by_phase
from motionenv.mocap import MarkerMap, read, retarget
from motionenv.mocap.clinical import CLINICAL_ANGLES, ClinicalAngles, clinical_angles, measurements_of
from motionenv.mocap.clinical.gait_model import middle
from motionenv.mocap.plausibility import find_doubts
from motionenv.types import Markers, Motion

_QUICKEST = 0.38  # [s] stride of a sprinter, at five steps a second
_HASTE = 0.65  # [s/√m] stride of who walks in haste, over the square root of the leg's length
#: [s/√m] the same of slow people, and least product with the stride's length, in legs, which theirs doesn't reach; and
#: the same of hurried people, with products between which theirs isn't (`motionenv bench lifting.wrong_input`).
_SLOW, _LONG, _HURRY, _SHORT = 2.0, 3.0, 0.8, (0.7, 1.35)
_SMALL, _LEISURE = 0.45, 1.6  # [m] legs of toddlers, who step quickly, and [s/√m] a stride that they never take
_RUNS = 5.0  # [m/s²] least squared speed over the leg's length at which people run
_MIXED = 0.25  # share of the frames that point against the way, in runners too

#: Names of the angles without their side.
ANGLES = tuple(name.removeprefix("left_") for name in CLINICAL_ANGLES if name.startswith("left_"))


@dataclass(frozen=True, eq=False, repr=False)
class Trial(OneLine):
    """One analysed capture: its feet, clinical angles, gait events, stretches and strides.

    Attributes:
        name, person: of the capture, and the person's label, "" if the file doesn't name one.
        feet, angles, events, stretches, strides: what was found.
        leg_length: of the person [m]; None if the file doesn't state it.
        notes: what a reader of the figures should know.
        doubts: what in the capture isn't plausible, such as a limb whose length changes; a report begins with it.
    """

    name: str
    person: str
    feet: Feet
    angles: ClinicalAngles
    events: Events
    stretches: tuple[Stretch, ...]
    strides: tuple[Stride, ...]
    leg_length: float | None
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    def _shown(self) -> str:
        person = f" of {self.person!r}" if self.person else ""
        return f"{self.name!r}{person}, {self.seconds:.1f} s, {counted(len(self.strides), 'stride')}"

    @property
    def seconds(self) -> float:
        """Duration [s]."""
        return len(self.feet.pelvis) / self.feet.fps

    @property
    def steady(self) -> tuple[Stride, ...]:
        """The strides that figures are taken from: those of steady walking, or all if none is."""
        return tuple(s for s in self.strides if s.kind == "steady") or self.strides

    def curves(self, side: str) -> np.ndarray:
        """The angles of one `side` over its steady strides, (strides, 101, 13) [degrees], in the order of `ANGLES`."""
        strides = [stride for stride in self.steady if stride.side == side]
        columns = [self.angles.names.index(f"{side}_{name}") for name in ANGLES]
        return normalised(self.angles.values[:, columns], self.feet.fps, strides)

    def both_sides(self) -> np.ndarray:
        """The angles of both sides over their steady strides, (strides, 101, 13) [degrees]."""
        return np.concatenate([self.curves("left"), self.curves("right")])


def read_trial(
    path: str | Path, *, static: Markers | None = None, marker_map: MarkerMap | str | None = None,
    fps: float | None = None, unit: str | float | None = None, up: str | None = None, person: str | None = None,
    method: str = "auto", wands: str = "auto", override: bool = False,
) -> Trial:  # fmt: skip
    """Read and analyse one capture file.

    Args:
        path: any file that `motionenv.read` reads.
        static, marker_map, method, wands: as in `analyse`.
        fps, unit, override: frame rate [Hz] and unit of length, if the file doesn't specify them, or in any case.
        up, person: vertical axis, and the one of several people, as of `motionenv.read`.

    Raises:
        MotionError: as in `motionenv.read` and `analyse`.
    """
    capture = read(path, fps=fps, unit=unit, up=up, person=person, override=override)
    trial = analyse(capture, static=static, marker_map=marker_map, method=method, wands=wands)
    return trial if trial.name else replace(trial, name=Path(path).stem)


def analyse(
    capture: Markers | Motion, *, static: Markers | None = None, marker_map: MarkerMap | str | None = None,
    method: str = "auto", wands: str = "auto",
) -> Trial:  # fmt: skip
    """Analyse one capture of a walk.

    Args:
        capture: markers (frames, points, 3), or a motion (frames, 25).
        static: a standing trial of the same person.
        marker_map: which points are which landmarks; None recognises the marker set.
        method: where events come from; see `motionenv.gait.find_events`.
        wands: what to do with the markers on thighs and shanks; see `motionenv.mocap.clinical.clinical_angles`.

    Raises:
        GapError: a single frame, or no foot or pelvis in it.
        MotionError: as in `motionenv.retarget`.
    """
    frames = capture.poses.shape[-2] if isinstance(capture, Motion) else capture.positions.shape[-3]
    if frames < 2:
        name = capture.name or "this capture"
        raise GapError(f"{name} has {frames} frame: a standing trial goes to --static (static=)")
    found = find_doubts(capture, marker_map)
    try:
        feet = feet_of(capture, marker_map)
    except GapError as error:
        raise GapError("; ".join([str(error), *found])) from None
    recording = capture.recording if isinstance(capture, Markers) else None
    events = find_events(feet, recording, method)
    stretches = find_stretches(feet)
    strides = find_strides(feet, events, stretches)
    if not strides:  # those between other phases, with a contact in between, at which their curves begin
        strides = tuple(s for s in strides_by_phase(feet, events, stretches) if np.isfinite(s.contact))
    angles = _angles(capture, static, marker_map, wands)
    person = recording.subject if recording else ""
    doubts = (*found, *doubts_of(feet, strides))
    leg = _leg_length(capture, static)
    notes = (*capture.notes, *angles.notes, *events.notes, *notes_of(feet, strides))
    return Trial(capture.name, person, feet, angles, events, stretches, strides, leg, notes, doubts)


def doubts_of(feet: Feet, strides: tuple[Stride, ...]) -> Iterator[str]:
    """Doubts about `strides` of `feet` too quick or slow for such legs, or a sprinter's, and who turns backwards."""
    if not strides:
        return
    seconds, speed = (middle(np.array([getattr(s, of) for s in strides])) for of in ("seconds", "speed"))
    feet_at = [path[:, 2] for side in feet.sides for path in (feet.heel[side], feet.toe[side])]
    leg = middle(feet.pelvis[:, 2] - np.fmin.reduce(feet_at))
    runs = _runs(strides) and speed**2 > _RUNS * leg
    time, pace = seconds / np.sqrt(leg), speed * seconds**2 / leg**1.5
    hasty = time < _HASTE or (time < _HURRY and _SHORT[0] < pace < _SHORT[1])
    quick, slow = seconds < _QUICKEST or (hasty and not runs), time > _SLOW and pace > _LONG
    if quick or slow or (leg < _SMALL and time > _LEISURE):
        than = "quicker" if quick else "slower, for their length," if slow else "slower"
        check = "frame rate, fps= (--fps)" if quick or slow else "unit of length, unit= (--unit)"
        what = f"strides of {seconds:.2f} s at {speed:.1f} m/s are {than} than people's with legs of {leg:.2f} m"
        yield f"{what}: check the {check}"
    if _MIXED < (share := backward_share(feet)) < 1 - _MIXED:
        yield f"feet point backwards {share:.0%} of the time, and events are found for one way only: cut the capture"


def _runs(strides: tuple[Stride, ...]) -> bool:
    return sum(stride.activity == "running" for stride in strides) > 0.5 * len(strides)


def _angles(capture: Markers | Motion, static, marker_map, wands: str) -> ClinicalAngles:
    """Clinical angles from markers, or from the fitted body where the capture shows joints only."""
    if isinstance(capture, Motion):
        return clinical_angles(capture)
    try:
        found = clinical_angles(capture, static=static, marker_map=marker_map, wands=wands)
    except GapError:  # joints without any marker on the skin
        return clinical_angles(retarget(capture, marker_map=marker_map))
    hips = [found[f"{side}_hip_flexion"] for side in ("left", "right")]
    return found if np.isfinite(hips).any() else clinical_angles(retarget(capture, marker_map=marker_map))


def _leg_length(capture: Markers | Motion, static: Markers | None) -> float | None:
    """Mean length of the legs [m] that the capture's file states, or the standing trial's."""
    for file in (capture, static):
        if isinstance(file, Markers):
            known = measurements_of(file.recording)
            length = 0.5 * (known.left.leg_length + known.right.leg_length)
            if np.isfinite(length):
                return float(length)
    return None


def notes_of(feet: Feet, strides: tuple[Stride, ...]) -> tuple[str, ...]:
    """What a reader of the figures of these `feet` and `strides` should know."""
    notes = list(feet.notes)
    if len(feet.sides) == 1:
        notes.append(f"only the {'/'.join(feet.sides)} leg was captured, so there are no steps")
    if not strides:  # nor does it walk anywhere
        return (*notes, "no stride was found, so there are no step parameters")
    if np.isfinite(strides[0].contact):
        notes.append(
            "no foot's contact is seen twice: strides are those between other phases, and their curves, which begin at "
            "the contact in between, end with what came before it"
        )
    if all(stride.kind != "steady" for stride in strides):
        notes.append("no stride is steady: the figures are of strides in which the walker turns or changes speed")
    if backward_share(feet) > 0.5:
        notes.append("the walker goes backwards, so initial contact is the toes' and toe-off the heel's")
    if _runs(strides):
        notes.append("both feet are in the air between steps, so this is running and has no double support")
    if on_treadmill(feet):
        notes.append(
            "the walker stays in place, as on a treadmill: speed and lengths are over the belt, by how it moves "
            "the foot that stands"
        )
    return tuple(notes)
