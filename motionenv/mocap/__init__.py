"""Motion capture files, in metres and z up.

BVH, C3D, TRC and NPZ are read and written; ASF/AMC, AMASS, and tables of Qualisys, Motive and others are only read;
GLB and MOT are only written. CSV is written with poses, and read as a table of points.
"""

from motionenv.mocap.marker_sets import LANDMARKS, MarkerMap, find_landmarks, guess_map
from motionenv.mocap.plausibility import check_plausible, find_doubts
from motionenv.mocap.reading import SUFFIXES, describe, person_label, read, read_motion, read_static
from motionenv.mocap.retargeting import retarget, to_markers
from motionenv.mocap.writing import encode, write, write_markers

__all__ = [
    "LANDMARKS", "SUFFIXES", "MarkerMap", "check_plausible", "describe", "encode", "find_doubts", "find_landmarks",
    "guess_map", "person_label", "read", "read_motion", "read_static", "retarget", "to_markers", "write",
    "write_markers",
]  # fmt: skip
