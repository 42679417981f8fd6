"""Capture files as people ask for them: as a motion of the body, or in words."""

from pathlib import Path

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap.reading import read
from motionenv.mocap.retargeting import retarget
from motionenv.types import Motion


def read_motion(path, *, fps: float | None = None, unit: str | None = None) -> Motion:
    """The motion in a file: ours as it is, capture retargeted to the body.

    Args:
        path: .npz, .amc, .bvh, .c3d or .trc.
        fps: frames per second, where the file doesn't say.
        unit: unit of length, where the file doesn't say.

    Raises:
        MotionError: as `motionenv.read` and `motionenv.retarget`.
    """
    loaded = read(path, fps=fps, unit=unit)
    if isinstance(loaded, Motion):
        return loaded
    try:
        return retarget(loaded)
    except MotionError as error:
        raise type(error)(f"{path}: {error}") from error


def describe(path, *, fps: float | None = None, unit: str | None = None) -> str:
    """What a capture file holds, in a few lines.

    Args:
        path: the file.
        fps: frames per second, where the file doesn't say.
        unit: unit of length, where the file doesn't say.

    Raises:
        MotionError: as `motionenv.read`.
    """
    held = read(path, fps=fps, unit=unit)
    if isinstance(held, Motion):
        points, values = "the 25-DOF body", held.poses
    else:
        points, values = f"{len(held.names)} points: {', '.join(held.names)}", held.positions
    frames = values.shape[-2] if isinstance(held, Motion) else values.shape[-3]
    gaps = float(np.isnan(values).mean())
    return (
        f"{Path(path).name}: {frames} frames, {frames / held.fps:.2f} s at {held.fps:g} fps, gaps {gaps:.1%}\n{points}"
    )
