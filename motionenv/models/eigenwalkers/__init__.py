"""Eigenwalkers: principal components of Fourier walkers (paper B, section 3.1)."""

from motionenv.models.eigenwalkers.extraction import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.model import Eigenwalkers

__all__ = ["Eigenwalkers", "FourierWalker", "fourier_walker"]
