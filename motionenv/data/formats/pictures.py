"""Pictures and arrays as bytes: the same input gives the same bytes."""

import io
import zipfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import numpy as np
from PIL import Image

from motionenv.data.samples import Sample

Result = TypeVar("Result")

_FAST = 1  # zlib's level: twice the speed of the usual one for a tenth more bytes
_QUALITY = 92  # of JPEG
_OPTIONS = {
    "png": {"compress_level": _FAST},
    "webp": {"lossless": True, "quality": 0, "method": 0},
    "jpeg": {"quality": _QUALITY, "subsampling": 0},
}
_AHEAD = 64  # frames that may wait for the encoder
#: Suffix of each encoding of `Output.picture`.
SUFFIX = {"png": "png", "webp": "webp", "jpeg": "jpg"}


def encoded(picture: np.ndarray, how: str) -> bytes:
    """A picture (height, width, 3) or (height, width) uint8 as a file, `how`: "png", "webp" (lossless) or "jpeg"."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, how, **_OPTIONS[how])
    return file.getvalue()


def packed(**arrays: np.ndarray) -> bytes:
    """An NPZ file of `arrays`, exact and compressed, without the time at which it was made."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=_FAST) as archive:
        for name, values in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(values), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), zipfile.ZIP_DEFLATED, _FAST)
    return file.getvalue()


def while_drawing(
    work: Callable[[Sample], Result], samples: Iterator[Sample], clip: int
) -> Iterator[tuple[Sample, Result]]:
    """Samples of `clip` frames and what `work` makes of them, in order; another thread works while they are drawn."""
    waiting: deque[tuple[Sample, Future]] = deque()
    most = max(1, _AHEAD // clip)
    with ThreadPoolExecutor(1, thread_name_prefix="encoder") as encoder:
        for sample in samples:
            waiting.append((sample, encoder.submit(work, sample)))
            while waiting and (len(waiting) > most or waiting[0][1].done()):
                first, made = waiting.popleft()
                yield first, made.result()
        for first, made in waiting:
            yield first, made.result()
