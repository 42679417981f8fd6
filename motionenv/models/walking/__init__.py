"""Walking over the ground from functional principal components (paper A)."""

from motionenv.models.walking.model import WalkingModel
from motionenv.models.walking.preprocessing import CHANNELS

__all__ = ["CHANNELS", "WalkingModel"]
