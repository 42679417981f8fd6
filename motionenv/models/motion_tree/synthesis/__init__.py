"""Frame-by-frame synthesis of motion from a database (paper C, section 5)."""

from motionenv.models.motion_tree.synthesis.generator import MotionGenerator, Options, history

__all__ = ["MotionGenerator", "Options", "history"]
