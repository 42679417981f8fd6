"""Lifting of people who move freely: a network proposes postures, and all frames are then fitted at once."""

from motionenv.lifting.free.lifter import FreeFit, fit_freely, heading_of, limb_lengths

__all__ = ["FreeFit", "fit_freely", "heading_of", "limb_lengths"]
