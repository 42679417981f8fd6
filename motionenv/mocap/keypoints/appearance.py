"""How a person in a picture looks: the colours of the clothes on trunk and thighs."""

import numpy as np

from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS

_BINS = 4  # of each colour channel
_SHARES = np.linspace(0.15, 0.85, 8)


def look_of(picture: np.ndarray, keypoints: np.ndarray) -> np.ndarray:
    """Distribution (128,) of colours of a person on the trunk and on the thighs.

    Args:
        picture: uint8 (height, width, 3).
        keypoints: (n, 3) x, y [pixels] and score; of a definition with n keypoints.
    """
    names = next(known.keypoints for known in KEYPOINT_SETS.values() if len(known.keypoints) == len(keypoints))
    at = lambda name: keypoints[names.index(name), :2]
    across = _SHARES[:, None, None]
    upper, lower = (at(f"left_{j}") + across * (at(f"right_{j}") - at(f"left_{j}")) for j in ("shoulder", "hip"))
    trunk = upper + _SHARES[:, None] * (lower - upper)
    thighs = [at(f"{s}_hip") + _SHARES[:, None] * (at(f"{s}_knee") - at(f"{s}_hip")) for s in ("left", "right")]
    counts = [_colours(picture, places.reshape(-1, 2)) for places in (trunk, np.stack(thighs))]
    return np.concatenate(counts) / 2


def _colours(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Shares (64,) of colours at places (n, 2) of a picture; those beside it count as those at its edge."""
    columns, rows = np.clip(np.rint(places), 0, np.array(picture.shape[1::-1]) - 1).astype(int).T
    r, g, b = (picture[rows, columns] // (256 // _BINS)).T.astype(int)
    return np.bincount((r * _BINS + g) * _BINS + b, minlength=_BINS**3) / len(places)
