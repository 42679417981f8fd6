"""The user's own photographs as backgrounds."""

import threading
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
        raise MotionError(
            f"background must be plain, clutter or a folder of photographs ({', '.join(_SUFFIXES)}), got {folder!r}"
        )
    return tuple(files)


class OwnBank:
    """Photographs of a folder as images of one size, read when requested.

    `pictures`, uint8 (photographs, height, 3 · width, 3), holds each one, its mirror image, and it again: horizontally
    periodic, so that a camera can pan indefinitely. A photograph fills the image, and what sticks out is cut off.
    """

    def __init__(self, files: tuple[Path, ...], width: int, height: int) -> None:
        self.files, self.width, self.height = files, width, height
        self.pictures = np.zeros((len(files), height, 3 * width, 3), np.uint8)
        self._read: set[int] = set()
        self._lock = threading.Lock()

    def get(self, which: int) -> int:
        """Read photograph `which` if necessary; returns `which`.

        Raises:
            MotionError: a damaged file.
        """
        with self._lock:
            if which not in self._read:
                view = _fitted(self.files[which], self.width, self.height)
                self.pictures[which] = np.concatenate([view, view[:, ::-1], view], axis=1)
                self._read.add(which)
        return which


@cache
def own_photographs(files: tuple[Path, ...], width: int, height: int) -> OwnBank:
    """The process's bank of photographs for images of that size [pixels]."""
    return OwnBank(files, width, height)


def _fitted(file: Path, width: int, height: int) -> np.ndarray:
    from PIL import Image, ImageOps

    try:
        with Image.open(file) as image:
            upright = ImageOps.exif_transpose(image).convert("RGB")
            return np.asarray(ImageOps.fit(upright, (width, height)))
    except (OSError, Image.DecompressionBombError) as error:
        raise MotionError(f"{file} can't be read as a photograph: {error}") from None
