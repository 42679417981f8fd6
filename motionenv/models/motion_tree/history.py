"""The last frames of a motion to continue, scaled to the body of a database."""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.models.motion_tree.database import Database, leg_length
from motionenv.models.motion_tree.features import FPS, WINDOW, parameters
from motionenv.types import Motion, frozen


@dataclass(frozen=True, eq=False)
class Recent:
    """A history scaled to the database's body."""

    parameters: np.ndarray  # (..., 10, 50) parameters of the last ten frames
    last: np.ndarray  # (..., 25) the last pose
    scale: float  # factor from the history's lengths to the database's


#: What went before: a motion, or its poses (..., frames, 25).
History = Motion | np.ndarray


def recent_frames(history: History, database: Database) -> Recent:
    """Parameters of a history's last frames, (..., frames, 25) at 30 frames/s, scaled to the body of a database.

    Raises:
        MotionError: fewer than ten frames, another shape or rate, or NaN.
    """
    poses, scale = _checked(history, database)
    if scale != 1.0:
        poses = poses.copy()
        poses[..., :3] *= scale
    return Recent(parameters(poses)[..., -WINDOW:, :], poses[..., -1, :], scale)


def _checked(history, database: Database) -> tuple[np.ndarray, float]:
    """The last frames (..., 10 to 12, 25) of a history, and the factor from its lengths to the database's."""
    scale = 1.0
    if isinstance(history, Motion):
        if not np.isclose(history.fps, FPS, rtol=1e-6):
            raise MotionError(
                f"history must be at {FPS:g} frames/s, got {history.fps:g}: see motionenv.models.motion_tree.resample"
            )
        scale = leg_length(database.skeleton) / leg_length(history.skeleton)
        history = history.poses
    poses = frozen(history, (..., None, 25), "history")
    if poses.shape[-2] < WINDOW:
        raise MotionError(f"history must have shape (..., {WINDOW} or more frames, 25), got {poses.shape}")
    recent = poses[..., -WINDOW - 2 :, :]
    if not np.isfinite(recent).all():
        raise MotionError(
            f"history has NaN or infinite values in its last {recent.shape[-2]} frames: fill the gap or start after it"
        )
    return recent, scale
