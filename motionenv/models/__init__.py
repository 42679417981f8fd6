"""Models of motion cycles: functional PCA (paper A), eigenwalkers (paper B), and how they are stored."""

from motionenv.models.store import card, load, names

__all__ = ["card", "load", "names"]
