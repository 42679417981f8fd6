"""Gait of a lifted person: joint angles, events and step parameters, each with what the lifting leaves uncertain.

Everything is computed on the estimate and on draws from its posterior (`Lifted.draws`). The draws' spread about the
estimate is the lifting's uncertainty: of an angle, an event's time, or a mean over strides. A parameter's interval adds
the spread of the strides, as the law of total variance has it.

    >>> from motionenv.lifting import gait_of, lift
    >>> walk = gait_of(lift(motionenv.read_points("keypoints.json", fps=30)))        # doctest: +SKIP
    >>> walk["left_knee_flexion"], walk.band("left_knee_flexion")                   # doctest: +SKIP
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import stdtrit

from motionenv._core.representation import OneLine, counted
from motionenv._core.rotations import to_euler
from motionenv._core.runs import runs
from motionenv._core.validation import checked_whole
from motionenv.errors import GapError
from motionenv.gait.events import Events, kinematic_events
from motionenv.gait.feet import Feet, bridged, smoothed
from motionenv.gait.stretches import Stretch, find_stretches
from motionenv.gait.strides import Stride, find_strides, mean_and_sd, normalised
from motionenv.gait.summary import Parameter, summarise
from motionenv.gait.trial import ANGLES, doubts_of, notes_of
from motionenv.lifting.pipeline import BAND, FROM_AFAR, Lifted, motion_of
from motionenv.mocap.clinical import clinical_angles
from motionenv.mocap.clinical.angles import wrapped
from motionenv.mocap.clinical.gait_model import SIGN, frame, unit
from motionenv.mocap.clinical.progression import progression
from motionenv.types import MARKERS

_M = {name: i for i, name in enumerate(MARKERS)}
_TRUNK = ("trunk_tilt", "trunk_obliquity", "trunk_rotation")
#: Angles of one side: those of `motionenv.gait`, and the trunk's against the direction of progression.
SIDE_ANGLES = (*ANGLES, *_TRUNK)
#: Angles of both sides, in the order of `LiftedGait.angles`.
NAMES = tuple(f"{side}_{name}" for side in ("left", "right") for name in SIDE_ANGLES)
_UNKNOWN = {
    "pelvis_tilt": "two hips and the point between them don't show how far the pelvis tilts forward",
    "hip_rotation": "a thigh is seen as a line, which looks the same however it turns about itself",
    "knee_adduction": "the knee of the lifted body is a hinge",
    "knee_rotation": "the knee of the lifted body is a hinge",
    "ankle_adduction": "a foot is seen as a line, which looks the same however it turns about itself",
    "ankle_rotation": "a foot is seen as a line, which looks the same however it turns about itself",
}
_FOOTLESS = {
    name: "the points show no heels and toes, or too rarely" for name in ("ankle_dorsiflexion", "foot_progression")
}
#: [degrees] forward tilt of the pelvis that hips' flexion is measured from and no point shows: of seven people of
#: laboratories. And by how much people differ in that, and definitions of trunk and foot
#: (`motionenv bench lifting.degrees`).
_TILT = 7.0
_DEFINED = {"hip_flexion": 5.0, "ankle_dorsiflexion": 3.0, "trunk_tilt": 2.0}
_HIPS = (
    "no point shows how far the pelvis tilts forward: hips are measured from a pelvis that tilts by 7 ± 5°, as people "
    "usually do"
)
_SHAPE = (
    "people look as if their picture had been made {}: check its shape, of points relative to it that of size= (--size)"
)
_FEWEST = 8  # draws
_FINE = 100.0  # [Hz] at least, to which paths are interpolated: contacts are then as exact as at that rate
#: [s] by which a heel, or an ankle, lands after it is furthest ahead of the pelvis, of five people of laboratories in
#: four views: lifted feet don't stand still enough to show where they stop. By how much toe-offs of ankles are early,
#: a median of 11 recordings of laboratories and CMU, of joints alone at 30 Hz; and the deviation of both.
_LANDS, _EARLY, _EVENT = 0.040, 0.045, 0.025
#: [Hz] cut-off frequency for feet, and share of the frames, those of the middle of stance, in which they are slowest.
_CALM, _RESTS = 6.0, 0.25
_SAME = 0.2  # [s] within which a draw's event is that of the estimate
_HIDDEN = 0.5  # [s] for which a joint of a leg may be hidden before what follows from it is cut out
#: Half width [degrees] of its 90 % band from which on an angle is undetermined; half of how much hips and knees move.
_WIDEST = {"hip_flexion": 20.0, "knee_flexion": 30.0}
_WIDE = 15.0
#: How often the error of events against each other is in a share of the cycle, which doesn't average out.
_OF_EVENTS = {"stance": 1, "swing": 1, "single_support": 1, "double_support": 2}


@dataclass(frozen=True, repr=False)
class GaitEvent(OneLine):
    """An "initial_contact" or "toe_off" (`kind`) of a `side`, at `time` ± `deviation` [s since the first frame].

    `share` of the draws have it: in the others, the foot doesn't seem to step there.
    """

    kind: str
    side: str
    time: float
    deviation: float
    share: float


@dataclass(frozen=True, repr=False)
class Cut(OneLine):
    """What is cut out from `start` to `end` [s] since the first frame, and `why`."""

    start: float
    end: float
    why: str


@dataclass(frozen=True, eq=False, repr=False)
class LiftedGait(OneLine):
    """The gait of a lifted person.

    Attributes:
        lifted: of whom.
        angles: (frames, 32) [degrees] in the order of `NAMES`, with the signs of `motionenv.gait`; NaN where they are
            undetermined or cut out.
        deviations: (frames, 32) [degrees] their standard deviations.
        events: initial contacts and toe-offs in the order of time.
        stretches, strides: what the estimate does, and its strides.
        parameters: step parameters; `low` and `high` are 90 % intervals of the mean that hold both the strides' spread
            and the lifting's uncertainty.
        curves: by name, (strides, 101) [degrees] over the gait cycle.
        curve_bands: by name, half width (101,) of the mean curve's 90 % band, of strides and lifting.
        cut: what was cut out, and why.
        undetermined: by angle without side, why it isn't told.
        scale: where sizes come from, in words.
        warnings: what else is wrong with the figures.
        feet: paths of feet and pelvis, at 100 Hz or more.
    """

    lifted: Lifted
    angles: np.ndarray
    deviations: np.ndarray
    events: tuple[GaitEvent, ...]
    stretches: tuple[Stretch, ...]
    strides: tuple[Stride, ...]
    parameters: tuple[Parameter, ...]
    curves: Mapping[str, np.ndarray]
    curve_bands: Mapping[str, np.ndarray]
    cut: tuple[Cut, ...]
    undetermined: Mapping[str, str]
    scale: str
    warnings: tuple[str, ...]
    feet: Feet

    def _shown(self) -> str:
        return f"{len(self.angles) / self.lifted.points.fps:.1f} s, {counted(len(self.strides), 'stride')}"

    def __getitem__(self, name: str) -> np.ndarray:
        """One angle (frames,) [degrees] by its name, such as "left_knee_flexion"."""
        return self.angles[:, NAMES.index(name)]

    def band(self, name: str) -> np.ndarray:
        """Ends (2, frames) [degrees] of the 90 % band of the angle `name`."""
        i = NAMES.index(name)
        return self.angles[:, i] + BAND * np.array([[-1.0], [1.0]]) * self.deviations[:, i]


@dataclass(frozen=True, eq=False)
class _Walk:
    """One motion, analysed: angles (frames, 32) [degrees], and the rest."""

    angles: np.ndarray
    feet: Feet
    events: dict[tuple[str, str], np.ndarray]
    stretches: tuple[Stretch, ...]
    strides: tuple[Stride, ...]

    @property
    def steady(self) -> tuple[Stride, ...]:
        return tuple(s for s in self.strides if s.kind == "steady") or self.strides

    def curves(self, fps: float) -> dict[str, np.ndarray]:
        """By name, the angle over the steady strides of its side (strides, 101), of what is known."""
        found = {}
        for side in ("left", "right"):
            cut = normalised(self.angles, fps, [stride for stride in self.steady if stride.side == side])
            for i, name in enumerate(NAMES):
                known = np.isfinite(cut[:, :, i]).all(1)
                if name.startswith(side) and known.any():
                    found[name] = cut[known, :, i]
        return found


def gait_of(lifted: Lifted, *, draws: int = 64, rng: np.random.Generator | int = 0) -> LiftedGait:
    """Joint angles, events and step parameters of a `lifted` person, with their uncertainty.

    Args:
        lifted: who walks.
        draws: number of draws, at least 8; of 64, a band's width is known to 9 %.
        rng: source of randomness, or its seed; the same, the same figures.

    Raises:
        GapError: every frame is cut out, because nobody who walks is seen.
    """
    count = checked_whole(draws, "draws", _FEWEST)
    fps = lifted.points.fps
    gone, cut = _cut(lifted)
    if gone.all():
        raise GapError(f"{lifted.points.name or 'this film'} shows nobody who walks: {cut[0].why}")
    blank = lambda places: np.where(gone[..., None], np.nan, places)
    places, feet = lifted.draws_with_feet(count, np.random.default_rng(rng))
    estimate = _analysed(blank(lifted.positions), lifted.feet, fps)
    ends = [None] * count if feet is None else list(feet)
    drawn = [_analysed(blank(one), its, fps) for one, its in zip(places, ends, strict=True)]
    deviations = np.sqrt(np.mean([wrapped(one.angles - estimate.angles) ** 2 for one in drawn], axis=0))
    deviations = np.hypot(deviations, [_DEFINED.get(name.split("_", 1)[1], 0.0) for name in NAMES])
    untold = np.isnan(_both(estimate.angles, "ankle_dorsiflexion")).all()
    undetermined = _UNKNOWN | (_FOOTLESS if untold else {}) | _too_wide(deviations)
    told = ~np.isin([name.split("_", 1)[1] for name in NAMES], list(undetermined))
    estimate, *drawn = (replace(one, angles=np.where(told, one.angles, np.nan)) for one in (estimate, *drawn))
    curves = estimate.curves(fps)
    return LiftedGait(
        lifted, estimate.angles, np.where(told, deviations, np.nan), _events(estimate, drawn), estimate.stretches,
        estimate.strides, _parameters(estimate, drawn), curves, _curve_bands(curves, drawn, fps), cut, undetermined,
        _scale(lifted), _warnings(lifted, estimate), estimate.feet,
    )  # fmt: skip


def _analysed(places: np.ndarray, ends: np.ndarray | None, fps: float) -> _Walk:
    """A motion (frames, 15, 3) [m], NaN where nobody is, with heels and toes (frames, 4, 3) or None."""
    feet = _feet(places, ends, fps)
    early = {"initial_contact": 0.0, "toe_off": _EARLY if feet.notes else 0.0}
    events = [replace(event, time=event.time + early[event.kind]) for event in kinematic_events(feet, _LANDS)]
    found = Events(tuple(sorted(events, key=lambda event: event.time)), {"kinematics": len(events)})
    times = {(k, s): np.array(found.times(k, s)) for k in early for s in SIGN}
    stretches = find_stretches(feet)
    return _Walk(_angles(places, ends, fps), feet, times, stretches, find_strides(feet, found, stretches))


def _angles(places: np.ndarray, ends: np.ndarray | None, fps: float) -> np.ndarray:
    """The angles (frames, 32) [degrees] of the body that fits a motion, and of lines through hips, trunk and feet."""
    out = np.full((len(places), len(SIGN), len(SIDE_ANGLES)), np.nan)
    out[..., : len(ANGLES)] = clinical_angles(motion_of(places, fps)).values.reshape(*out.shape[:2], -1)
    angle = {name: out[..., i] for i, name in enumerate(SIDE_ANGLES)}
    for name in ("pelvis_tilt", "hip_rotation"):
        angle[name][:] = np.nan
    hips = places[:, _M["left_hip"]] - places[:, _M["right_hip"]]
    shoulders = places[:, _M["left_shoulder"]] - places[:, _M["right_shoulder"]]
    spine = 0.5 * (places[:, _M["left_shoulder"]] + places[:, _M["right_shoulder"]]) - places[:, _M["pelvis"]]
    x, y = unit(np.cross(hips, [0.0, 0.0, 1.0])), unit(hips)
    pelvis = np.stack([x, y, np.cross(x, y)], axis=-1)
    way = progression(places[:, _M["pelvis"]], pelvis, fps, axes=False)
    sign = np.array(list(SIGN.values()))
    for name, turned in (("pelvis", pelvis), ("trunk", frame(spine, shoulders))):
        tilt, obliquity, rotation = np.degrees(to_euler("YXZ", way.swapaxes(-1, -2) @ turned)).T[..., None]
        angle[f"{name}_obliquity"][:], angle[f"{name}_rotation"][:] = sign * obliquity, -sign * rotation
        if name == "trunk":  # of the pelvis, hips don't show it
            angle["trunk_tilt"][:] = tilt
    angle["hip_flexion"][:] += _TILT - angle["trunk_tilt"]  # the thigh against the vertical, and the pelvis' usual tilt
    for k, side in enumerate(SIGN):
        if ends is None:
            break
        shank = places[:, _M[f"{side}_ankle"]] - places[:, _M[f"{side}_knee"]]
        heel, toe = ends[:, 2 * k], ends[:, 2 * k + 1]
        foot, lean = (np.einsum("tba,tb->ta", pelvis, line) for line in (toe - heel, shank))
        pitch = np.degrees(np.arctan2(foot[:, 2], foot[:, 0]) - np.arctan2(lean[:, 0], -lean[:, 2]))
        angle["ankle_dorsiflexion"][:, k] = wrapped(pitch - _flat(heel, toe, fps))
        turned = np.einsum("tba,tb->ta", way, toe - heel)
        angle["foot_progression"][:, k] = -sign[k] * np.degrees(np.arctan2(turned[:, 1], turned[:, 0]))
    return out.reshape(len(out), -1)


def _both(angles: np.ndarray, name: str) -> np.ndarray:
    """The columns (frames, 2) of `angles` (frames, 32) that are an angle of both sides."""
    return angles[:, [NAMES.index(f"{side}_{name}") for side in SIGN]]


def _flat(heel: np.ndarray, toe: np.ndarray, fps: float) -> float:
    """Median pitch [degrees] of the line from heel to toe while both rest: heels and toes aren't equally high."""
    if not np.isfinite(toe - heel).any():
        return 0.0
    ends = np.stack([smoothed(path, fps, _CALM) for path in (heel, toe)])
    speed = np.linalg.norm(np.gradient(ends, axis=1), axis=-1).max(axis=0) * fps
    rests = np.isfinite(toe - heel).all(-1) & (speed < np.nanquantile(speed, _RESTS))
    line = (toe - heel)[rests]
    return float(np.degrees(np.median(np.arctan2(line[:, 2], np.hypot(line[:, 0], line[:, 1]))))) if len(line) else 0.0


