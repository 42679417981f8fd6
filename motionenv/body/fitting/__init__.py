"""Fit the body to points: a person's limb lengths, and the pose in every frame.

Closed form and vectorised over frames: the torso by weighted Procrustes, the head by two directions, each limb by
the direction of its upper part and the plane in which it bends. Entries that depend on a gap become NaN; all others
don't. Angles are continuous over time, through straight limbs and gimbal lock too.
"""

from motionenv.body.fitting._poses import fit_poses
from motionenv.body.fitting._proportions import fit_skeleton

__all__ = ["fit_poses", "fit_skeleton"]
