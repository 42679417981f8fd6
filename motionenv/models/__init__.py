"""Gait models: functional PCA (paper A), eigenwalkers (paper B), the motion tree (paper C) and more."""

from motionenv._core.validation import did_you_mean
from motionenv.arguments import Request
from motionenv.models.base import FixedModel, GaitModel
from motionenv.models.in_place import cycle
from motionenv.models.registry import ModelFile, card, gait_model, load, names, takes_long, version
from motionenv.models.storage.export import parameters
from motionenv.models.types import Components, Cycle, Target, Treadmill, Walker

__all__ = [
    "Components", "Cycle", "FixedModel", "GaitModel", "ModelFile", "Request", "Target", "Treadmill", "Walker", "card",
    "cycle", "did_you_mean", "gait_model", "load", "names", "parameters", "takes_long", "version",
]  # fmt: skip
