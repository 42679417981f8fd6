"""Pelvis, thighs, shanks and feet over time, from the landmarks of a capture.

What is there decides how a joint's centre is found: a centre that the file itself holds; midway between lateral and
medial marker; the chord function with the wand; and without a wand, the chord function in the plane of the pelvis'
lateral axis. Legs without markers on the joints, but with rigid clusters, get functional centres (`functional_legs`).
"""

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.mocap.clinical.clusters import carried
from motionenv.mocap.clinical.functional import functional_legs
from motionenv.mocap.clinical.gait_model import (
    SIGN,
    Segment,
    angle_about,
    chord,
    davis_hip,
    frame,
    harrington_hip,
    middle,
    offset_turn,
    pelvis,
    unit,
)
from motionenv.mocap.clinical.measurements import Measurements, Side, completed

#: Mean varus of the knee [rad] beyond which the thigh's wand is probably not in the plane of the knee's axis: legs
#: aren't that bowed.
_MOST_VARUS = np.radians(20.0)
#: So does a varus that varies by more than this share of the flexion, and by more than an angle [rad]: captures with
#: good wands come to 0.3, others to 0.45 to 1.7.
_CROSS_TALK, _STEADY_VARUS = 0.4, np.radians(15.0)
#: Mean turn [rad] of the ankle's axis from the knee's beyond which the shank's is probably not: shins have up to 45°.
_MOST_TORSION = np.radians(50.0)
#: What to do with the markers on thighs and shanks.
WANDS = ("auto", "use", "ignore")


@dataclass(frozen=True, eq=False, repr=False)
class Leg(OneLine):
    """One leg over time: centres (frames, 3) [m] and rotations (frames, 3, 3), segment → world; None where unknown.

    Attributes:
        hip, knee, ankle: centres of the joints.
        thigh, shank, foot: rotations; z points from knee to hip, from ankle to knee, and from toe to heel.
        knee_axis, ankle_axis: whether markers show the joint's axis; if not, the y of thigh or shank is borrowed from
            the segment above, and rotations about its length mean nothing.
        torsion: of the tibia [rad] about z, by which the shank, whose y is the ankle's axis, is turned from the knee's.
    """

    hip: np.ndarray | None = None
    knee: np.ndarray | None = None
    ankle: np.ndarray | None = None
    thigh: np.ndarray | None = None
    shank: np.ndarray | None = None
    foot: np.ndarray | None = None
    knee_axis: bool = False
    ankle_axis: bool = False
    torsion: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class LowerBody(OneLine):
    """The lower body over time; `how` tells for each kind of joint how its centre was found.

    The `pelvis` is None without ASIS or sacrum; `left` and `right` are the legs. `how["wands of the thighs"]`
    and "... shanks" tell what is wrong with wands.
    """

    pelvis: Segment | None
    left: Leg
    right: Leg
    how: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Calibration(OneLine):
    """Results of a standing trial, by "left_knee" and the like; see `calibrate`.

    Attributes:
        turns: angle [rad] between the wand's plane and the joint's axis.
        distances: from the lateral marker to the joint's centre [m].
        standing: (3,) [m] median place of each landmark, which clusters carry to the walk.
        feet: by side, the static offsets (plantar flexion, rotation) of the foot [rad].
    """

    turns: dict[str, float] = field(default_factory=dict)
    distances: dict[str, float] = field(default_factory=dict)
    feet: dict[str, tuple[float, float]] = field(default_factory=dict)
    standing: dict[str, np.ndarray] = field(default_factory=dict)


def lower_body(
    positions: dict[str, np.ndarray], person: Measurements, calibration: Calibration | None = None, *,
    wands: str = "auto",
) -> LowerBody:  # fmt: skip
    """Segments and joint centres of the lower body by the Conventional Gait Model, from landmarks (frames, 3) [m].

    What measurements of the `person` lack is estimated. A `calibration` from a standing trial serves those that had
    medial markers then. `wands`, one of `WANDS`, says whether the markers on thighs and shanks tell the joints' axes as
    in the published model ("use"), or are ignored. "auto" uses them, unless no measurements of the person are stated
    and the thighs' are far from the plane of the knee's axis, as where a knee alignment device was used. A `GapError`
    if a leg of `positions` has but clusters, and its joints hardly move.
    """
    if wands == "ignore":
        positions = {k: v for k, v in positions.items() if k.partition("_")[2] not in ("thigh", "shank")}
    by_clusters = carried(positions, calibration.standing) if calibration else {}
    positions = positions | by_clusters
    body = _from_landmarks(positions, person, calibration or Calibration(), wands)
    for joint in ("knee", "ankle"):
        if any(joint in name for name in by_clusters):
            body.how[joint] = f"{body.how.get(joint, 'unknown')}, of the standing trial and carried by clusters"
    hips = {side: hip for side in ("left", "right") if (hip := getattr(body, side).hip) is not None}
    found = functional_legs(positions, body.pelvis, hips)
    if not found.landmarks:
        return body
    base = found.pelvis or body.pelvis
    whole = _from_landmarks({**positions, **found.landmarks}, person, calibration or Calibration(), wands, base)
    return replace(whole, how=whole.how | body.how | found.how)


