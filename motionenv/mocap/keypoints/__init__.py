"""2D keypoints of one walker: files of detectors and data sets, tables of the 15 markers, a model of detector error."""

from motionenv.mocap.keypoints.detector_errors import DetectorErrors
from motionenv.mocap.keypoints.points2d import read_points, write_points

__all__ = ["DetectorErrors", "read_points", "write_points"]
