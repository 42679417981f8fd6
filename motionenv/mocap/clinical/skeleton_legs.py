"""Legs of skeletons that other software fitted to markers, corrected by anatomy.

CMU's ASF/AMC skeletons let everybody crouch. Against the markers of the same trials (02_01 and 06_01 as C3D), their
ankles are right within a centimetre, but

- the hips lie too low and too far ahead, with thighs down to four fifths of the shanks; a knee that is nearly straight
  bends by 10 degrees more for every 1.5 cm that the hip is too low;
- in 02_01 the pelvis rises by 2.2 cm in a step, the waist's markers by 3.6 (benchmarks/mocap/knees.py).

`correct_legs` measures both on each walk, by rules of anatomy and mechanics:

1. An adult's knee is within a few degrees of straight twice in each stride, at initial contact and at the end of
   single support, and bends to about 18 degrees in loading and 60 in swing (Perry & Burnfield 2010, chapter 5).
2. Thigh and shank are equally long, and the hips are at 0.64 of the height of the base of the neck (Winter 2009,
   fig. 4.1).
3. Over a step the pelvis rises as an inverted pendulum of the leg's length does (Zijlstra & Hof 2003).

Hips move with the pelvis; knees follow from hips and ankles with the captured axis of the knee.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from motionenv._core.representation import OneLine
from motionenv.body.skeleton import ANKLE_HEIGHT, LEG_SHARE, NODES, TRUNK_SHARE
from motionenv.mocap.clinical.progression import progression

_SIDES = ("left", "right")
_AT = {name: i for i, name in enumerate(NODES)}
_ABOVE = [i for i, name in enumerate(NODES) if not name.endswith(("knee", "ankle"))]

# A walk: steps of this time [s], and this speed [m/s].
_STEP_SECONDS = (0.3, 1.0)
_SLOWEST = 0.4
_AHEAD = 0.2  # [m] by which the ankle's way past the pelvis must stand out
_FLEXED = np.radians(25.0)  # bend of a knee beyond which its points show its axis

# Rule 1: knee flexion [degrees] at a comfortable speed [m/s], its increase per m/s (Lelas et al. 2003), its spread (the
# bent knee varies more between people than the straight one), in which part of the stride from foremost to foremost
# ankle, and as which value of that part.
_COMFORTABLE = 1.3
_KNEE: dict[str, tuple[float, float, float, tuple[float, float], Callable[[np.ndarray], float]]] = {
    "initial contact": (5.0, 0.0, 2.0, (0.01, 0.06), np.mean), "loading": (18.0, 8.0, 3.0, (0.05, 0.30), np.max),
    "terminal stance": (5.0, 0.0, 2.0, (0.25, 0.60), np.min), "swing": (60.0, 6.0, 3.0, (0.6, 0.9), np.max),
}  # fmt: skip
# Rule 2, as standard deviations of people [m], and of the thigh's length relative to the shank's; and of what the
# skeleton's maker got wrong [m].
_HIP_HEIGHT = (ANKLE_HEIGHT + LEG_SHARE) / (ANKLE_HEIGHT + LEG_SHARE + TRUNK_SHARE)
_HIP_SD, _RATIO_SD, _AHEAD_SD, _SIDES_SD, _SHANK_SD = 0.02, 0.04, 0.03, 0.01, 0.02
# Rule 3: a step is 1.25 times that of the pendulum. The error of the pelvis' height is a cosine over a step with its
# maximum at this share of it and at most this amplitude [m], as in both trials whose markers are known.
_PENDULUM, _SUMMIT, _HIGHEST = 1.25, 0.66, 0.008


@dataclass(frozen=True)
class LegCorrection:
    """Errors of the legs of a fitted skeleton [m].

    `left` and `right` are shifts of the hips in the upright pelvis, forward and up, `thigh` and `shank` the lengths of
    both sides', and `rise` is the amplitude by which the pelvis rises more over a step.
    """

    left: tuple[float, float]
    right: tuple[float, float]
    thigh: float
    shank: float
    rise: float

    def __str__(self) -> str:
        forward, up = 1000 * np.mean([self.left, self.right], axis=0)
        along, upward = "forward" if forward > 0 else "back", "up" if up > 0 else "down"
        return (
            f"the skeleton's, moved {abs(forward):.0f} mm {along} and {abs(up):.0f} mm {upward}, so that knees "
            "straighten as in walking adults"
        )


@dataclass(frozen=True, eq=False, repr=False)
class SkeletonWalk(OneLine):
    """Nodes (frames, 16, 3) [m] of a fitted skeleton that may walk, at `fps` [Hz].

    `pelvis` is its rotation (frames, 3, 3) relative to its rest pose, and `shanks` are those of each side's shank, by
    side.
    """

    nodes: np.ndarray
    pelvis: np.ndarray
    shanks: dict[str, np.ndarray]
    fps: float


@dataclass(frozen=True, eq=False)
class _Steps:
    upright: np.ndarray  # (frames, 3, 3) pelvis → world, upright on average
    phase: np.ndarray  # (frames,) in steps
    weight: np.ndarray  # (frames,) 1 while walking, falling to 0 over a step
    contacts: dict[str, np.ndarray]  # frames of foremost ankles by side
    speed: float  # [m/s]
    length: float  # of a step [m]


def correct_legs(walk: SkeletonWalk) -> tuple[np.ndarray, LegCorrection] | None:
    """The nodes (frames, 16, 3) [m] with corrected hips, knees and height of the pelvis, and what was corrected.

    None if the `walk` doesn't show two steps in a row, by which to correct it.
    """
    steps = _steps(walk)
    if steps is None:
        return None
    rise = _missing_rise(walk, steps)
    nodes = _raised(walk.nodes, steps, rise)
    correction = _correction(nodes, steps, rise)
    for side in _SIDES:
        forward, up = getattr(correction, side)
        shift = steps.upright @ np.array([forward, 0.0, up])
        hip, knee, ankle = (_AT[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        nodes[:, hip] += shift
        nodes[:, _AT["pelvis"]] += 0.5 * shift
        axis = _knee_axis(walk, side)
        nodes[:, knee] = _bent(nodes[:, hip], nodes[:, ankle], axis, correction.thigh, correction.shank)
    return nodes, correction


def _correction(nodes: np.ndarray, steps: _Steps, rise: float) -> LegCorrection:
    """Shifts and lengths that satisfy the rules 1 and 2 best, by least squares."""
    neck, pelvis = nodes[:, [_AT["neck"], _AT["pelvis"]], 2].mean(axis=0)
    higher = float(_HIP_HEIGHT * neck - pelvis)
    legs = _legs(nodes, steps)
    captured = float(np.mean([leg.shank for leg in legs]))

    def off(x: np.ndarray) -> list[float]:
        shifts, thigh, shank = x[:4].reshape(2, 2), x[4], x[5]
        bent = [_knee_flexion(leg, shift, thigh, shank) for leg, shift in zip(legs, shifts, strict=True)]
        wanted = [
            (each[at] - mean - slope * (steps.speed - _COMFORTABLE)) / (sd * np.sqrt(2))
            for each in bent
            for at, (mean, slope, sd, *_) in _KNEE.items()
        ]
        (forward, up), apart = shifts.mean(axis=0), (shifts[0] - shifts[1]) / _SIDES_SD
        lengths = (shank - captured) / _SHANK_SD, np.log(thigh / shank) / _RATIO_SD
        return [*wanted, *apart, forward / _AHEAD_SD, (up - higher) / _HIP_SD, *lengths]

    with np.errstate(invalid="ignore"):  # a step to negative lengths gives NaN, and least_squares takes a shorter one
        x = least_squares(off, [0.0, higher, 0.0, higher, captured, captured], diff_step=1e-3).x.tolist()
    return LegCorrection((x[0], x[1]), (x[2], x[3]), x[4], x[5], rise)


def _upright(walk: SkeletonWalk) -> np.ndarray:
    """The pelvis (frames, 3, 3) → world, turned by a constant so that on average it's upright and faces ahead."""
    ways = progression(walk.nodes[:, _AT["pelvis"]], walk.pelvis, walk.fps)
    u, _, vt = np.linalg.svd(np.einsum("tji,tjk->ik", walk.pelvis, ways))
    return walk.pelvis @ u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def _steps(walk: SkeletonWalk) -> _Steps | None:
    """The steps of a capture, by the foremost positions of the ankles (Zeni et al. 2008); None if it shows none."""
    upright = _upright(walk)
    pelvis = walk.nodes[:, _AT["pelvis"]]
    contacts, least = {}, int(2 * _STEP_SECONDS[0] * walk.fps)
    for side in _SIDES:
        ahead = np.einsum("ti,ti->t", walk.nodes[:, _AT[f"{side}_ankle"]] - pelvis, upright[:, :, 0])
        contacts[side] = find_peaks(ahead, distance=max(least, 1), prominence=_AHEAD)[0]
    every = np.sort(np.concatenate(list(contacts.values())))
    seconds = np.diff(every) / walk.fps
    usual_step = (seconds >= _STEP_SECONDS[0]) & (seconds <= _STEP_SECONDS[1])
    if usual_step.sum() < 2:
        return None
    way = np.linalg.norm(np.diff(pelvis[every, :2], axis=0), axis=-1)
    length, usual = way[usual_step].mean(), seconds[usual_step].mean()
    if length / usual < _SLOWEST:
        return None
    walking = every[np.append(usual_step, False) | np.append(False, usual_step)]
    contacts = {side: np.intersect1d(frames, walking) for side, frames in contacts.items()}
    frames = round(usual * walk.fps)
    known = np.concatenate([[every[0] - frames], every, [every[-1] + frames]])
    phase = np.interp(np.arange(len(pelvis)), known, np.arange(len(known)))
    counted = np.concatenate([usual_step[:1], usual_step, usual_step[-1:]])
    whole = np.minimum(phase.astype(int), len(counted) - 1)
    inside = counted[whole] & (phase > 0) & (phase < len(counted))
    weight = uniform_filter1d(inside.astype(np.float64), frames, mode="nearest")
    return _Steps(upright, phase, weight, contacts, length / usual, length)


