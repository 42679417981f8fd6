"""A database of motion as a probability distribution: the tree of paper C, with extensions."""

from motionenv.models.motion_tree.database import Clip, Database, build_database
from motionenv.models.motion_tree.model import MotionTree, Samples
from motionenv.models.motion_tree.synthesis.generator import MotionGenerator, Options, history
from motionenv.models.motion_tree.training import fit_tree, read_clips
from motionenv.models.transforms import resample
from motionenv.models.types import Target

__all__ = [
    "Clip", "Database", "MotionGenerator", "MotionTree", "Options", "Samples", "Target", "build_database", "fit_tree",
    "history", "read_clips", "resample",
]  # fmt: skip
