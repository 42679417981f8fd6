"""Whether a capture can be of a person: what a glance at it would catch, and what a misreading of the file explains.

Judged by the body alone: a pelvis above feet, limbs of steady length that are equal left and right, a person's size and
speed, knees and feet that point forwards, markers that neither stick nor change places, and a body that isn't flat.
The limits lie beyond what people of the public captures show; `motionenv bench mocap.plausibility` measures both.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from motionenv._core.representation import counted
from motionenv._core.runs import runs
from motionenv.body.kinematics import forward
from motionenv.body.skeleton import NODES
from motionenv.errors import MotionError
from motionenv.mocap.clinical.gait_model import middle
from motionenv.mocap.clinical.sagittal import is_flat
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks
from motionenv.mocap.retargeting import find_nodes
from motionenv.types import Markers, Motion

_UPRIGHT = 0.5  # least cosine between the vertical and the line from feet to pelvis, the median over frames
_ALONG = 0.85  # least cosine between that line and another axis, for this to be the vertical one
_LEGS = (0.22, 1.4)  # [m] length of legs, from toddlers to the tallest people
_FASTEST = 12.5  # [m/s] a sprinter's top speed
_VARIES = 0.4  # most spread of a limb's length over its median: markerless capture comes to 0.3
_UNEQUAL = 0.25  # most difference between the limbs of both sides over their mean
_PROPORTION = (0.55, 1.8)  # thigh over shank
_BACKWARDS = np.radians(25.0)  # flexion [rad] that a knee reaches backwards, and doesn't reach forwards
_CROSSED = -0.05  # [m] by which the left knee is to the left of the right one, the median over frames
_FOOT = -0.3  # least cosine between a foot and where the pelvis faces, the median over frames
_ORDERED = (("toe", "ankle", "heel"), ("hip", "thigh", "knee"), ("knee", "shank", "ankle"))  # the third is farthest
_TOGETHER = (("heel", "toe"), ("heel", "ankle"), ("thigh", "knee"), ("shank", "ankle"))  # of one limb
_NOWHERE = np.full((1, 3), np.nan)
_SPREAD = 0.15  # [m] by which the distance of such two, which are on one limb, varies at most
_REPEATS = 4  # repeated samples that make a marker suspicious
_OFF = 0.015  # [m] a marker that leaves the distances to its nearest companion by as much does not move with it
_ROUNDED = 3.0  # times the least step of a file's numbers by which rounding changes a distance
_JUMP, _MATCH = 0.06, 0.35  # [m] least jump of markers that change places; most error of the exchanged places over it
_SPIKE, _SWIFT = 0.1, 400.0  # [m] and [m/s²] jump of a marker beyond how the fastest limbs speed up
_MOVES, _AROUND = 0.003, 9  # [m] a frame of a body that moves; frames around in which it does
_MOST = 3  # markers that a message names

_PELVIS = ("hip", "asis", "psis", "trochanter", "iliac_crest", "sacrum", "pelvis")
_FEET = ("ankle", "ankle_lateral", "ankle_medial", "heel", "toe", "metatarsal_1", "metatarsal_5")
_TOP = ("shoulder", "acromion", "c7", "clavicle", "neck", "head")
_LIMBS = {
    "thigh": ("hip", "knee"), "shank": ("knee", "ankle"),
    "upper arm": ("shoulder", "elbow"), "forearm": ("elbow", "wrist"),
}  # fmt: skip


def find_doubts(capture: Markers | Motion, marker_map: MarkerMap | str | None = None) -> tuple[str, ...]:
    """What in a capture isn't plausible for a person, each a clause for a reader; empty if nothing is.

    Args:
        capture: markers (frames, points, 3), or a motion (frames, 25).
        marker_map: which points are which landmarks; None recognises the marker set.

    A capture that shows no leg, of which nothing can be said, raises no doubt.
    """
    if isinstance(capture, Motion):
        if capture.poses.ndim != 2:
            return ()
        nodes = forward(capture.poses, capture.skeleton)[0]
        return tuple(_of_nodes(nodes, capture.fps, {}))
    try:
        at = find_landmarks(capture, marker_map).positions
        nodes = find_nodes(capture, marker_map=marker_map).positions
    except MotionError:
        return ()
    if is_flat(capture.positions):
        rest = (*_of_legs(_legs(at)), *_of_limbs(nodes), *_repeated(capture))
        return ("all points lie in one plane, so only angles seen from the side are known", *rest)
    whole = (*_of_nodes(nodes, capture.fps, at), *_of_feet(nodes, at))
    return (*whole, *_exchanges(capture), *_repeated(capture))


def check_plausible(capture: Markers | Motion, marker_map: MarkerMap | str | None = None) -> None:
    """Raise a `MotionError` that tells the first doubt about a `capture`; takes a `marker_map` as `find_doubts`."""
    if doubts := find_doubts(capture, marker_map):
        raise MotionError(f"not plausible: {doubts[0]}")


def mended(markers: Markers, again: Callable[..., Markers], free: Collection[str]) -> Markers:
    """Markers of a file, read `again` with the unit and vertical axis that alone make a person of them.

    Args:
        markers: (frames, points, 3) as first read.
        again: reads the file with other options, "unit" or "up".
        free: which of these options the caller left open and the format has.

    Returns:
        The markers, whose notes say what was changed. Samples at which a marker sticks in space are gaps.
    """
    options: dict[str, str] = {}
    legs, notes = _recognised_legs(markers), []
    if legs is not None and "unit" in free and (unit := _other_unit(legs, again)):
        options["unit"] = unit
        long = _length(legs)
        notes.append(f"in the unit that is stated legs would be {long:.3g} m long: read in {unit} (unit= or --unit)")
    if legs is not None and "up" in free and not _is_upright(legs):
        up = _vertical(_recognised_legs(again(up="z")))
        if up is not None:
            options["up"] = up
            notes.append(f"the body stands along {up}, not along the usual vertical axis: read so (up= or --up)")
    markers = again(**options) if options else markers
    return _unstuck(replace(markers, notes=(*markers.notes, *notes)))


def _recognised_legs(markers: Markers) -> np.ndarray | None:
    try:
        return _legs(find_landmarks(markers).positions)
    except MotionError:
        return None


def _legs(at: dict[str, np.ndarray]) -> np.ndarray | None:
    """Lines (frames, 3) from the feet to the pelvis, where both are seen; None if they never are."""
    pelvis, feet = _middle(at, _PELVIS), _middle(at, _FEET)
    if pelvis is None or feet is None:
        return None
    lines = pelvis - feet
    lines = lines[np.isfinite(lines).all(-1)]
    return lines if len(lines) else None


def _middle(at: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray | None:
    """The middle (frames, 3) of those of the landmarks that are seen; None if the capture has none of them."""
    points = [at[name] for name in at if name.removeprefix("left_").removeprefix("right_") in names]
    if not points:
        return None
    known = np.isfinite(points).all(-1, keepdims=True)
    count = known.sum(0)
    return np.where(count > 0, np.where(known, points, 0.0).sum(0) / np.maximum(count, 1), np.nan)


def _length(legs: np.ndarray) -> float:
    return float(np.percentile(np.linalg.norm(legs, axis=-1), 90))


def _direction(legs: np.ndarray) -> np.ndarray:
    """Components (3,) of the legs' direction, the medians over frames."""
    return np.median(legs / np.maximum(np.linalg.norm(legs, axis=-1, keepdims=True), 1e-12), axis=0)


