"""CSV writer: a table with one row per frame, readable without options by spreadsheets, R, MATLAB and pandas.

Columns, each with its unit at the end of its name:

    time_s                                             seconds since the first frame
    root_x_m, root_y_m, root_z_m                       the pose vector, in the order of `motionenv.types.POSE`:
    root_tilt_rad ... right_knee_flexion_rad           metres and radians, signs as in `motionenv.body.kinematics`
    head_x_m, head_y_m, head_z_m ... right_ankle_z_m   the 15 markers in the world (x forward, y left, z up)

Numbers have full precision: reading them back gives the same float64. Unknown values are empty fields. Limb lengths
are not included; NPZ has them.
"""

import csv
import io
from collections.abc import Iterator, Mapping
from itertools import chain

import numpy as np

from motionenv.body.kinematics import markers
from motionenv.mocap.writers.common import check_sequence
from motionenv.types import MARKERS, POSE, Motion

#: Names of the columns.
COLUMNS = (
    "time_s",
    *(f"{name}_{'m' if i < 3 else 'rad'}" for i, name in enumerate(POSE)),
    *(f"{name}_{axis}_m" for name in MARKERS for axis in "xyz"),
)

_TOGETHER = 500  # frames converted to text at a time


def encode(motion: Motion, beside: Mapping[str, np.ndarray] | None = None) -> Iterator[bytes]:
    """The bytes of a table of one sequence's poses (frames, 25) and markers, a few hundred rows at a time.

    Further columns (frames,), by name, come `beside` them.
    """
    check_sequence(motion, "CSV", gaps=True)
    frames = np.arange(len(motion.poses))
    more = np.column_stack(list(beside.values())) if beside else np.empty((len(frames), 0))
    rows = (_rows(motion, frames[start : start + _TOGETHER], more) for start in frames[::_TOGETHER])
    return chain([",".join([*COLUMNS, *(beside or {})]).encode() + b"\n"], rows)


def _rows(motion: Motion, frames: np.ndarray, more: np.ndarray) -> bytes:
    poses = motion.poses[frames]
    points = markers(poses, motion.skeleton).reshape(len(poses), -1)
    table = np.column_stack([frames / motion.fps, poses, points, more[frames]])
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerows([value if value == value else "" for value in row] for row in table.tolist())
    return text.getvalue().encode("ascii")
