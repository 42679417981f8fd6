"""Joint centres from skin markers, for the Plug-in Gait marker set and CMU's variant of it."""

import numpy as np

from motionenv.types import Markers

# CMU's waist markers replace those of the pelvis.
_ALIASES = {"LFWT": "LASI", "RFWT": "RASI", "LBWT": "LPSI", "RBWT": "RPSI"}
_NEEDED = (
    "LASI",
    "RASI",
    "LSHO",
    "RSHO",
    "LWRA",
    "LWRB",
    "RWRA",
    "RWRB",
    "LELB",
    "RELB",
    "LKNE",
    "RKNE",
    "LANK",
    "RANK",
    "C7",
)

# Distance from marker to joint centre: half the joint's width plus the marker's radius [m]. Plug-in Gait measures these
# on every person; files rarely include them, so these are typical of adults.
_KNEE, _ANKLE, _SHOULDER, _ELBOW = 0.058, 0.042, 0.047, 0.045


def has_markers(names) -> bool:
    """Whether `names` include the markers that `with_joint_centres` needs."""
    renamed = {_ALIASES.get(n, n) for n in names}
    return renamed.issuperset(_NEEDED) and (renamed.issuperset(("LPSI", "RPSI")) or "SACR" in renamed)


def with_joint_centres(markers: Markers) -> Markers:
    """Add hip, knee, ankle, shoulder, elbow and wrist centres (LHJC, RHJC, LKJC, ...) to the markers.

    Hips by the regression of Harrington et al. (2007, table 2) on the pelvis; knees and ankles medially from the
    lateral marker, along the line between the hips; shoulders down from the acromion along the trunk; elbows medially
    from the lateral marker, perpendicular to the plane of the arm; wrists midway between their two markers. NaN if a
    required marker is missing.

    Args:
        markers: with the names of Plug-in Gait (pelvis by PSIS or sacrum) or CMU; see `has_markers`.
    """
    names = [_ALIASES.get(n, n) for n in markers.names]
    at = {n: markers.positions[..., i, :] for i, n in reversed(list(enumerate(names)))}
    back = at["SACR"] if "LPSI" not in at else 0.5 * (at["LPSI"] + at["RPSI"])
    front = 0.5 * (at["LASI"] + at["RASI"])
    left = _unit(at["LASI"] - at["RASI"])
    forward = front - back
    forward = _unit(forward - left * (forward * left).sum(-1, keepdims=True))
    up = np.cross(forward, left)
    width = np.nanmedian(np.linalg.norm(at["LASI"] - at["RASI"], axis=-1))
    depth = np.nanmedian(np.linalg.norm(front - back, axis=-1))
    middle = front - (0.24 * depth + 0.0099) * forward - (0.30 * width + 0.0109) * up
    trunk = _unit(at["C7"] - middle)
    added = {}
    for side, sign in (("L", 1.0), ("R", -1.0)):
        added[f"{side}HJC"] = middle + sign * (0.33 * width + 0.0073) * left
        added[f"{side}KJC"] = at[f"{side}KNE"] - sign * _KNEE * left
        added[f"{side}AJC"] = at[f"{side}ANK"] - sign * _ANKLE * left
        added[f"{side}SJC"] = at[f"{side}SHO"] - _SHOULDER * trunk
        added[f"{side}WJC"] = 0.5 * (at[f"{side}WRA"] + at[f"{side}WRB"])
        elbow = at[f"{side}ELB"]
        plane = np.cross(elbow - added[f"{side}SJC"], added[f"{side}WJC"] - elbow)
        added[f"{side}EJC"] = elbow + sign * _ELBOW * _unit(plane)
    positions = np.concatenate([markers.positions, np.stack(list(added.values()), axis=-2)], axis=-2)
    return Markers((*names, *added), positions, markers.fps, name=markers.name)


def _unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) normalised to length 1."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
