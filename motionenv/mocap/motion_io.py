"""Read capture files as a motion of the body, or summarise them."""

from pathlib import Path

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap.marker_sets import MarkerMap
from motionenv.mocap.reading import read
from motionenv.mocap.retargeting import retarget
from motionenv.types import Motion


def read_motion(
    path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | str | None = None
) -> Motion:
    """Read the motion in a file; capture is retargeted to the body.

    Args:
        path: .npz, .amc, .bvh, .c3d or .trc.
        fps: frame rate, if the file doesn't specify it.
        unit: unit of length, if the file doesn't specify it.
        marker_map: which points are which landmarks; see `motionenv.retarget`.

    Raises:
        MotionError: as in `motionenv.read` and `motionenv.retarget`.
    """
    loaded = read(path, fps=fps, unit=unit)
    if isinstance(loaded, Motion):
        return loaded
    try:
        return retarget(loaded, marker_map=marker_map)
    except MotionError as error:
        raise type(error)(f"{path}: {error}") from error


def describe(path, *, fps: float | None = None, unit: str | None = None) -> str:
    """Summary of a capture file, in a few lines.

    Args:
        path: the file.
        fps: frame rate, if the file doesn't specify it.
        unit: unit of length, if the file doesn't specify it.

    Raises:
        MotionError: as in `motionenv.read`.
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
