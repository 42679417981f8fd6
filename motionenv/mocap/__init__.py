"""Motion capture files, in metres, z up: read BVH, ASF/AMC, C3D, TRC, NPZ and AMASS; write BVH, C3D, CSV, GLB, NPZ."""

from motionenv.mocap.marker_sets import LANDMARKS, MarkerMap, find_landmarks, guess_map
from motionenv.mocap.motion_io import describe, read_motion
from motionenv.mocap.reading import person_label, read
from motionenv.mocap.retargeting import retarget, to_markers
from motionenv.mocap.writing import encode, write

__all__ = [
    "LANDMARKS",
    "MarkerMap",
    "describe",
    "encode",
    "find_landmarks",
    "guess_map",
    "person_label",
    "read",
    "read_motion",
    "retarget",
    "to_markers",
    "write",
]
