"""2D keypoints of one walker: COCO JSON, and tables of the 15 markers."""

from motionenv.mocap.keypoints.points2d import read_points, write_points

__all__ = ["read_points", "write_points"]