def _feet(places: np.ndarray, ends: np.ndarray | None, fps: float) -> Feet:
    """Pelvis and feet of a motion (frames, 15, 3) [m], interpolated to `_FINE` Hz or more.

    Without heels and toes (frames, 4, 3), ankles stand for them.
    """
    fine = int(np.ceil(_FINE / fps))
    pelvis = _finer(places[:, _M["pelvis"]], fine)
    if ends is not None and np.isfinite(ends).all(-1).any(axis=0).all():
        paths = [_finer(ends[:, k], fine) for k in range(4)]
        heel, toe = dict(zip(SIGN, paths[::2], strict=True)), dict(zip(SIGN, paths[1::2], strict=True))
        return Feet(pelvis, heel, toe, fps * fine)
    across = _finer(places[:, _M["left_hip"]] - places[:, _M["right_hip"]], fine)
    ahead = 1e-3 * np.cross(across, [0.0, 0.0, 1.0])  # tells where feet point, and no more
    heel = {side: _finer(places[:, _M[f"{side}_ankle"]], fine) for side in SIGN}
    heel = {side: path for side, path in heel.items() if np.isfinite(path).any()}
    toe = {side: path + ahead for side, path in heel.items()}
    return Feet(pelvis, heel, toe, fps * fine, ("events are those of ankles",))


