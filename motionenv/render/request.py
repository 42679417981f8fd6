"""Validation and batching of the arguments of both renderers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv.errors import MotionError
from motionenv.types import Camera, Frame, Skeleton


@dataclass(frozen=True, eq=False)
class Batch:
    """Images to render, flattened to one batch axis."""

    poses: np.ndarray  # (n, 25) [m, rad], NaN where unknown
    cameras: tuple[Camera, ...]  # the distinct cameras, all of one image size
    which: np.ndarray  # (n,) index into `cameras`
    shape: tuple[int, ...]  # the original batch axes; n is their product

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of every image [pixels]."""
        return self.cameras[0].height, self.cameras[0].width

    def empty(self, rgb: bool) -> Frame:
        """An uninitialised frame of the right shape."""
        return empty_frame((*self.shape, *self.size), rgb)

    def flat(self, frame: Frame) -> Frame:
        """`frame` with one batch axis, sharing its memory; errors as of `check_frame`."""
        check_frame(frame, (*self.shape, *self.size))
        shape = (len(self.poses), *self.size)
        rgb = None if frame.rgb is None else frame.rgb.reshape(*shape, 3)
        return Frame(rgb, frame.depth.reshape(shape), frame.limbs.reshape(shape))


def empty_frame(shape: tuple[int, ...], rgb: bool) -> Frame:
    """An uninitialised frame of images of `shape` (..., height, width), with colours if `rgb`."""
    picture = np.empty((*shape, 3), np.uint8) if rgb else None
    return Frame(picture, np.empty(shape, np.float32), np.empty(shape, np.uint8))


def check_frame(frame: Frame, shape: tuple[int, ...]) -> None:
    """Raise a MotionError unless `frame` can be overwritten with images of `shape` (..., height, width)."""
    for name, dtype, tail in (("rgb", np.uint8, (3,)), ("depth", np.float32, ()), ("limbs", np.uint8, ())):
        array, whole = getattr(frame, name), shape + tail
        if array is not None and (array.shape != whole or array.dtype != dtype or not array.flags.c_contiguous):
            raise MotionError(
                f"out.{name} must be a contiguous {np.dtype(dtype)} array of shape {whole}, "
                f"got {array.dtype} {array.shape}"
            )


def batch(poses: ArrayLike, skeleton: Skeleton, cameras: Camera | Sequence[Camera]) -> Batch:
    """Validate and flatten the arguments of `motionenv.render.render`.

    Poses (..., 25) and cameras broadcast like NumPy arrays: one camera serves every pose; a sequence of n cameras is
    matched with the last batch axis of the poses (n poses, or one pose seen n times).

    Raises:
        MotionError: a pose has infinite values, shapes don't broadcast, or cameras differ in image size.
    """
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim == 0 or poses.shape[-1] != 25:
        raise MotionError(f"poses must have shape (..., 25), got {poses.shape}")
    if np.isinf(poses).any():
        bad = tuple(int(i) for i in np.argwhere(np.isinf(poses))[0])
        raise MotionError(f"poses must be finite, or NaN where unknown; poses{list(bad)} is {poses[bad]}")
    views = _checked(cameras)
    lead = poses.shape[:-1]
    grid = () if isinstance(cameras, Camera) else (len(views),)
    try:
        shape = np.broadcast_shapes(lead, grid)
    except ValueError:
        raise MotionError(
            f"cameras must be one camera, or one per pose; got {len(views)} for poses of batch shape {lead}"
        ) from None
    which = np.broadcast_to(np.arange(len(views)).reshape(grid), shape).reshape(-1)
    flat = np.ascontiguousarray(np.broadcast_to(poses, (*shape, 25)).reshape(-1, 25))
    return Batch(flat, views, which, shape)


def enlarged(camera: Camera, samples: int) -> Camera:
    """The same view with `samples` × `samples` pixels for each one."""
    k = camera.K.copy()
    k[:2] *= samples
    k[:2, 2] += (samples - 1) / 2  # pixel centres are at integers; keep the image's corner fixed
    return Camera(k, camera.R, camera.t, camera.width * samples, camera.height * samples)


def _checked(cameras: Camera | Sequence[Camera]) -> tuple[Camera, ...]:
    """The cameras as a tuple, all of one size and with an intrinsic matrix whose last row is (0, 0, 1)."""
    views = (cameras,) if isinstance(cameras, Camera) else tuple(cameras)
    if not views or not all(isinstance(c, Camera) for c in views):
        raise MotionError("cameras must be a Camera or a sequence of at least one")
    for camera in views:
        if (camera.width, camera.height) != (views[0].width, views[0].height):
            raise MotionError("cameras of one call must have the same image size: render other sizes in another call")
        if not np.array_equal(camera.K[2], (0, 0, 1)) or abs(np.linalg.det(camera.K)) < 1e-12:
            raise MotionError(f"Camera.K must be invertible with last row (0, 0, 1), got {camera.K.tolist()}")
    return views
