"""Rendering: cameras, ray caster, OpenGL engine, sensors, 2D drawing and video."""

from motionenv.render.api import ENGINES, render
from motionenv.render.raycast.engine import Raycaster
from motionenv.render.scene import Scene
from motionenv.render.video.film import film, picture

__all__ = ["ENGINES", "Raycaster", "Scene", "film", "picture", "render"]
