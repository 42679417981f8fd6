"""Motions as bytes."""

import io
from collections.abc import Iterator

import numpy as np

from motionenv.mocap import encode
from motionenv.types import POSE, Motion
from service.encoding import dumps
from service.formats import FILES, JSON, NPY

_TOGETHER = 1000  # frames made into JSON at a time


def parts(motion: Motion, media_type: str, model: str, seed: int) -> Iterator[bytes]:
    """A motion as any of the formats that hold all of it, long ones part by part.

    Args:
        motion: (frames, 25).
        media_type: of `service.formats`.
        model: its name.
        seed: that it was made with.
    """
    if media_type == JSON:
        return _json(motion, model, seed)
    if media_type == NPY:
        return iter([_npy(motion)])
    return encode(motion, FILES[media_type])


def _json(motion: Motion, model: str, seed: int) -> Iterator[bytes]:
    """`service.schemas.synthesis.MotionResponse` as JSON; what is missing is null."""
    body, poses = motion.skeleton, motion.poses
    whole = dumps({
        "model": model, "height": body.height, "pose": POSE, "offsets": body.offsets, "radii": body.radii,
        "seed": seed, "fps": motion.fps, "poses": poses[:_TOGETHER],
    })  # fmt: skip
    if len(poses) <= _TOGETHER:
        yield whole
        return
    yield whole[:-2]
    for start in range(_TOGETHER, len(poses), _TOGETHER):
        yield b"," + dumps(poses[start : start + _TOGETHER])[1:-1]
    yield b"]}"


def _npy(motion: Motion) -> bytes:
    """Poses (frames, 25) float64 as NPY."""
    file = io.BytesIO()
    np.lib.format.write_array(file, motion.poses, version=(1, 0), allow_pickle=False)
    return file.getvalue()
