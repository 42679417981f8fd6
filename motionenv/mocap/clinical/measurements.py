"""A person's measurements for the Conventional Gait Model: from the file, or estimated from stature and markers."""

from dataclasses import dataclass, field, replace

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.types import Recording

_NAN = float("nan")

# Breadths relative to stature of Ross & Wilson's unisex phantom (1974): femur biepicondylar 9.52 cm, ankle
# bimalleolar 6.68 cm at 170.18 cm; leg length from ASIS to medial malleolus is 0.53 of stature (Winter 2009, fig. 4.1).
_KNEE_SHARE, _ANKLE_SHARE, _LEG_SHARE = 9.52 / 170.18, 6.68 / 170.18, 0.53
_RADIUS = 0.007  # [m] of the usual markers of 14 mm
_LARGEST = 0.03  # [m] radius
_PLAUSIBLE_STATURE = (0.6, 2.3)  # [m]

#: Field of `Side`: parameter of Plug-in Gait, without the side's letter.
_LENGTHS = {
    "leg_length": "LEGLENGTH", "knee_width": "KNEEWIDTH", "ankle_width": "ANKLEWIDTH",
    "asis_trochanter": "ASISTROCANTERDISTANCE",
}  # fmt: skip
_OFFSETS = {"plantar_flexion": "STATICPLANTFLEX", "foot_rotation": "STATICROTOFF"}
_TURNS = {"tibial_torsion": "TIBIALTORSION", "thigh_rotation": "THIGHROTATION", "shank_rotation": "SHANKROTATION"}
# Angles beyond this are in degrees [rad]: the line from toe to heel is at most 35 degrees from that to the ankle, and
# neither legs nor wands are turned by more than 50 degrees.
_LARGEST_OFFSET, _LARGEST_TURN = np.radians(35.0), np.radians(50.0)
_GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "SUBJECT_PARAMETERS")


@dataclass(frozen=True, repr=False)
class Side(OneLine):
    """Measurements of one side; NaN where unknown.

    Attributes:
        leg_length: ASIS to medial malleolus [m].
        knee_width, ankle_width: between the epicondyles, and between the malleoli [m].
        asis_trochanter: ASIS to trochanter, perpendicular to it [m]; NaN: from the leg's length (Davis et al. 1991).
        tibial_torsion: of the ankle's axis against the knee's, internal positive as in Plug-in Gait [rad].
        thigh_rotation, shank_rotation: of the wand's plane against the joint's axis, about the limb, in Plug-in Gait's
            sense [rad].
        plantar_flexion: static offset of the foot's long axis, heel to toe against ankle to toe [rad].
        foot_rotation: static offset of the foot about the shank [rad].
    """

    leg_length: float = _NAN
    knee_width: float = _NAN
    ankle_width: float = _NAN
    asis_trochanter: float = _NAN
    tibial_torsion: float = 0.0
    thigh_rotation: float = 0.0
    shank_rotation: float = 0.0
    plantar_flexion: float = _NAN
    foot_rotation: float = _NAN


@dataclass(frozen=True, repr=False)
class Measurements(OneLine):
    """Measurements of a person that the Conventional Gait Model needs beside the markers.

    Attributes:
        left, right: measurements of each side.
        asis_distance: between the ASIS [m]; NaN: the trial's median.
        marker_radius: [m], base of the marker included.
        given: whether leg lengths and widths were measured on the person; False if they are estimated.
    """

    left: Side = field(default_factory=Side)
    right: Side = field(default_factory=Side)
    asis_distance: float = _NAN
    marker_radius: float = _RADIUS
    given: bool = False


def measurements_of(recording: Recording | None) -> Measurements:
    """The measurements in the groups PROCESSING or SUBJECTS of a file's `recording`; NaN where it states none.

    Plug-in Gait's static offsets of the foot are stored in radians by some versions and in degrees by others, and
    torsions may be in degrees beside offsets in radians: of each of the two kinds, all values are degrees if one would
    be larger in radians than feet and legs allow.
    """
    if recording is None:
        return Measurements()
    stated = _stated(recording)
    lengths = lambda key: stated.get(key, _NAN) * recording.metres or _NAN
    sides = {}
    for side, letter in (("left", "L"), ("right", "R")):
        values = {name: lengths(letter + key) for name, key in _LENGTHS.items()}
        turns = {
            name: scale * stated[letter + key]
            for names, scale in (
                (_OFFSETS, _radians(stated, _OFFSETS, _LARGEST_OFFSET)),
                (_TURNS, _radians(stated, _TURNS, _LARGEST_TURN)),
            )
            for name, key in names.items()
            if letter + key in stated
        }
        sides[side] = Side(**values, **turns)
    diameter = stated.get("MARKERDIAMETER", recording.parameters.get("SEG:MARKER_DIAMETER", _NAN))
    radius = 0.5 * diameter * recording.metres
    given = all(np.isfinite([s.leg_length, s.knee_width, s.ankle_width]).all() for s in sides.values())
    asis = lengths("INTERASISDISTANCE")
    return Measurements(
        **sides, asis_distance=asis, marker_radius=radius if 0 < radius < 0.03 else _RADIUS, given=given
    )


def completed(known: Measurements, positions: dict[str, np.ndarray]) -> Measurements:
    """`known` with what it lacks (NaN) estimated from landmarks `positions` (frames, 3) [m] and average proportions.

    A leg's length is the longest distance from ASIS to ankle that the trial shows; widths follow from the stature that
    fits it (Ross & Wilson 1974).
    """
    legs = {side: _leg_length(getattr(known, side), positions, side) for side in ("left", "right")}
    other = {"left": legs["right"], "right": legs["left"]}
    sides = {}
    for side in ("left", "right"):
        leg = legs[side] if np.isfinite(legs[side]) else other[side]
        stature = float(np.clip(leg / _LEG_SHARE, *_PLAUSIBLE_STATURE))
        own = getattr(known, side)
        guess = {"leg_length": leg, "knee_width": stature * _KNEE_SHARE, "ankle_width": stature * _ANKLE_SHARE}
        sides[side] = replace(own, **{k: v for k, v in guess.items() if not np.isfinite(getattr(own, k))})
    return replace(known, **sides)


def _radians(stated: dict[str, float], names: dict[str, str], largest: float) -> float:
    """Radians per unit of the angles called `names`, which are at most `largest` [rad]."""
    sizes = [abs(stated.get(letter + name, 0.0)) for letter in "LR" for name in names.values()]
    return 1.0 if max(sizes) <= largest else np.pi / 180


def _stated(recording: Recording) -> dict[str, float]:
    found = {}
    for key, value in reversed(list(recording.parameters.items())):
        group, _, name = key.partition(":")
        if group in _GROUPS:
            found["".join(c for c in name.upper() if c.isalnum())] = value
    return found


def _leg_length(side: Side, positions: dict[str, np.ndarray], name: str) -> float:
    """The leg's length [m]: measured, or the longest distance from ASIS to ankle."""
    ends = [positions.get(f"{name}_{landmark}") for landmark in ("asis", "ankle_lateral")]
    if np.isfinite(side.leg_length) or ends[0] is None or ends[1] is None:
        return side.leg_length
    length = np.linalg.norm(ends[0] - ends[1], axis=-1)
    known = length[np.isfinite(length)]
    return float(np.percentile(known, 95)) if known.size else _NAN
