"""Functional joints: where two segments that move against each other are joined.

SCoRE, the symmetrical centre of rotation estimation (Ehrig, Taylor, Duda & Heller 2006, J Biomech 39, eq. 6): the point
that is fixed in both segments in the sense of least squares. SARA, the symmetrical axis of rotation approach (Ehrig,
Taylor, Duda & Heller 2007, J Biomech 40): the direction along which that point is determined least, which is the axis
where the joint is a hinge.
"""

from dataclasses import dataclass

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.errors import GapError
from motionenv.mocap.clinical.gait_model import Segment, unit

_FEWEST = 10  # frames that show both segments
_NOTHING = 1e-6  # [rad] swing below which a direction can't be told at all


@dataclass(frozen=True, eq=False, repr=False)
class FunctionalJoint(OneLine):
    """A joint between a proximal and a distal segment.

    Attributes:
        centre: (frames, 3) [m] the point that is fixed in both segments; NaN where neither is seen.
        axis: (frames, 3) direction, of length 1, along which the centre is determined least: a hinge's axis. Its sense
            is arbitrary.
        swings: (3,) [rad] rms rotation of the segments against each other that determines the centre, in each of three
            perpendicular directions, largest first. The last is that along `axis`: 0 for a hinge.
    """

    centre: np.ndarray
    axis: np.ndarray
    swings: np.ndarray


def functional_joint(proximal: Segment, distal: Segment, *, hinge: bool = False) -> FunctionalJoint:
    """The joint between two segments, by SCoRE and SARA.

    With rotations R, S and origins t, d of the two segments, the centres c1, c2 in them minimise the sum over frames of
    |R c1 + t - S c2 - d|². The singular values of this system come in pairs sqrt(1 ± s), with s those of the mean of
    Rᵀ S; the three small ones, times sqrt(2), are the rms rotations perpendicular to a direction, which determine the
    centre along it. A direction without any rotation is cut off, as is the axis of a hinge: along it, the centre is the
    point nearest to the segments' origins.

    Args:
        proximal, distal: poses of the segments (frames, …), NaN where unknown.
        hinge: whether to leave the centre open along the axis even where some rotation seems to determine it, as that
            of knees is mostly skin that moves.

    Raises:
        GapError: fewer than ten frames show both segments.
    """
    r, t, s, d = proximal.rotation, proximal.origin, distal.rotation, distal.origin
    both = np.isfinite(t).all(-1) & np.isfinite(d).all(-1)
    if both.sum() < _FEWEST:
        raise GapError(f"a functional joint needs {_FEWEST} frames that show both segments; there are {both.sum()}")
    system = np.concatenate([r[both], -s[both]], axis=-1).reshape(-1, 6) / np.sqrt(both.sum())
    right = (d - t)[both].reshape(-1) / np.sqrt(both.sum())
    u, values, vectors = np.linalg.svd(system, full_matrices=False)
    swings = np.sqrt(2.0) * values[3:]
    kept = np.concatenate([np.ones(3, dtype=bool), swings > _NOTHING])
    kept[5] &= not hinge
    solution = vectors[kept].T @ ((u[:, kept].T @ right) / values[kept])
    centre = _mean(r @ solution[:3] + t, s @ solution[3:] + d)
    return FunctionalJoint(centre, unit(_mean(r @ vectors[5, :3], s @ vectors[5, 3:])), swings)


def _mean(proximal: np.ndarray, distal: np.ndarray) -> np.ndarray:
    """Mean (frames, 3) of what both segments say, or what the one that is seen says."""
    known = np.isfinite(proximal).astype(int) + np.isfinite(distal)
    total = np.where(np.isfinite(proximal), proximal, 0.0) + np.where(np.isfinite(distal), distal, 0.0)
    return np.where(known > 0, total / np.maximum(known, 1), np.nan)
