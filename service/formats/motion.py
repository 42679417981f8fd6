"""Motions as JSON, NPY and the file formats of `motionenv.write`."""

import io
from collections.abc import Iterator

import numpy as np

from motionenv.mocap import encode
from motionenv.types import POSE, Motion
from service.formats import FILES, JSON, NPY, dumps

_CHUNK = 1000  # frames encoded as JSON at a time


def parts(motion: Motion, media_type: str, model: str, seed: int) -> Iterator[bytes]:
    """Encode a motion (frames, 25) in a lossless format of `service.formats`, long ones in chunks."""
    if media_type == JSON:
        return _json(motion, model, seed)
    if media_type == NPY:
        return iter([_npy(motion)])
    return encode(motion, FILES[media_type])


def _json(motion: Motion, model: str, seed: int) -> Iterator[bytes]:
    """`service.schemas.synthesis.MotionResponse` as JSON; missing values are null."""
    body, poses = motion.skeleton, motion.poses
    whole = dumps({
        "model": model, "height": body.height, "pose": POSE, "offsets": body.offsets, "radii": body.radii,
        "seed": seed, "fps": motion.fps, "poses": poses[:_CHUNK],
    })  # fmt: skip
    if len(poses) <= _CHUNK:
        yield whole
        return
    yield whole[:-2]
    for start in range(_CHUNK, len(poses), _CHUNK):
        yield b"," + dumps(poses[start : start + _CHUNK])[1:-1]
    yield b"]}"


def _npy(motion: Motion) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, motion.poses, version=(1, 0), allow_pickle=False)
    return file.getvalue()
