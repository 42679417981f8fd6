"""Joint angles of a capture in one plane, such as a film from the side: flexion only."""

import numpy as np

_FLAT = 0.003  # [m] least depth of a body
_THIN = 0.01  # and its least share of the next larger extent

#: The landmarks of a trunk's upper end, best first.
_TOPS = ("neck", "c7", "shoulder", "acromion")


def is_flat(positions: np.ndarray) -> bool:
    """Whether points (frames, points, 3) [m] lie in one plane, as those of a film from the side do."""
    points = positions[np.isfinite(positions).all(-1)]
    if len(points) < 4:
        return False
    points = points - points.mean(0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(points.T @ points / len(points)), 0.0))
    return bool(spread[0] < _FLAT and spread[0] < _THIN * spread[1])


def sagittal_angles(at: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Hip and knee flexion and ankle dorsiflexion (frames,) [degrees], by name with side, of landmarks in one plane.

    The hip's is relative to the trunk, or to the vertical where no trunk is seen. The ankle's is that of the line from
    heel to toe against the shank.

    Args:
        at: (frames, 3) [m] by landmark; of joints their centres or lateral markers.
    """
    ahead = _forward(at)
    pitch = lambda line: np.degrees(np.arctan2(line @ ahead, -line[:, 2]))  # of a line downwards, forwards positive
    hips = [hip for hip in (_joint(at, "left", "hip"), _joint(at, "right", "hip")) if hip is not None]
    top = _top(at)
    lean = pitch(np.mean(hips, axis=0) - top) if hips and top is not None else 0.0
    found = {}
    for side in ("left", "right"):
        hip, knee, ankle = (_joint(at, side, name) for name in ("hip", "knee", "ankle"))
        if hip is not None and knee is not None:
            found[f"{side}_hip_flexion"] = pitch(knee - hip) - lean
        if hip is not None and knee is not None and ankle is not None:
            found[f"{side}_knee_flexion"] = pitch(knee - hip) - pitch(ankle - knee)
        if knee is not None and ankle is not None and {f"{side}_heel", f"{side}_toe"} <= at.keys():
            foot = at[f"{side}_toe"] - at[f"{side}_heel"]
            found[f"{side}_ankle_dorsiflexion"] = pitch(foot) - 90.0 - pitch(ankle - knee)
    return found


def _joint(at: dict[str, np.ndarray], side: str, name: str) -> np.ndarray | None:
    trochanter = at.get(f"{side}_trochanter") if name == "hip" else None
    return at.get(f"{side}_{name}", at.get(f"{side}_{name}_lateral", trochanter))


def _top(at: dict[str, np.ndarray]) -> np.ndarray | None:
    """The trunk's upper end: on the midline, or midway between the sides."""
    for name in _TOPS:
        if name in at:
            return at[name]
        if {f"left_{name}", f"right_{name}"} <= at.keys():
            return 0.5 * (at[f"left_{name}"] + at[f"right_{name}"])
    return None


def _forward(at: dict[str, np.ndarray]) -> np.ndarray:
    """The horizontal direction (3,) in the plane in which the feet point or, without feet, knees bend to."""
    points = np.concatenate(list(at.values()))[:, :2]
    points = points[np.isfinite(points).all(-1)]
    along = np.append(np.linalg.svd(points - points.mean(0), full_matrices=False)[2][0], 0.0)
    lines = []
    for side in ("left", "right"):
        hip, knee, ankle = (_joint(at, side, name) for name in ("hip", "knee", "ankle"))
        if {f"{side}_heel", f"{side}_toe"} <= at.keys():
            lines.append(at[f"{side}_toe"] - at[f"{side}_heel"])
        elif hip is not None and knee is not None and ankle is not None:
            lines.append(2.0 * knee - hip - ankle)
    ahead = np.concatenate(lines) @ along if lines else np.ones(1)
    return along if np.nanmean(ahead) >= 0 else -along
