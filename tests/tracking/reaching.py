"""Trees of right arms that move between random postures."""

import numpy as np

from motionenv.body import from_height
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.models.motion_tree import MotionTree
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.types import Motion


def reaching_tree(clips: int) -> MotionTree:
    """A tree of eight seconds of each of so many arms."""

    def arm(number: int) -> Clip:
        angles = reach(240, 30, np.random.default_rng([0, number]))
        poses = np.zeros((len(angles), 25))
        poses[:, RIGHT_ARM] = angles
        return Clip(Motion(poses, from_height(), 30), f"reach {number}", "reach", str(number))

    return MotionTree(part="right_arm").fit_database(build_database(arm(number) for number in range(clips)))