def _finer(path: np.ndarray, fine: int) -> np.ndarray:
    """A `path` (frames, 3) at so many times its rate by cubic splines; NaN beside unknown frames."""
    known = np.isfinite(path).all(-1)
    if not known.any():
        return np.full((fine * (len(path) - 1) + 1, 3), np.nan)
    at = np.arange(fine * (len(path) - 1) + 1) / fine
    both = known[np.floor(at).astype(int)] & known[np.ceil(at).astype(int)]
    return np.where(both[:, None], CubicSpline(np.arange(len(path)), bridged(path))(at), np.nan)


def _cut(lifted: Lifted) -> tuple[np.ndarray, tuple[Cut, ...]]:
    """Which markers (frames, 15) are cut out, and what to say of it."""
    fps, frames = lifted.points.fps, len(lifted.positions)
    nobody = ~np.isfinite(lifted.positions).any(axis=(1, 2))
    gone = np.zeros((frames, len(MARKERS)), dtype=bool)
    found = []
    unlike = "postures are unlike those of people who walk, turn or run"
    for what, where in (("nobody is seen", nobody), (unlike, lifted.unlike & ~nobody)):
        gone |= where[:, None]
        found += [Cut(a / fps, b / fps, what) for a, b in runs(where)]
    for name in (f"{side}_{joint}" for joint in ("hip", "knee", "ankle") for side in SIGN):
        hidden = ~np.isfinite(lifted.points.positions[:, _M[name]]).all(-1) & ~gone[:, _M["pelvis"]]
        for a, b in runs(hidden):
            if b - a > _HIDDEN * fps:
                gone[a:b, _M[name]] = True
                what = f"the {name.replace('_', ' ')} is hidden or out of the picture, so its angles are cut out"
                found.append(Cut(a / fps, b / fps, what))
    return gone, tuple(sorted(found, key=lambda cut: cut.start))