def _is_upright(legs: np.ndarray) -> bool:
    return bool(_direction(legs)[2] >= _UPRIGHT)


def _other_unit(legs: np.ndarray, again: Callable[..., Markers]) -> str | None:
    """The only one of mm, cm, m and inch in which legs of impossible length are a person's; None if there isn't one."""
    if _has_size(legs):
        return None
    read = {unit: _recognised_legs(again(unit=unit)) for unit in ("mm", "cm", "m", "inch")}
    fits = [unit for unit, found in read.items() if found is not None and _has_size(found)]
    return fits[0] if len(fits) == 1 else None


def _has_size(legs: np.ndarray) -> bool:
    return _LEGS[0] <= _length(legs) <= _LEGS[1]


def _vertical(legs: np.ndarray | None) -> str | None:
    """The file's axis along which people stand, such as "y" or "-z"; None where it isn't clear."""
    if legs is None:
        return None
    direction = _direction(legs)
    axis = int(np.abs(direction).argmax())
    return None if abs(direction[axis]) < _ALONG else ("-" if direction[axis] < 0 else "") + "xyz"[axis]


def _of_nodes(nodes: np.ndarray, fps: float, landmarks: dict[str, np.ndarray]) -> Iterator[str]:
    """Doubts about the body's nodes (frames, 16, 3) [m] of a capture in space, whose `landmarks` may show more."""
    at = {name: nodes[:, i] for i, name in enumerate(NODES)}
    yield from _of_legs(_legs(landmarks | at))
    yield from _of_limbs(nodes)
    yield from _of_trunk(at)
    yield from _of_knees(at)
    steps = np.linalg.norm(np.diff(at["pelvis"], axis=0), axis=-1) * fps
    speed = middle(steps)
    if speed > _FASTEST:
        yield f"the pelvis moves at {speed:.3g} m/s, faster than anybody runs: check unit= (--unit) and fps= (--fps)"


