"""Walks along paths: arcs, curves, stops and starts, from any gait model."""

from motionenv.models.paths.bending import bend
from motionenv.models.paths.path import WalkPath, random_path
from motionenv.models.paths.walking import walk_along

__all__ = ["WalkPath", "bend", "random_path", "walk_along"]
