"""Functional principal components of motion cycles (paper A, section 4)."""

from motionenv.models.fpca.model import FunctionalPCA
from motionenv.models.fpca.multilevel import MultilevelFPCA

__all__ = ["FunctionalPCA", "MultilevelFPCA"]