def _raised(nodes: np.ndarray, steps: _Steps, rise: float) -> np.ndarray:
    """The nodes with everything above the knees raised and lowered over each step by up to `rise` [m]."""
    raised = nodes.copy()
    raised[:, _ABOVE, 2] += (rise * steps.weight * np.cos(2 * np.pi * (steps.phase - _SUMMIT)))[:, None]
    return raised


def _missing_rise(walk: SkeletonWalk, steps: _Steps) -> float:
    """The amplitude [m] with which the pelvis rises over a step as an inverted pendulum (rule 3)."""
    leg = float(np.mean(walk.nodes[:, _AT["pelvis"], 2]))
    half = steps.length / (2 * _PENDULUM)
    wanted = leg - np.sqrt(max(leg**2 - half**2, 0.0))
    tried = np.linspace(0.0, _HIGHEST, 41)
    rises = [_rise(_raised(walk.nodes, steps, amplitude)[:, _AT["pelvis"], 2], steps) for amplitude in tried]
    return float(tried[np.argmin(np.abs(np.array(rises) - wanted))])


def _rise(height: np.ndarray, steps: _Steps) -> float:
    """Mean range of a height [m] over steps."""
    whole = np.where(steps.weight == 1, np.floor(steps.phase), -1)
    return float(np.mean([np.ptp(height[whole == i]) for i in np.unique(whole)[1:]]))


