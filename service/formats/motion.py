"""Motions as bytes."""

import io
import tempfile
from pathlib import Path

import numpy as np
import orjson

import motionenv
from motionenv.types import POSE, Motion
from service.formats import FILES, JSON, NPY

_OPTIONS = orjson.OPT_SERIALIZE_NUMPY


def as_json(motion: Motion, model: str, seed: int) -> bytes:
    """`service.schemas.synthesis.MotionResponse` as JSON; what is missing is null.

    Args:
        motion: (frames, 25).
        model: its name.
        seed: that it was made with.
    """
    body = motion.skeleton
    return orjson.dumps(
        {
            "model": model, "seed": seed, "fps": motion.fps, "height": body.height, "pose": POSE,
            "offsets": body.offsets, "radii": body.radii, "poses": motion.poses,
        },
        option=_OPTIONS,
    )  # fmt: skip


def as_npy(motion: Motion) -> bytes:
    """Poses (frames, 25) float64 as NPY."""
    file = io.BytesIO()
    np.save(file, motion.poses, allow_pickle=False)
    return file.getvalue()


def as_file(motion: Motion, media_type: str) -> bytes:
    """The file that `motionenv.write` makes of a motion.

    Args:
        motion: (frames, 25).
        media_type: one of `service.formats.FILES`.
    """
    with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
        path = Path(folder) / f"motion{FILES[media_type]}"
        motionenv.write(motion, path)
        return path.read_bytes()


def encoded(motion: Motion, media_type: str, model: str, seed: int) -> bytes:
    """A motion as any of the formats that hold all of it.

    Args:
        motion: (frames, 25).
        media_type: of `service.formats`.
        model: its name.
        seed: that it was made with.
    """
    if media_type == JSON:
        return as_json(motion, model, seed)
    return as_npy(motion) if media_type == NPY else as_file(motion, media_type)
