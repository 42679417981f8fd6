"""Rendering: cameras, ray caster, sensors, 2D drawing and video."""

from motionenv.render.api import render
from motionenv.render.raycast.engine import Raycaster
from motionenv.render.scene import Scene
from motionenv.render.video.film import film, picture

__all__ = ["Raycaster", "Scene", "film", "picture", "render"]