@dataclass(frozen=True, eq=False)
class _Leg:
    """One leg of a walk, with the `ankle` (frames, 3) from the hip in the upright pelvis, and the `shank`'s length [m].

    `spans` are the frames in which the knee must reach an angle, by the part of the stride.
    """

    ankle: np.ndarray
    shank: float
    spans: dict[str, list[slice]]


def _legs(nodes: np.ndarray, steps: _Steps) -> list[_Leg]:
    legs = []
    for side in _SIDES:
        hip, knee, ankle = (nodes[:, _AT[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        reach = np.einsum("tji,tj->ti", steps.upright, ankle - hip)
        shank = float(np.median(np.linalg.norm(ankle - knee, axis=-1)))
        legs.append(_Leg(reach, shank, _spans(steps.contacts[side], len(nodes))))
    return legs


def _spans(contacts: np.ndarray, frames: int) -> dict[str, list[slice]]:
    """Parts of each stride from foremost ankle to foremost ankle, cut where the capture ends."""
    stride = float(np.median(np.diff(contacts))) if len(contacts) > 1 else 0.0
    cut: dict[str, list[slice]] = {name: [] for name in _KNEE}
    for contact in contacts if stride else ():
        for name, (*_, (first, last), _) in _KNEE.items():
            start, stop = round(contact + first * stride), round(contact + last * stride)
            if start >= 0 and stop <= frames:
                cut[name].append(slice(start, stop))
    return cut


def _knee_flexion(leg: _Leg, shift: np.ndarray, thigh: float, shank: float) -> dict[str, float]:
    """Extreme knee flexion [degrees] in each part of the stride, mean over strides, with these lengths and shift."""
    distance = np.linalg.norm(leg.ankle - [shift[0], 0.0, shift[1]], axis=-1)
    bent = _flexion((distance**2 - thigh**2 - shank**2) / (2 * thigh * shank))
    extremes = {name: [_KNEE[name][-1](bent[span]) for span in spans] for name, spans in leg.spans.items()}
    return {name: float(np.mean(values)) if values else _KNEE[name][0] for name, values in extremes.items()}


def _flexion(cosine: np.ndarray) -> np.ndarray:
    """Flexion [degrees] of a knee with this cosine, continued below 0 for legs longer than thigh and shank."""
    near = np.cos(np.radians(1.0))  # from here linearly, with the slope of the arc cosine there
    inside = np.degrees(np.arccos(np.clip(cosine, -1.0, near)))
    return inside - np.degrees(np.maximum(cosine - near, 0.0) / np.sin(np.radians(1.0)))


def _knee_axis(walk: SkeletonWalk, side: str) -> np.ndarray:
    """The knee's axis to the left (frames, 3): the normal of the leg's plane when flexed, fixed in the shank."""
    hip, knee, ankle = (walk.nodes[:, _AT[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
    across = np.cross(knee - hip, ankle - knee)
    lengths = np.linalg.norm(ankle - knee, axis=-1) * np.linalg.norm(knee - hip, axis=-1)
    flexed = np.linalg.norm(across, axis=-1) > np.sin(_FLEXED) * lengths
    frames = flexed if flexed.any() else np.ones(len(across), dtype=bool)
    local = np.einsum("tji,tj->i", walk.shanks[side][frames], across[frames])
    return walk.shanks[side] @ (local / np.linalg.norm(local))


def _bent(hip: np.ndarray, ankle: np.ndarray, axis: np.ndarray, thigh: float, shank: float) -> np.ndarray:
    """The knee (frames, 3) between hip and ankle, ahead of the leg in the plane perpendicular to the knee's axis."""
    leg = ankle - hip
    distance = np.linalg.norm(leg, axis=-1, keepdims=True)
    along = leg / distance
    ahead = np.cross(along, axis)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    cosine = np.clip((thigh**2 + distance**2 - shank**2) / (2 * thigh * distance), -1.0, 1.0)
    return hip + thigh * (cosine * along + np.sqrt(1 - cosine**2) * ahead)
