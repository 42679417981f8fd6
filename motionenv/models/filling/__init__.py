"""Fill what a capture doesn't show: arms beside a captured lower body, a knee that was occluded for a moment."""

from motionenv.models.filling.motion import fill

__all__ = ["fill"]
