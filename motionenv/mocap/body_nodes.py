"""The body's nodes, from the landmarks of a capture: joint centres of legs, arms, neck and head.

Legs by the Conventional Gait Model (`motionenv.mocap.clinical.lower_body`). Arms and head by the usual offsets, as
files rarely state the widths of shoulders and elbows.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.body.skeleton import NODES
from motionenv.errors import GapError
from motionenv.mocap.clinical import Calibration, LowerBody, Measurements, lower_body
from motionenv.mocap.clinical.gait_model import NEUTRAL_TILT, unit
from motionenv.mocap.marker_sets import Landmarks

# Distance from marker to joint centre: half the joint's width plus the marker's radius [m], typical of adults.
_SHOULDER, _ELBOW = 0.047, 0.045
_HEAD = ("left_head_front", "left_head_back", "right_head_front", "right_head_back")


@dataclass(frozen=True, eq=False)
class Nodes:
    """The body's nodes over time; `trunk` is that of an upright trunk over the captured pelvis."""

    positions: np.ndarray  # (frames, 16, 3) [m] in the order of `motionenv.body.NODES`; NaN where unknown
    head_side: np.ndarray | None  # (frames, 3) direction to the left of the head in the world; None if unknown
    trunk: np.ndarray | None  # (frames, 3, 3) rotation trunk → world; None without pelvis
    how: dict[str, str]  # how the joint centres of the legs were found, by joint
    notes: tuple[str, ...] = ()  # of the landmarks


def body_nodes(landmarks: Landmarks, person: Measurements, calibration: Calibration | None = None) -> Nodes:
    """The nodes of the body that the landmarks of a capture determine, with measurements that are NaN where unknown.

    Raises:
        GapError: not even one thigh is known; names what is missing.
    """
    at = landmarks.positions
    legs = lower_body(at, person, calibration)
    found = {**_legs(at, legs), **_trunk(at)}
    found.update(_arms(at, found))
    if not any({f"{side}_hip", f"{side}_knee"} <= found.keys() for side in ("left", "right")):
        raise GapError(_lacking(landmarks, legs))
    frames = len(next(iter(at.values())))
    positions = np.full((frames, len(NODES), 3), np.nan)
    for name, values in found.items():
        positions[:, NODES.index(name)] = values
    upright = None
    if legs.pelvis is not None:
        c, s = np.cos(NEUTRAL_TILT), np.sin(NEUTRAL_TILT)
        upright = legs.pelvis.rotation @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return Nodes(positions, _head_side(at), upright, legs.how, landmarks.notes)


def _legs(at: dict[str, np.ndarray], legs: LowerBody) -> dict[str, np.ndarray]:
    found = {
        f"{side}_{joint}": centre
        for side, leg in (("left", legs.left), ("right", legs.right))
        for joint, centre in (("hip", leg.hip), ("knee", leg.knee), ("ankle", leg.ankle))
        if centre is not None
    }
    if "pelvis" in at:
        found["pelvis"] = at["pelvis"]
    elif {"left_hip", "right_hip"} <= found.keys():
        found["pelvis"] = 0.5 * (found["left_hip"] + found["right_hip"])
    return found