def _of_legs(legs: np.ndarray | None) -> Iterator[str]:
    if legs is None:
        return
    if not _has_size(legs):
        yield f"legs of {_length(legs):.3g} m are not a person's: check unit= (--unit)"
    if not _is_upright(legs):
        yield "the pelvis is not above the feet: check the vertical axis, up= (--up)"


def _of_limbs(nodes: np.ndarray) -> Iterator[str]:
    """Limbs whose length changes over time, differs between the sides, or doesn't go with the other's."""
    middle = {}
    for limb, (start, end) in _LIMBS.items():
        for side in ("left", "right"):
            ends = nodes[:, NODES.index(f"{side}_{start}")] - nodes[:, NODES.index(f"{side}_{end}")]
            lengths = np.linalg.norm(ends[np.isfinite(ends).all(-1)], axis=-1)
            if not len(lengths):
                continue
            low, middle[side, limb], high = np.percentile(lengths, [5, 50, 95])
            if high - low > _VARIES * middle[side, limb]:
                yield f"the {side} {limb} is between {low:.2f} and {high:.2f} m long, as if its points were of two"
        left, right = middle.get(("left", limb), np.nan), middle.get(("right", limb), np.nan)
        if abs(left - right) > _UNEQUAL * 0.5 * (left + right):
            yield f"the left {limb} is {left:.2f} m long and the right one {right:.2f} m"
    for side in ("left", "right"):
        thigh, shank = middle.get((side, "thigh"), np.nan), middle.get((side, "shank"), np.nan)
        if thigh < _PROPORTION[0] * shank or thigh > _PROPORTION[1] * shank:
            yield f"the {side} thigh is {thigh:.2f} m long and its shank {shank:.2f} m, as if points were mistaken"


def _of_trunk(at: dict[str, np.ndarray]) -> Iterator[str]:
    top, pelvis = _middle(at, _TOP), _middle(at, _PELVIS)
    if top is not None and pelvis is not None:
        trunk = top - pelvis
        rise = middle(trunk[:, 2] / np.maximum(np.linalg.norm(trunk, axis=-1), 1e-12))
        if rise < -_UPRIGHT:
            yield "the shoulders are below the pelvis"


def _of_knees(at: dict[str, np.ndarray]) -> Iterator[str]:
    """Knees on each other's side, and those that bend backwards about the axis from the right hip to the left one."""
    across = at["left_hip"] - at["right_hip"]
    width = np.maximum(np.linalg.norm(across, axis=-1), 1e-12)
    if middle(((at["left_knee"] - at["right_knee"]) * across).sum(-1) / width) < _CROSSED:
        yield "the left knee is on the right of the right one, as if the legs' sides were exchanged"
    bend = []
    for side in ("left", "right"):
        thigh, shank = at[f"{side}_knee"] - at[f"{side}_hip"], at[f"{side}_ankle"] - at[f"{side}_knee"]
        turn = (np.cross(thigh, shank) * across).sum(-1) / width
        bend.append(np.arctan2(turn, (thigh * shank).sum(-1)))
    flexion = np.concatenate(bend)
    flexion = flexion[np.isfinite(flexion)]
    if len(flexion):
        least, most = np.percentile(flexion, [5, 95])
        if least < -_BACKWARDS and most < -least:
            yield "the knees bend backwards, as if left and right were exchanged or an axis mirrored"


