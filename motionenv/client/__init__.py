"""A service of `motionenv serve` as Python sees it: motions in, motions out, jobs to wait for, motion without end.

    >>> with motionenv.Client("http://127.0.0.1:8000") as client:
    ...     motion = client.synthesize("walk/fpca", seconds=4, fps=30, seed=1, speed=1.3)
    ...     client.save("walk.mp4", "walk/fpca", seconds=4, fps=30, seed=1, speed=1.3)

The same seed gives the same motion, to the last bit, as `motionenv.synthesize`.
"""

from motionenv.client.answers import Component, LiftedPoints, Model, ModelDetails, Samples, View
from motionenv.client.asking import Client, Picture, Walk
from motionenv.client.jobs import Job
from motionenv.client.streams import Stream

__all__ = [
    "Client",
    "Component",
    "Job",
    "LiftedPoints",
    "Model",
    "ModelDetails",
    "Picture",
    "Samples",
    "Stream",
    "View",
    "Walk",
]
