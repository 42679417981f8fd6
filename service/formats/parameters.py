"""Numbers of a model as one block of bytes that a browser reads without a library.

    uint32 little-endian   n, bytes of the header
    n bytes                the header, JSON in UTF-8, padded with spaces so that what follows begins at a multiple of 8
    float64 little-endian  all arrays, one after the other, rows first

The header holds the description of `motionenv.models.parameters` and `arrays`: name → `shape` and `offset` [numbers].
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import orjson

MEDIA_TYPE = "application/x-motionenv-parameters"


def packed(arrays: Mapping[str, np.ndarray], description: Mapping[str, Any]) -> bytes:
    """Numeric arrays by name, and a description that JSON can hold, as bytes."""
    places, offset = {}, 0
    for name, array in arrays.items():
        places[name] = {"shape": array.shape, "offset": offset}
        offset += math.prod(array.shape)
    header = orjson.dumps({**description, "arrays": places})
    header += b" " * (-(len(header) + 4) % 8)
    numbers = [np.asarray(array, dtype="<f8").tobytes() for array in arrays.values()]
    return b"".join([len(header).to_bytes(4, "little"), header, *numbers])
