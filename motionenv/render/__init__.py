"""Pictures of bodies: cameras, the raycaster, the pyrender engine, films."""

from motionenv.render.engines import ENGINES, render
from motionenv.render.film import film, picture
from motionenv.render.raycast import Raycaster
from motionenv.render.scene import Scene

__all__ = ["ENGINES", "Raycaster", "Scene", "film", "picture", "render"]
