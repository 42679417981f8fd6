"""MOT writer: joint angles as the coordinates of OpenSim's model Rajagopal2015 (Rajagopal et al. 2016).

Degrees and metres, in the axes of OpenSim's ground: x forward, y up, z to the right. Signs are that model's: flexion
of hip, knee, shoulder and elbow, adduction, and rotation of the front of the limb towards the midline are above 0 on
both sides; pelvis_tilt leans backward, pelvis_list lifts the left side, pelvis_rotation turns left. (The knee of the
older gait2392 has the other sign.)

* The pelvis turns by R_z(pelvis_tilt) R_x(pelvis_list) R_y(pelvis_rotation), other than the body's root, whose angles
  are converted through rotation matrices. Hips and shoulders turn by R_z(flexion) R_x(±adduction) R_y(±rotation), which
  is the body's own order (see `motionenv.body.kinematics`) in other axes: their angles stay as they are.
* pelvis_tx, ty and tz place the model's pelvis frame, whose origin is between the anterior iliac spines, where the
  model's hips, scaled from its 1.70 m to the body's height, are midway the body's.
* The body is rigid from the pelvis to the shoulders: the lumbar coordinates are 0. It has no angles of the ankle, foot,
  forearm and wrist, and the model none of the neck: those are left out, and OpenSim takes the model's defaults.
* The model's knees and elbows bend about slightly oblique axes, the body's about one across the limb.
"""

from collections.abc import Iterator
from itertools import chain

import numpy as np

from motionenv._core.rotations import from_euler, to_euler, unwrap_euler
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.mocap.writers.common import (
    check_sequence,
    facing_x,
    opensim_axes,
    shown_segments,
    text_rows,
    without_missing,
)  # fmt: skip
from motionenv.types import POSE, Motion

_MODEL_HEIGHT = 1.70  # [m], of the generic model (Rajagopal et al. 2016)
_PELVIS_FROM_HIPS = np.array([0.056276, 0.0, 0.07849])  # [m] in the world's axes, of the generic model's hip joints


def encode(motion: Motion) -> Iterator[bytes]:
    """The bytes of an OpenSim coordinates file, a few hundred frames of the sequence (frames, 25) at a time.

    The walk is turned by the quarter turns that bring it to face x most, as in the .trc file of the same motion.
    OpenSim's `Storage` stops reading at a NaN: gaps in time are refused, and coordinates of limbs that are missing in
    every frame are left out.

    Raises:
        GapError: `motion` has gaps in time.
        MotionError: not one sequence.
    """
    check_sequence(motion, "MOT", gaps=False)
    shown = {segment for segment, known in zip(SEGMENTS, shown_segments(motion.poses), strict=True) if known}
    columns = _coordinates(facing_x(without_missing(motion)), shown)
    table = np.stack([*columns.values()], axis=1)
    lines = [
        "Coordinates", "version=1", f"nRows={len(table)}", f"nColumns={1 + len(columns)}", "inDegrees=yes", "",
        "Units are S.I. units (second, meters, Newtons, ...)", "Angles are in degrees.", "", "endheader",
        "\t".join(["time", *columns]),
    ]  # fmt: skip
    first = "".join(f"{line}\n" for line in lines).encode()
    row = "\t".join(["%.8f"] * (1 + len(columns))) + "\n"
    return chain([first], text_rows(table, 8, lambda i, values: row % (i / motion.fps, *values)))


def _coordinates(motion: Motion, shown: set[str]) -> dict[str, np.ndarray]:
    """The model's coordinates (frames,) [degrees, m] by name, of the segments `shown`."""
    columns = _pelvis(motion)
    for side in ("right", "left"):
        if f"{side}_thigh" in shown:
            columns |= _ball(motion, side, "hip", ("hip_flexion", "hip_adduction", "hip_rotation"))
        if f"{side}_shin" in shown:
            columns |= _hinge(motion, side, "knee", "knee_angle")
    columns |= dict.fromkeys(("lumbar_extension", "lumbar_bending", "lumbar_rotation"), np.zeros(len(motion.poses)))
    for side in ("right", "left"):
        if f"{side}_upper_arm" in shown:
            columns |= _ball(motion, side, "shoulder", ("arm_flex", "arm_add", "arm_rot"))
        if f"{side}_forearm" in shown:
            columns |= _hinge(motion, side, "elbow", "elbow_flex")
    return columns


def _pelvis(motion: Motion) -> dict[str, np.ndarray]:
    turned = from_euler("ZXY", motion.poses[:, [5, 4, 3]])
    angles = unwrap_euler(to_euler("YXZ", turned)) * [-1.0, 1.0, 1.0]  # the world's y is the ground's -z, its z is y
    offsets = motion.skeleton.offsets
    hips = 0.5 * (offsets[NODES.index("left_hip")] + offsets[NODES.index("right_hip")])
    origin = hips + _PELVIS_FROM_HIPS * (motion.skeleton.height / _MODEL_HEIGHT)
    place = opensim_axes(motion.poses[:, :3] + turned @ origin)
    names = "pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz"
    return dict(zip(names, [*np.degrees(angles).T, *place.T], strict=True))


def _ball(motion: Motion, side: str, joint: str, names: tuple[str, str, str]) -> dict[str, np.ndarray]:
    """Flexion, adduction and rotation of a hip or shoulder, continuous in time."""
    first = POSE.index(f"{side}_{joint}_flexion")
    angles = np.degrees(unwrap_euler(motion.poses[:, first : first + 3])) * [1.0, -1.0, 1.0]  # the body's is abduction
    return {f"{name}_{side[0]}": column for name, column in zip(names, angles.T, strict=True)}


def _hinge(motion: Motion, side: str, joint: str, name: str) -> dict[str, np.ndarray]:
    return {f"{name}_{side[0]}": np.degrees(motion.poses[:, POSE.index(f"{side}_{joint}_flexion")])}