def _of_feet(nodes: np.ndarray, at: dict[str, np.ndarray]) -> Iterator[str]:
    """Feet that point backwards, or other markers of a leg that are exchanged with each other or the other leg's."""
    across = nodes[:, NODES.index("left_hip")] - nodes[:, NODES.index("right_hip")]
    ahead = np.cross(across, [0.0, 0.0, 1.0])
    for side in ("left", "right"):
        if {f"{side}_heel", f"{side}_toe"} <= at.keys():
            foot = at[f"{side}_toe"] - at[f"{side}_heel"]
            size = np.linalg.norm(foot, axis=-1) * np.linalg.norm(ahead, axis=-1)
            if middle((foot * ahead).sum(-1) / np.maximum(size, 1e-12)) < _FOOT:
                yield f"the {side} foot points backwards, as if heel and toe were exchanged"
        own = {k.partition("_")[2].removesuffix("_lateral"): at[k] for k in at if side in k and "ankle" != k[-5:]}
        own["hip"] = nodes[:, NODES.index(f"{side}_hip")]
        apart = lambda one, other, own=own: np.linalg.norm(own.get(one, _NOWHERE) - own.get(other, _NOWHERE), axis=-1)
        for start, near, far in _ORDERED:
            if middle(apart(start, far) - apart(start, near)) < 0:
                yield f"the {side} {far} is nearer to the {start} than the {near} is, as if the two were exchanged"
        for one, other in _TOGETHER:
            known = apart(one, other)[np.isfinite(apart(one, other))]
            if len(known) and np.ptp(ends := np.percentile(known, [5, 95])) > _SPREAD:
                yield f"the {side} {one} and {other} are {ends[0]:.2f} to {ends[1]:.2f} m apart, as if of two limbs"


def _exchanges(markers: Markers) -> Iterator[str]:
    """Markers that exchange their places from one frame to the next, or jump elsewhere."""
    points = markers.positions
    if len(points) < 3 or markers.parents is not None:  # the joints of a hierarchy can't
        return
    expected = 2 * points[1:-1] - points[:-2]
    jumps = np.linalg.norm(points[2:] - expected, axis=-1)
    found: dict[tuple[str, str], float] = {}
    for t in np.flatnonzero((jumps > _JUMP).sum(-1) > 1):
        moved = np.flatnonzero(jumps[t] > _JUMP)
        off = np.linalg.norm(points[t + 2, moved][:, None] - expected[t, moved], axis=-1)
        exchanged = np.maximum(off, off.T) < _MATCH * np.minimum.outer(jumps[t, moved], jumps[t, moved])
        for i, j in moved[np.argwhere(np.triu(exchanged, 1))]:
            found.setdefault((markers.names[i], markers.names[j]), (t + 2) / markers.fps)
    for (one, other), seconds in list(found.items())[:_MOST]:
        yield f"{one} and {other} exchange places at {seconds:.2f} s"
    if len(found) > _MOST:
        yield f"{counted(len(found) - _MOST, 'other pair')} of markers exchange places too"
    known = {name for pair in found for name in pair}
    far = (jumps > _SPIKE + _SWIFT / markers.fps**2) & np.array([name not in known for name in markers.names])
    for n, t in [(n, far[:, n].argmax()) for n in np.flatnonzero(far.any(0))[:_MOST]]:
        yield f"{markers.names[n]} jumps by {jumps[t, n]:.2f} m at {(t + 2) / markers.fps:.2f} s"


