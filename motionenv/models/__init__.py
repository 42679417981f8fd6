"""Models of motion cycles: functional PCA (paper A), eigenwalkers (paper B), and how they are stored."""

from motionenv.models.store import load, names

__all__ = ["load", "names"]
