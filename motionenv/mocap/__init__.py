"""Motion capture files: read BVH, ASF/AMC, C3D, TRC and NPZ (in metres, z up); write BVH, C3D, CSV, GLB and NPZ."""

from motionenv.mocap.marker_sets import LANDMARKS, MarkerMap, find_landmarks, guess_map
from motionenv.mocap.motion_io import describe, read_motion
from motionenv.mocap.reading import read
from motionenv.mocap.retargeting import retarget, to_markers
from motionenv.mocap.writing import encode, write

__all__ = [
    "LANDMARKS",
    "MarkerMap",
    "describe",
    "encode",
    "find_landmarks",
    "guess_map",
    "read",
    "read_motion",
    "retarget",
    "to_markers",
    "write",
]
