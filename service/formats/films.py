"""Motions as videos and pictures."""

import math
import tempfile
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import motionenv
from motionenv.render import film, picture
from motionenv.render.video.encode import png
from motionenv.types import Motion
from service.formats import FILMS, MP4, PNG
from service.schemas.synthesis import Picture


def parts(motion: Motion, asked: Picture, media_type: str, gone: threading.Event) -> Iterator[bytes]:
    """Encode a motion in one of `service.formats.FILMS`; MP4 yields a chunk after each frame.

    Raises:
        Disconnected: `gone` was set while a GIF or WebP was rendered.
    """
    how = arguments(asked)
    if media_type == PNG:
        yield png(picture(motion, asked.frame, **how))
    elif media_type == MP4:
        yield from motionenv.stream_video(film(motion, **how), motion.fps)
    else:
        with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
            path = Path(folder) / f"film{FILMS[media_type]}"
            motionenv.write_video(path, _until_disconnect(film(motion, **how), gone), motion.fps)
            yield path.read_bytes()


def arguments(asked: Picture) -> dict[str, Any]:
    """Arguments of `motionenv.film`."""
    return {
        "alpha": math.radians(asked.view), "elevation": math.radians(asked.elevation), "width": asked.width,
        "height": asked.height, "points": asked.style == "points", "colour": tuple(asked.colour),
        "background": None if asked.background is None else tuple(asked.background),
        "follow": asked.follow,
    }  # fmt: skip


class Disconnected(Exception):
    """The client disconnected while its video was rendered."""


def _until_disconnect(frames: Iterable[np.ndarray], gone: threading.Event) -> Iterator[np.ndarray]:
    for frame in frames:
        if gone.is_set():
            raise Disconnected
        yield frame
