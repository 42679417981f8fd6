"""Pictures, arrays and tables as files: the same input gives the same bytes."""

import io
import zipfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from PIL import Image

from motionenv.data.samples import Sample
from motionenv.data.specification import PICTURES

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


if TYPE_CHECKING:
    import pyarrow

_ROWS = 1024  # in a group of the file


class Table:
    """Rows of samples, whose arrays have the same shape in each row."""

    def __init__(self) -> None:
        self._columns: dict[str, list[Any]] = {}

    def add(self, sample: Sample, more: dict[str, Any] | None = None) -> None:
        """Append all of a `sample` but its pictures, and the values of `more` columns."""
        for name, value in ((more or {}) | sample).items():
            if name not in PICTURES:
                self._columns.setdefault(name, []).append(value)

    def write(self, path: Path) -> None:
        """Write the rows to a Parquet file at `path`; the same rows give the same bytes."""
        import pyarrow.parquet as parquet

        parquet.write_table(self.arrow(), path, compression="zstd", row_group_size=_ROWS)

    def arrow(self) -> "pyarrow.Table":
        """The rows as a `pyarrow.Table`."""
        import pyarrow

        return pyarrow.table(
            {
                name: pyarrow.array(values) if isinstance(values[0], str) else column(np.stack(values))
                for name, values in self._columns.items()
            }
        )


def column(values: np.ndarray) -> "pyarrow.Array":
    """A column of `values` (rows, ...), as nested lists of fixed length."""
    import pyarrow

    made = pyarrow.array(values.reshape(-1))
    for size in values.shape[:0:-1]:
        made = pyarrow.FixedSizeListArray.from_arrays(made, size)
    return made
