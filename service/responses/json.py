"""JSON with NumPy arrays; NaN becomes null."""

from typing import Any

import numpy as np
import orjson


def dumps(value: Any) -> bytes:
    """`value` of dicts, lists, text, numbers, None and NumPy's arrays and scalars as JSON, arrays as lists."""
    return orjson.dumps(value, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)


def _plain(value: Any) -> Any:
    """Convert what orjson can't: arrays that aren't contiguous or of another type."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} can't be JSON")