def _repeated(markers: Markers) -> Iterator[str]:
    """Frames that repeat the one before while the body moves, as where they were doubled to reach a frame rate."""
    steps = np.linalg.norm(np.diff(markers.positions, axis=0), axis=-1)
    same = np.isfinite(steps).any(1) & ~(steps > 0).any(1)
    moves = maximum_filter1d((steps > _MOVES).mean(1), _AROUND) > 0.25
    if (many := int((same & moves).sum())) >= _MOST:
        often = f"{many} of {len(steps) + 1} frames repeat the one before"
        yield f"{often} while the body moves: check the frame rate, fps= (--fps)"


def _unstuck(markers: Markers) -> Markers:
    """The markers, with gaps where one repeats its place to the last digit while its nearest companion moves on.

    The companion is the marker whose distance varies least, as of the same limb. A marker on a foot that stands still
    repeats its place too, but keeps its distance.
    """
    points = markers.positions
    if markers.parents is not None or len(points) <= _REPEATS:
        return markers
    held = _held(points)
    stopped = _stopped(points, held)
    notes = [f"no point moves at {a / markers.fps:.2f} to {(b - 1) / markers.fps:.2f} s, then all jump: gaps there"
             for a, b in runs(stopped)]  # fmt: skip
    held &= ~stopped[:, None]
    stuck = np.zeros_like(held)
    steps = np.abs(np.diff(points, axis=0))
    off = max(_OFF, _ROUNDED * float(np.min(steps, initial=_OFF, where=steps > 0)))
    for n in np.flatnonzero(held.any(0)).tolist():
        for start, end in runs(held[:, n]):
            stuck[start:end, n] = _leaves(points, held, n, slice(start, end), off)
    told = []
    for n in np.flatnonzero(stuck.any(0)).tolist():
        spans = [f"{a / markers.fps:.2f} to {(b - 1) / markers.fps:.2f}" for a, b in runs(stuck[:, n])]
        told.append(f"{markers.names[n]} ({', '.join(spans[:_MOST])}{', ...' if len(spans) > _MOST else ''} s)")
    more = f" and {counted(len(told) - _MOST, 'other marker')}" if len(told) > _MOST else ""
    if told:
        notes.append(f"{', '.join(told[:_MOST])}{more} stuck in space while the body moved on: gaps there")
    gaps = (stuck | stopped[:, None])[..., None]
    return (
        replace(markers, positions=np.where(gaps, np.nan, points), notes=(*markers.notes, *notes)) if notes else markers
    )


def _stopped(points: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Frames (frames,) in which the recording stood still, all points having repeated their place before they jump."""
    seen = np.isfinite(points).all(-1)
    stopped = np.zeros(len(points), dtype=bool)
    for start, end in runs((held | ~seen).all(1) & seen.any(1)):
        if end < len(points) and np.nanmedian(np.linalg.norm(points[end] - points[end - 1], axis=-1)) > _JUMP:
            stopped[start + 1 : end] = True
    return stopped


def _held(points: np.ndarray) -> np.ndarray:
    """Samples (frames, points) of runs in which a point repeats its place at least `_REPEATS` times."""
    same = (points[1:] == points[:-1]).all(-1)
    held = np.zeros(points.shape[:2], dtype=bool)
    for n in np.flatnonzero(same.any(0)):
        for start, end in runs(same[:, n]):
            held[start : end + 1, n] |= end - start >= _REPEATS
    return held


def _leaves(points: np.ndarray, held: np.ndarray, n: int, run: slice, off: float) -> bool:
    """Whether point `n` leaves by `off` [m], during the `run`, the distances that it else has to its companion."""
    free = ~held[:, n]
    others = np.flatnonzero(~held[run].any(0) & np.isfinite(points[run]).all((0, 2)))
    distances = np.linalg.norm(points[:, others] - points[:, n, None], axis=-1)
    useful = np.isfinite(distances[free]).sum(0) > len(points) // 4
    if not useful.any():  # it sticks nearly all along, alone as no thing's, and far from all that moves
        return bool(len(others) and held[run].all(0).sum() == 1 and np.ptp(distances[run], axis=0).min() > _SPREAD)
    distances = distances[:, useful]
    spread = np.nanstd(distances[free], axis=0)
    usual = distances[:, spread.argmin()]
    away = np.maximum(usual[run] - np.nanmax(usual[free]), np.nanmin(usual[free]) - usual[run])
    return bool(away.max() > off)
