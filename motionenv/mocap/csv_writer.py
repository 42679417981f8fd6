"""CSV out: a table that spreadsheets, R, MATLAB and pandas read without options, one row per frame.

Columns, each with its unit at the end of its name:

    time_s                                             seconds since the first frame
    root_x_m, root_y_m, root_z_m                       the pose vector, in the order of `motionenv.types.POSE`:
    root_tilt_rad ... right_knee_flexion_rad           metres and radians, signs as in `motionenv.body.kinematics`
    head_x_m, head_y_m, head_z_m ... right_ankle_z_m   the 15 markers in the world (x forward, y left, z up)

Numbers have all their digits, so that reading them back gives the same float64. What is unknown is an empty field.
The body's limb lengths are not in the file; NPZ holds them.
"""

import csv

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.files import atomic_write
from motionenv.mocap.outgoing import check_sequence
from motionenv.types import MARKERS, POSE, Motion

#: Names of the columns.
COLUMNS = (
    "time_s",
    *(f"{name}_{'m' if i < 3 else 'rad'}" for i, name in enumerate(POSE)),
    *(f"{name}_{axis}_m" for name in MARKERS for axis in "xyz"),
)


def write(motion: Motion, path) -> None:
    """Write poses and markers over time as CSV, whole or not at all.

    Args:
        motion: one sequence (frames, 25); gaps become empty fields.
        path: the file.

    Raises:
        MotionError: it isn't one sequence, or the file can't be written.
    """
    check_sequence(motion, "CSV", gaps=True)
    frames = len(motion.poses)
    points = markers(motion.poses, motion.skeleton).reshape(frames, -1)
    table = np.column_stack([np.arange(frames) / motion.fps, motion.poses, points])
    with atomic_write(path) as temporary, open(temporary, "w", encoding="ascii", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        rows.writerows([value if value == value else "" for value in row] for row in table.tolist())
