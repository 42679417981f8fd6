"""A database of motion as a probability distribution: the tree of paper C, and beyond it."""

from motionenv.models.tree.capture import read_clips
from motionenv.models.tree.database import Clip, Database, build_database
from motionenv.models.tree.frames import resample
from motionenv.models.tree.growth import Growth, Options, Target, history, synthesize
from motionenv.models.tree.model import MotionTree, Samples

__all__ = [
    "Clip",
    "Database",
    "Growth",
    "MotionTree",
    "Options",
    "Samples",
    "Target",
    "build_database",
    "history",
    "read_clips",
    "resample",
    "synthesize",
]