def _trunk(at: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {name: at[name] for name in ("neck", "sternum", "head") if name in at}
    if "neck" not in found and {"clavicle", "c7"} <= at.keys():
        found["neck"] = 0.5 * (at["clavicle"] + at["c7"])
    around = ("clavicle", "xiphoid", "c7", "t10")
    if "sternum" not in found and set(around) <= at.keys():
        found["sternum"] = np.mean([at[name] for name in around], axis=0)
    # Opposite markers of the headband lie on a line through the centre of the head.
    pairs = [(_HEAD[0], _HEAD[3]), (_HEAD[1], _HEAD[2])]
    across = [0.5 * (at[a] + at[b]) for a, b in pairs if a in at and b in at]
    if "head" not in found and across:
        found["head"] = np.mean(across, axis=0)
    return found


def _arms(at: dict[str, np.ndarray], found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Shoulders down from the acromion along the trunk, elbows and wrists."""
    arms = {}
    top = found.get("neck", at.get("c7"))
    if top is None and {"left_acromion", "right_acromion"} <= at.keys():
        top = 0.5 * (at["left_acromion"] + at["right_acromion"])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        if f"{side}_shoulder" in at:
            arms[f"{side}_shoulder"] = at[f"{side}_shoulder"]
        elif f"{side}_acromion" in at and top is not None and "pelvis" in found:
            arms[f"{side}_shoulder"] = at[f"{side}_acromion"] - _SHOULDER * unit(top - found["pelvis"])
        wrist = _wrist(at, side)
        if wrist is not None:
            arms[f"{side}_wrist"] = wrist
        elbow = _elbow(at, arms.get(f"{side}_shoulder"), wrist, side, sign)
        if elbow is not None:
            arms[f"{side}_elbow"] = elbow
    return arms


def _wrist(at: dict[str, np.ndarray], side: str) -> np.ndarray | None:
    """Centre of the wrist: midway between its two markers, or its one marker."""
    pair = [at[name] for name in (f"{side}_wrist_radial", f"{side}_wrist_ulnar") if name in at]
    if f"{side}_wrist" in at:
        return at[f"{side}_wrist"]
    return np.mean(pair, axis=0) if pair else None


def _elbow(at: dict[str, np.ndarray], shoulder, wrist, side: str, sign: float) -> np.ndarray | None:
    """Centre of the elbow: midway between its markers, or beside the lateral one, perpendicular to the arm's plane."""
    lateral, medial = at.get(f"{side}_elbow_lateral"), at.get(f"{side}_elbow_medial")
    if f"{side}_elbow" in at:
        return at[f"{side}_elbow"]
    if lateral is None:
        return None
    if medial is not None:
        return 0.5 * (lateral + medial)
    if shoulder is None or wrist is None:
        return None
    return lateral + sign * _ELBOW * unit(np.cross(lateral - shoulder, wrist - lateral))


def _head_side(at: dict[str, np.ndarray]) -> np.ndarray | None:
    """Direction to the left of the head, from the pairs of head markers that are there."""
    pairs = [(f"left_head_{end}", f"right_head_{end}") for end in ("front", "back")]
    across = [at[left] - at[right] for left, right in pairs if left in at and right in at]
    return np.sum(across, axis=0) if across else None


def _lacking(landmarks: Landmarks, legs: LowerBody) -> str:
    """Error text: the landmarks of the nearest marker set that a capture lacks, and what to do."""
    wanted = ["left_hip", "right_hip"] if legs.left.hip is None and legs.right.hip is None else []
    if wanted and "left_asis" in landmarks.marker_map.points:
        wanted = ["left_asis", "right_asis", "sacrum"]
    if wanted and "pelvis_cluster_1" in landmarks.marker_map.points and "left_asis" not in landmarks.points:
        wanted = _markers("pelvis")
    for side in ("left", "right"):
        wanted += _of_knee(landmarks, side)
    missing = [name for name in wanted if name not in landmarks.points]
    if not landmarks.points:
        problem = "none of its points has a name that a marker set knows"
    else:
        known, needs = landmarks.marker_set, ", ".join(f"{name} ({_written(landmarks, name)})" for name in missing)
        have = f"{len(landmarks.points)} of its {len(landmarks.marker_map.points)} landmarks are in the file"
        problem = f"the nearest marker set is {known!r}: {have}, but not {needs}"
    return (
        f"no leg with hip and knee: {problem}. If these points have other names, write a marker map with "
        "`motionenv mocap map FILE --out map.toml`, edit it, and pass it with --map (marker_map=)"
    )


def _of_knee(landmarks: Landmarks, side: str) -> list[str]:
    """The landmarks from which a marker set tells where a knee is."""
    known = landmarks.marker_map.points
    if f"{side}_knee_lateral" in known:
        return [f"{side}_knee_lateral"]
    if f"{side}_shank_cluster_1" in known:
        return _markers(f"{side}_thigh") + _markers(f"{side}_shank")
    return [f"{side}_knee"]


def _markers(limb: str) -> list[str]:
    return [f"{limb}_cluster_{i}" for i in (1, 2, 3)]


def _written(landmarks: Landmarks, name: str) -> str:
    """The name of the point, or of the first of several, by which the set knows a landmark."""
    ways = landmarks.marker_map.points.get(name)
    return " + ".join(ways[0]) if ways else "not in this set"
