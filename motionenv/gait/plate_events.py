"""Gait events from force plates: when a foot loads and unloads them."""

from collections.abc import Sequence

import numpy as np

from motionenv.gait.feet import Feet
from motionenv.types import Event, ForcePlate

_LOADED = 20.0  # [N] on the plate
_LEAST = 200.0  # [N] peak of a step; less is a touch, or an empty plate's drift
_STANCE = (0.11, 2.0)  # [s] duration of a stance: shortest in sprinting; a longer one is standing
_BESIDE = 0.03  # [m] by which a foot may stand over a plate's edge
_TIP = 0.3  # of the distance from heel to toe, from there to the tip of the shoe
_FOOT = 0.30  # [m] farthest that the centre of pressure can be from the middle of the foot
_STILL = 0.5  # [m/s] of a foot that stands


def plate_events(plates: Sequence[ForcePlate], feet: Feet) -> tuple[Event, ...]:
    """Initial contacts of the feet whose heel, and toe-offs of those whose toe is on a plate, in the order of time.

    The `feet` tell whose step it is. One that lands beside the `plates` and rolls onto one tells its toe-off only, and
    one that rolls over a plate's edge its initial contact only.
    """
    found: list[Event] = []
    for plate in plates:
        for start, end in _loadings(plate):
            side = _side(plate, feet, start, end)
            if side is None:
                continue
            flat = round(0.5 * (start + end) * feet.fps)  # the frame in the middle of stance
            tip = feet.toe[side] + _TIP * (feet.toe[side] - feet.heel[side])[flat]
            for event, path in (
                (Event(start, "initial_contact", side), feet.heel[side]),
                (Event(end, "toe_off", side), tip),
            ):
                frame = round(event.time * feet.fps)
                if 0 < frame < len(path) - 1 and _inside(path[frame], plate.corners):
                    found.append(event)
    return tuple(sorted(found, key=lambda event: event.time))


def _loadings(plate: ForcePlate) -> list[tuple[float, float]]:
    """Start and end [s] of each stance on a plate."""
    up = plate.force[:, 2]
    loaded = np.concatenate([[False], up > _LOADED, [False]])
    edges = np.flatnonzero(np.diff(loaded.astype(np.int8))).reshape(-1, 2)
    return [
        (float(start / plate.fps), float(end / plate.fps))
        for start, end in edges
        if _STANCE[0] <= (end - start) / plate.fps <= _STANCE[1] and up[start:end].max() >= _LEAST
    ]


def _side(plate: ForcePlate, feet: Feet, start: float, end: float) -> str | None:
    """The side of the foot that stands on the centre of pressure in the middle of a loading; None if it is unclear."""
    middle = 0.5 * (start + end)
    sample, frame = round(middle * plate.fps), round(middle * feet.fps)
    if not 0 < frame < len(feet.pelvis) - 1 or not np.isfinite(plate.centre[sample]).all():
        return None
    standing = {}
    for side in feet.sides:
        ends = np.stack([feet.heel[side], feet.toe[side]])
        # Runners' heels have risen by the middle of stance: the slower end stands.
        speed = np.linalg.norm(ends[:, frame + 1] - ends[:, frame - 1], axis=-1).min() * feet.fps / 2
        if np.linalg.norm((ends[:, frame].mean(0) - plate.centre[sample])[:2]) < _FOOT and speed < _STILL:
            standing[side] = speed
    return next(iter(standing)) if len(standing) == 1 else None


def _inside(point: np.ndarray, corners: np.ndarray) -> bool:
    """Whether a point [m] lies over a plate, or at most `_BESIDE` beside it."""
    centre = corners.mean(0)[:2]
    across = [0.5 * (corners[i] + corners[i + 1] - corners[i - 1] - corners[i - 2])[:2] / 2 for i in (1, 2)]
    for half in across:
        length = np.linalg.norm(half)
        if not abs((point[:2] - centre) @ half) <= length * (length + _BESIDE):
            return False
    return True
