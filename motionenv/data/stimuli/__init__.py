"""Stimulus sets for experiments on perception: point-light walkers that any laboratory can make again."""

from motionenv.data.stimuli.dots import Dots, Ring, dots_at
from motionenv.data.stimuli.making import frames_of, write_stimuli, zipped
from motionenv.data.stimuli.specification import Display, PointLightWalker, StimulusSet

__all__ = [
    "Display", "Dots", "PointLightWalker", "Ring", "StimulusSet", "dots_at", "frames_of", "write_stimuli", "zipped",
]  # fmt: skip
