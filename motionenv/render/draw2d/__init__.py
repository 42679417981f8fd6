"""2D drawing: stick figures, point lights, film strips."""

from motionenv.render.draw2d.overlay import draw_pose, side_by_side, strip
from motionenv.render.draw2d.point_lights import render_points

__all__ = ["draw_pose", "render_points", "side_by_side", "strip"]