def _too_wide(deviations: np.ndarray) -> dict[str, str]:
    """By angle without its side, that the band of `deviations` (frames, 32) [degrees] is too wide to tell anything."""
    found = {}
    for name in SIDE_ANGLES:
        of_both = _both(deviations, name)
        known = of_both[np.isfinite(of_both)]
        if len(known) and (half := BAND * float(np.median(known))) > _WIDEST.get(name, _WIDE):
            found[name] = f"its 90 % band is ± {half:.0f}°, wider than people move there"
    return found


def _events(estimate: _Walk, drawn: Sequence[_Walk]) -> tuple[GaitEvent, ...]:
    found = []
    for (kind, side), times in estimate.events.items():
        for time in times:
            apart = [min(one.events[kind, side] - time, key=abs, default=np.inf) for one in drawn]
            near = np.array([off for off in apart if abs(off) < _SAME])
            spread = float(np.sqrt((near**2).mean())) if len(near) else _SAME
            found.append(GaitEvent(kind, side, float(time), float(np.hypot(spread, _EVENT)), len(near) / len(drawn)))
    return tuple(sorted(found, key=lambda event: event.time))


def _parameters(estimate: _Walk, drawn: Sequence[_Walk]) -> tuple[Parameter, ...]:
    """The estimate's parameters with 90 % intervals of their means: of strides, lifting and events together.

    Those that half of the draws don't have are left out, and so is variability, of which the lifting's noise is a part.
    """
    each = [{(p.name, p.side): p.mean for p in summarise(one.steady)} for one in drawn]
    found = []
    for p in summarise(estimate.steady):
        means = np.array([one[p.name, p.side] for one in each if (p.name, p.side) in one])
        if p.name.endswith("_cv") or 2 * len(means) < len(drawn):
            continue
        free = max(p.n - 1, 1)
        of_strides = 0.5 * (p.high - p.low) / float(stdtrit(free, 0.975)) if p.n > 1 else 0.0
        seconds = float(np.mean([stride.seconds for stride in estimate.steady]))
        of_events = 100 * _EVENT / seconds * _OF_EVENTS.get(p.name, 0)
        variance = of_strides**2 + float(((means - p.mean) ** 2).mean()) + of_events**2
        # Satterthwaite: only the strides' part is estimated from few.
        freedom = free * (variance / of_strides**2) ** 2 if of_strides > 0 else np.inf
        half = (float(stdtrit(freedom, 0.95)) if np.isfinite(freedom) else BAND) * np.sqrt(variance)
        found.append(replace(p, low=p.mean - half, high=p.mean + half))
    return tuple(found)


