"""Marker sets: which points of a file are which landmarks of the body."""

from motionenv.mocap.marker_sets.guessing import annotated, guess_map
from motionenv.mocap.marker_sets.marker_map import LANDMARKS, MarkerMap
from motionenv.mocap.marker_sets.matching import Landmarks, find_landmarks, marker_set, marker_sets, recognise, resolve

__all__ = [
    "LANDMARKS", "Landmarks", "MarkerMap", "annotated", "find_landmarks", "guess_map", "marker_set", "marker_sets",
    "recognise", "resolve",
]  # fmt: skip
