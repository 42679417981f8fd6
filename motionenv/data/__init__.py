"""Data sets of walking people with exact truth: specified in a file, made by many processes, the same to the byte."""

from motionenv.data.formats import FORMATS
from motionenv.data.making import Made, generate, ray_executor, verify
from motionenv.data.samples import Sampler
from motionenv.data.specification import PRESETS, Specification
from motionenv.data.store import Store
from motionenv.data.stream import Walkers

__all__ = [
    "FORMATS", "PRESETS", "Made", "Sampler", "Specification", "Store", "Walkers", "generate", "ray_executor", "verify",
]  # fmt: skip