def _curve_bands(curves: Mapping[str, np.ndarray], drawn: Sequence[_Walk], fps: float) -> dict[str, np.ndarray]:
    """By name, half widths (101,) [degrees] of the 90 % bands of mean curves: of strides and lifting together."""
    each = [one.curves(fps) for one in drawn]
    found = {}
    for name, own in curves.items():
        means = [one[name].mean(0) for one in each if name in one]
        if means:
            of_strides = np.nan_to_num(mean_and_sd(own)[1]) ** 2 / len(own)
            lifting = (wrapped(np.array(means) - own.mean(0)) ** 2).mean(0)
            found[name] = BAND * np.sqrt(of_strides + lifting + _DEFINED.get(name.split("_", 1)[1], 0.0) ** 2)
    return found


def _scale(lifted: Lifted) -> str:
    """Where sizes come from."""
    fit = lifted.free
    sure = f"± {100 * BAND * fit.unit_deviation:.0f} % (90 %), as are all lengths and speeds"
    if lifted.points.unit == "m":
        return f"Sizes are those of the points' metres, ± {100 * BAND * fit.unit_deviation:.0f} % (90 %)."
    if fit.height is not None:
        return f"Sizes follow from the person's height, {fit.height:.2f} m, {sure}."
    if fit.posed:
        return f"Sizes follow from the camera's height above the floor, {sure}."
    return f"Neither the person's height nor the camera's pose is known: sizes are those of an average adult, {sure}."


