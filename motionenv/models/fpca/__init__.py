"""Functional principal components of motion cycles (paper A, section 4)."""

from motionenv.models.fpca.model import FunctionalPCA

__all__ = ["FunctionalPCA"]
