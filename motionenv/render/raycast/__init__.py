"""The ray casting engine: exact rounded cones in compiled code, without a graphics library."""

from motionenv.render.raycast.engine import Raycaster
from motionenv.render.raycast.multi_body import MultiBodyRaycaster

__all__ = ["MultiBodyRaycaster", "Raycaster"]
