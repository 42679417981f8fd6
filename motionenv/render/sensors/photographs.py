"""Photographs as backgrounds: a bank of them, and the user's own."""

import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from motionenv.errors import MotionError

_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp")


def photograph_files(folder: str) -> tuple[Path, ...]:
    """The photographs below a `folder`, in the order of their names.

    Raises:
        MotionError: no such folder, or one without photographs.
    """
    files = sorted(file for file in Path(folder).rglob("*") if file.suffix.lower() in _SUFFIXES)
    if not files:
        raise MotionError(f"background must be plain, clutter or a folder of photographs (.jpg ...), got {folder!r}")
    return tuple(files)


class Bank:
    """Photographs of one size, made when requested.

    `pictures`, uint8 (photographs, height, 3 · width, 3), are horizontally periodic after two widths, so that a camera
    can pan indefinitely; `make` makes one of them.
    """

    def __init__(self, count: int, width: int, height: int, make: Callable[[int], np.ndarray]) -> None:
        self.pictures = np.zeros((count, height, 3 * width, 3), np.uint8)
        self._make, self._made = make, set[int]()
        self._lock = threading.Lock()

    def get(self, which: int) -> int:
        """Make photograph `which` if necessary; returns `which`."""
        with self._lock:
            if which not in self._made:
                self.pictures[which] = self._make(which)
                self._made.add(which)
        return which


@cache
def own_photographs(files: tuple[Path, ...], width: int, height: int) -> Bank:
    """The process's bank of photographs in `files`, for images of that size [pixels].

    A photograph fills the image, and what sticks out is cut off; its mirror image follows. `Bank.get` raises a
    MotionError for a damaged file.
    """

    def make(which: int) -> np.ndarray:
        view = _fitted(files[which], width, height)
        return np.concatenate([view, view[:, ::-1], view], axis=1)

    return Bank(len(files), width, height, make)


def _fitted(file: Path, width: int, height: int) -> np.ndarray:
    from PIL import Image, ImageOps

    try:
        with Image.open(file) as image:
            upright = ImageOps.exif_transpose(image).convert("RGB")
            return np.asarray(ImageOps.fit(upright, (width, height)))
    except (OSError, Image.DecompressionBombError) as error:
        raise MotionError(f"{file} can't be read as a photograph: {error}") from None