def doubts_about(lifted: Lifted, walk: _Walk | None = None) -> list[str]:
    """What makes the picture's shape or, if plausible, the frame rate or steps of what was `lifted` doubtful."""
    walk = walk or _analysed(lifted.positions, lifted.feet, lifted.points.fps)
    shape = [_SHAPE.format("wider" if lifted.free.shape > 0 else "narrower")] if lifted.free.shape else []
    return [*shape, *(doubts_of(walk.feet, walk.strides) if lifted.plausible else ())]


def _warnings(lifted: Lifted, estimate: _Walk) -> tuple[str, ...]:
    """What else is wrong with the figures."""
    other = lifted.free.other
    swapped = int(lifted.swapped.any(axis=1).sum())
    said = {
        "this is unlike the people learned from, so intervals don't hold": not lifted.plausible,
        f"with probability {other.probability if other else 0:.0%}, left and right are exchanged throughout, and the "
        "person faces another way": other is not None,
        FROM_AFAR: lifted.points.unit == "m",
        f"left and right were exchanged in {swapped} frames, which was corrected": swapped > 0,
    }  # fmt: skip
    of_feet = notes_of(estimate.feet, estimate.strides)
    notes = [*(text for text, holds in said.items() if holds), *doubts_about(lifted, estimate), *of_feet, _HIPS]
    return tuple(f"{note[0].upper()}{note[1:]}." for note in notes)