def _from_landmarks(
    positions: dict[str, np.ndarray], known: Measurements, calibration: Calibration, wands: str,
    base: Segment | None = None,
) -> LowerBody:  # fmt: skip
    """`lower_body` without the help of clusters; `base` is the pelvis where landmarks don't tell it."""
    person = completed(known, positions)
    believe = wands == "use" or known.given
    base = base or pelvis(positions)
    how: dict[str, str] = {}
    legs = {}
    for side in ("left", "right"):
        hip = _hip(positions, base, person, known, side, how)
        legs[side] = _leg(positions, base, hip, person, side, calibration, how, believe)
    return LowerBody(base, legs["left"], legs["right"], how)


def calibrate(positions: dict[str, np.ndarray], person: Measurements) -> Calibration:
    """Calibrate a `person`'s joints and feet by a standing trial with landmarks `positions` (frames, 3) [m].

    Medial markers, which are often taken off for walking, give the directions of the axes of knee and ankle relative
    to the wands, and the joints' half widths. The feet, flat on the ground, give the static offsets of the foot.
    """
    body = _from_landmarks(positions, person, Calibration(), "use")
    found = Calibration(standing={name: np.array([middle(v) for v in path.T]) for name, path in positions.items()})
    for side in ("left", "right"):
        leg: Leg = getattr(body, side)
        for joint, above, wand in (("knee", leg.hip, "thigh"), ("ankle", leg.knee, "shank")):
            lateral, medial = (positions.get(f"{side}_{joint}_{face}") for face in ("lateral", "medial"))
            pole = positions.get(f"{side}_{wand}")
            if above is None or lateral is None or medial is None or pole is None:
                continue
            distance = middle(0.5 * np.linalg.norm(lateral - medial, axis=-1))
            flat = chord(above, lateral, pole, distance)
            found.turns[f"{side}_{joint}"] = middle(angle_about(above - lateral, flat - lateral, medial - lateral))
            found.distances[f"{side}_{joint}"] = distance
        offsets = _foot_offsets(positions, leg, side)
        if offsets is not None:
            found.feet[side] = offsets
    return found


def _hip(positions, base, person: Measurements, known: Measurements, side: str, how: dict[str, str]):
    """Centre of the hip: the file's own, by the legs' lengths where measured (Davis), or by the pelvis (Harrington)."""
    if f"{side}_hip" in positions:
        how["hip"] = "the file's own centres"
        return positions[f"{side}_hip"]
    if base is None:
        return None
    width = person.asis_distance
    if not np.isfinite(width):
        width = middle(np.linalg.norm(positions["left_asis"] - positions["right_asis"], axis=-1))
    if np.isfinite(getattr(known, side).leg_length):
        how["hip"] = "Davis et al. (1991) from the measured legs"
        return davis_hip(base, person, side, width)
    how["hip"] = "Harrington et al. (2007) from the pelvis"
    return harrington_hip(base, positions, side, width)


def _leg(
    positions, base, hip, person: Measurements, side: str, calibration: Calibration, how: dict[str, str], believe: bool
) -> Leg:
    own: Side = getattr(person, side)
    sign, radius = SIGN[side], person.marker_radius
    across = None if base is None else sign * base.rotation[..., 1]
    half_widths = {"knee": 0.5 * own.knee_width + radius, "ankle": 0.5 * own.ankle_width + radius}
    find = partial(_joint, positions, side=side, calibration=calibration, how=how, believe=believe)
    knee, knee_side, knee_axis = find("knee", "thigh", hip, across, half_widths["knee"], -sign * own.thigh_rotation)
    ankle, ankle_side, ankle_axis = find(
        "ankle", "shank", knee, knee_side, half_widths["ankle"], -sign * own.shank_rotation
    )
    knee_side = across if knee_side is None else knee_side
    ankle_side = knee_side if ankle_side is None else ankle_side
    thigh, shank = _limb(hip, knee, knee_side, sign), _limb(knee, ankle, ankle_side, sign)
    torsion = -sign * own.tibial_torsion
    leg = Leg(hip, knee, ankle, thigh, shank, knee_axis=knee_axis, ankle_axis=ankle_axis, torsion=torsion)
    return replace(leg, foot=_foot(positions, leg, own, side, calibration.feet.get(side)))


def _limb(above, below, lateral, sign: float) -> np.ndarray | None:
    """Rotation of a limb with z from its lower to its upper joint and y in the plane of `lateral`; None if unknown."""
    if above is None or below is None or lateral is None:
        return None
    return frame(above - below, sign * lateral)


