"""Segments and joint centres of the lower body by the Conventional Gait Model.

Davis et al. (1991), Hum Mov Sci 10; Kadaba et al. (1990), J Orthop Res 8; as Plug-in Gait computes it (Baker et al.
2018, "The Conventional Gait Model", in Handbook of Human Motion). Frames of segments have x forward, y to the left and
z up along the segment, for both sides.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.mocap.clinical.measurements import Measurements, Side

_THETA, _BETA = 0.5, 0.314  # [rad] Davis et al. (1991): hip's direction in the frontal and the sagittal plane

_OFFSET_ROUNDS = 30  # an offset is at least a third of the turn: what is missing is then below 1e-5 of it

#: Anterior tilt of the pelvis [rad] when the trunk is upright (Kadaba et al. 1990).
NEUTRAL_TILT = np.radians(10.0)

#: Sign of y on the side to which "lateral" points.
SIGN = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True, eq=False)
class Segment:
    """A rigid segment over time: `origin` (frames, 3) [m] and `rotation` (frames, 3, 3), segment → world."""

    origin: np.ndarray
    rotation: np.ndarray


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) normalised to length 1; NaN where their length is 0."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length > 0, length, np.nan)


def frame(along: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Rotation (frames, 3, 3) with z along `along` and y as close as possible to `towards`."""
    z = unit(along)
    x = unit(np.cross(towards, z))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def middle(values: np.ndarray) -> float:
    """Median of the known values; NaN if there is none."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def pelvis(positions: dict[str, np.ndarray]) -> Segment | None:
    """The pelvis: origin midway between the ASIS, y along them, x in the plane through the sacrum.

    None unless the landmarks `positions` hold both ASIS, and the sacrum or both PSIS.
    """
    back = sacrum(positions)
    if back is None or not {"left_asis", "right_asis"} <= positions.keys():
        return None
    left, right = positions["left_asis"], positions["right_asis"]
    front = 0.5 * (left + right)
    y = unit(left - right)
    x = front - back
    x = unit(x - y * (x * y).sum(-1, keepdims=True))
    return Segment(front, np.stack([x, y, np.cross(x, y)], axis=-1))


def sacrum(positions: dict[str, np.ndarray]) -> np.ndarray | None:
    """Midway between the PSIS, or the marker on the sacrum, frame by frame whichever is seen; (frames, 3)."""
    ways = [positions["sacrum"]] if "sacrum" in positions else []
    if {"left_psis", "right_psis"} <= positions.keys():
        ways.insert(0, 0.5 * (positions["left_psis"] + positions["right_psis"]))
    if not ways:
        return None
    return np.where(np.isfinite(ways[0]), ways[0], ways[-1])


def davis_hip(segment: Segment, person: Measurements, side: str, asis_distance: float) -> np.ndarray:
    """Centre of the hip (frames, 3) from the legs' lengths (Davis et al. 1991, eq. 1 to 4)."""
    own: Side = getattr(person, side)
    c = 0.115 * np.mean([person.left.leg_length, person.right.leg_length]) - 0.0153
    depth = own.asis_trochanter if np.isfinite(own.asis_trochanter) else 0.1288 * own.leg_length - 0.04856
    depth += person.marker_radius
    local = [
        c * np.cos(_THETA) * np.sin(_BETA) - depth * np.cos(_BETA),
        SIGN[side] * (0.5 * asis_distance - c * np.sin(_THETA)),
        -c * np.cos(_THETA) * np.cos(_BETA) - depth * np.sin(_BETA),
    ]
    return segment.origin + segment.rotation @ np.array(local)


def harrington_hip(segment: Segment, positions: dict[str, np.ndarray], side: str, asis_distance: float) -> np.ndarray:
    """Centre of the hip (frames, 3) from the width and depth of the pelvis (Harrington et al. 2007, table 2)."""
    back = sacrum(positions)
    depth = middle(np.linalg.norm(segment.origin - back, axis=-1))
    local = [-(0.24 * depth + 0.0099), SIGN[side] * (0.33 * asis_distance + 0.0073), -(0.30 * asis_distance + 0.0109)]
    return segment.origin + segment.rotation @ np.array(local)


def chord(
    proximal: np.ndarray, lateral: np.ndarray, wand: np.ndarray, distance: float, turn: np.ndarray | float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Joint centre (frames, 3) by the chord function, from markers and centres (frames, 3) [m].

    It lies in the plane of the `proximal` centre (of the joint above), the `lateral` marker on the joint's axis and the
    `wand`, `distance` [m] from the lateral marker (half the joint's width plus the marker's radius), on the side away
    from the wand, where the lines to the marker and to the proximal centre meet at a right angle. The wand's plane is
    first turned by `turn` [rad], one or (frames, 1), about the line from the marker to the proximal centre.
    """
    line = proximal - lateral
    length = np.linalg.norm(line, axis=-1, keepdims=True)
    along = line / np.where(length > distance, length, np.nan)
    away = wand - lateral
    away = -unit(away - along * (away * along).sum(-1, keepdims=True))
    away = np.cos(turn) * away + np.sin(turn) * np.cross(along, away)
    share = distance / length
    return lateral + distance * (share * along + np.sqrt(np.maximum(1.0 - share**2, 0.0)) * away)


def offset_turn(
    proximal: np.ndarray, lateral: np.ndarray, wand: np.ndarray, distance: float, offset: float
) -> np.ndarray | float:
    """The `turn` (frames, 1) [rad] of `chord` that puts `wand` at an `offset` [rad] from `lateral`.

    The offset is the angle from the wand to the lateral marker about the limb, as seen along the line from the joint's
    centre to the `proximal` one. The wand stands farther from the centre than from the marker, so that the offset is a
    part of the turn, and adding what is missing converges.
    """
    if not offset:
        return 0.0
    turn = np.full((len(lateral), 1), offset)
    for _ in range(_OFFSET_ROUNDS):
        centre = chord(proximal, lateral, wand, distance, turn)
        turn = turn + offset - angle_about(proximal - centre, wand - centre, lateral - centre)[:, None]
    return turn


def angle_about(axis: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Signed angle (frames,) [rad] about `axis` from `start` to `end`, all (frames, 3)."""
    z = unit(axis)
    a, b = (unit(v - z * (v * z).sum(-1, keepdims=True)) for v in (start, end))
    return np.arctan2((np.cross(a, b) * z).sum(-1), (a * b).sum(-1))
