"""Sensor models: backgrounds, occluders, image noise, and noisy 2D markers."""

from motionenv.render.sensors.augmentation import Augmentation, Augmenter
from motionenv.render.sensors.marker_sensor import MarkerSensor

__all__ = ["Augmentation", "Augmenter", "MarkerSensor"]
