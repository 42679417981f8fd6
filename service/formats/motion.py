"""Motions as bytes."""

import io
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import orjson

from motionenv.mocap import encode
from motionenv.types import POSE, Motion
from service.formats import FILES, JSON, NPY

_OPTIONS = orjson.OPT_SERIALIZE_NUMPY
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
    body = motion.skeleton
    head = _head(model, body.height, body.offsets.tobytes(), body.radii.tobytes())
    yield b'%b,"seed":%d,"fps":%b,"poses":[' % (head, seed, orjson.dumps(motion.fps))
    for start in range(0, len(motion.poses), _TOGETHER):
        rows = orjson.dumps(motion.poses[start : start + _TOGETHER], option=_OPTIONS)[1:-1]
        yield rows if start == 0 else b"," + rows
    yield b"]}"


@lru_cache(maxsize=64)
def _head(model: str, height: float, offsets: bytes, radii: bytes) -> bytes:
    """What is the same in all motions of one body: the beginning of the object, without its end."""
    same = {
        "model": model, "height": height, "pose": POSE,
        "offsets": np.frombuffer(offsets).reshape(-1, 3), "radii": np.frombuffer(radii).reshape(-1, 2),
    }  # fmt: skip
    return orjson.dumps(same, option=_OPTIONS)[:-1]


def _npy(motion: Motion) -> bytes:
    """Poses (frames, 25) float64 as NPY."""
    file = io.BytesIO()
    np.lib.format.write_array(file, motion.poses, version=(1, 0), allow_pickle=False)
    return file.getvalue()