def _joint(
    positions, joint: str, wand: str, above, across, distance: float, offset: float, *, side: str,
    calibration: Calibration, how, believe: bool,
) -> tuple[np.ndarray | None, np.ndarray | None, bool]:  # fmt: skip
    """Centre of a knee or ankle, the direction from it to the lateral side, and whether markers show that direction.

    What is unknown is None.
    """
    key = f"{side}_{joint}"
    lateral, medial, pole = (positions.get(name) for name in (f"{key}_lateral", f"{key}_medial", f"{side}_{wand}"))
    if key in positions:
        how[joint] = "the file's own centres"
        return positions[key], None if lateral is None else lateral - positions[key], lateral is not None
    if lateral is not None and medial is not None:
        how[joint] = "midway between lateral and medial markers"
        return 0.5 * (lateral + medial), lateral - medial, True
    if lateral is None or above is None:
        return None, None, False
    return _by_chord(
        positions, joint, above, across, distance, offset, lateral, pole, side=side, calibration=calibration, how=how,
        believe=believe,
    )  # fmt: skip


def _by_chord(
    positions, joint: str, above, across, distance: float, offset: float, lateral, pole, *, side: str,
    calibration: Calibration, how, believe: bool,
) -> tuple[np.ndarray | None, np.ndarray | None, bool]:  # fmt: skip
    """`_joint` by the chord function, with the wand `pole` if there is one and it can be believed."""
    key = f"{side}_{joint}"
    distance = calibration.distances.get(key, distance)
    if pole is not None:
        known = calibration.turns.get(key)
        turned = ", turned as the standing trial tells" if known else ", turned as the file states" if offset else ""
        turn = offset_turn(above, lateral, pole, distance, offset) if known is None else known
        centre = chord(above, lateral, pole, distance, turn)
        if joint == "knee":
            aligned, wands = _aligned(positions, above, centre, lateral, side), "wands of the thighs"
        else:
            twist = 0.0 if across is None else middle(angle_about(above - lateral, across, lateral - centre))
            aligned, wands = not abs(twist) > _MOST_TORSION, "wands of the shanks"
        if aligned or turned or believe:
            how[joint] = "chord function with wands" + turned
            if not aligned:
                how[wands] = f"used, though they don't seem to lie in the plane of the {joint}'s axis"
            return centre, lateral - centre, True
        how[joint] = "chord function without wands"
        how[wands] = f"left out, as they don't lie in the plane of the {joint}'s axis"
    if across is None:
        return None, None, False
    how.setdefault(joint, "chord function without wands, in the plane of the pelvis' lateral axis")
    centre = chord(above, lateral, lateral + across, distance)
    return centre, lateral - centre, False


def _aligned(positions, hip, knee, lateral, side: str) -> bool:
    """Whether the thigh's wand gives a knee that bends forwards and back: its varus is one that legs have."""
    ankle = positions.get(f"{side}_ankle_lateral")
    if ankle is None:
        return True
    thigh = frame(hip - knee, SIGN[side] * (lateral - knee))
    down = np.einsum("tji,tj->ti", thigh, unit(ankle - lateral))
    varus = np.arctan2(-SIGN[side] * down[:, 1], np.hypot(down[:, 0], down[:, 2]))
    flexion = np.arctan2(-down[:, 0], -down[:, 2])
    known = np.isfinite(varus)
    varies, bends = (np.ptp(np.percentile(a[known], [5, 95])) if known.any() else 0.0 for a in (varus, flexion))
    return not (abs(middle(varus)) > _MOST_VARUS or varies > max(_CROSS_TALK * bends, _STEADY_VARUS))


def _foot(positions, leg: Leg, own: Side, side: str, standing: tuple[float, float] | None) -> np.ndarray | None:
    """Rotation of the foot (frames, 3, 3): of the line from toe to ankle, corrected by the static offsets."""
    raw = _raw_foot(positions, leg, side)
    offsets = (own.plantar_flexion, own.foot_rotation)
    if not np.isfinite(offsets).all():
        offsets = standing or _foot_offsets(positions, leg, side) or (np.nan, np.nan)
    if raw is None or not np.isfinite(offsets).all():
        return None
    plantar, turn = -offsets[0], -SIGN[side] * offsets[1]
    c, s = np.cos(plantar), np.sin(plantar)
    about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    c, s = np.cos(turn), np.sin(turn)
    return raw @ about_y @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _raw_foot(positions, leg: Leg, side: str) -> np.ndarray | None:
    toe = positions.get(f"{side}_toe")
    if toe is None or leg.ankle is None or leg.shank is None:
        return None
    return frame(leg.ankle - toe, leg.shank[..., 1])


def _foot_offsets(positions, leg: Leg, side: str) -> tuple[float, float] | None:
    """Plantar flexion and rotation [rad] of the line from toe to heel against that from toe to ankle."""
    raw, heel = _raw_foot(positions, leg, side), positions.get(f"{side}_heel")
    if raw is None or heel is None:
        return None
    sole = np.einsum("tji,tj->ti", raw, unit(heel - positions[f"{side}_toe"]))
    return middle(np.arctan2(-sole[:, 0], sole[:, 2])), SIGN[side] * middle(np.arcsin(np.clip(sole[:, 1], -1, 1)))
