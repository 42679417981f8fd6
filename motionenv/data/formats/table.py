"""Truth as a Parquet table: a row per sample, arrays as nested lists."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from motionenv.data.samples import Sample
from motionenv.data.specification import PICTURES

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
