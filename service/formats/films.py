"""Motions as pictures: one of them, or a film."""

import math
import tempfile
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import motionenv
from motionenv.render import film, picture
from motionenv.render.video import png
from motionenv.types import Motion
from service.formats import FILMS, MP4, PNG
from service.schemas.synthesis import Picture


def parts(motion: Motion, asked: Picture, media_type: str, gone: threading.Event) -> Iterator[bytes]:
    """A motion as a video or as one picture of it; MP4 part by part while it is drawn, after each frame a part.

    Args:
        motion: (frames, 25).
        asked: how it is shown.
        media_type: one of `service.formats.FILMS`.
        gone: says that nobody waits for it any more.

    Raises:
        EngineError: the engine can't run here.
    """
    how = arguments(asked)
    if media_type == PNG:
        yield png(picture(motion, asked.frame, **how))
    elif media_type == MP4:
        yield from motionenv.stream_video(film(motion, **how), motion.fps)
    else:
        with tempfile.TemporaryDirectory(prefix="motionenv-") as folder:
            path = Path(folder) / f"film{FILMS[media_type]}"
            motionenv.write_video(path, _while_wanted(film(motion, **how), gone), motion.fps)
            yield path.read_bytes()


def arguments(asked: Picture) -> dict[str, Any]:
    """Arguments of `motionenv.film`.

    Args:
        asked: how a motion is shown.
    """
    return {
        "alpha": math.radians(asked.view), "elevation": math.radians(asked.elevation), "width": asked.width,
        "height": asked.height, "points": asked.style == "points", "colour": tuple(asked.colour),
        "background": None if asked.background is None else tuple(asked.background), "engine": asked.engine,
        "follow": asked.follow,
    }  # fmt: skip


class Unwanted(Exception):
    """The client went while its film was being drawn."""


def _while_wanted(frames: Iterable[np.ndarray], gone: threading.Event) -> Iterator[np.ndarray]:
    """`frames`, as long as somebody waits for them.

    Raises:
        Unwanted: nobody does.
    """
    for frame in frames:
        if gone.is_set():
            raise Unwanted
        yield frame
