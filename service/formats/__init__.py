"""Media types, content negotiation by the Accept header (RFC 9110, section 12.5.1), and JSON with NumPy arrays."""

from collections.abc import Iterable
from typing import Any

import mimeparse
import numpy as np
import orjson

from service.errors import Problem

JSON = "application/json"
NPY = "application/x-npy"
NPZ = "application/x-npz"
CSV = "text/csv"
BVH = "model/x-bvh"
TRC, MOT = "text/x-trc", "text/x-mot"
HTML = "text/html"
ZIP = "application/zip"
MP4, GIF, WEBP, PNG = "video/mp4", "image/gif", "image/webp", "image/png"
#: Suffixes of the formats that `motionenv.write` writes.
FILES = {
    NPZ: ".npz", CSV: ".csv", BVH: ".bvh", "model/gltf-binary": ".glb", "application/x-c3d": ".c3d", TRC: ".trc",
    MOT: ".mot",
}  # fmt: skip
#: Suffixes of the formats of a gait report.
REPORTS = {HTML: ".html", JSON: ".json", CSV: ".csv"}
#: Suffixes of videos and pictures.
FILMS = {MP4: ".mp4", GIF: ".gif", WEBP: ".webp", PNG: ".png"}
MOTION = (JSON, NPY, *FILES, *FILMS)


def negotiated(accept: str | None, offered: Iterable[str]) -> str:
    """The media type of the response: the first of those offered that the header `accept` prefers; 406 if none."""
    offered = list(offered)
    if not accept or accept == "*/*":
        return offered[0]
    if accept in offered:
        return accept
    try:
        best = mimeparse.best_match(offered[::-1], accept)
    except (mimeparse.MimeTypeParseException, ValueError):
        best = ""
    if not best:
        raise Problem(406, f"Accept must allow one of {', '.join(offered)}")
    return best


def dumps(value: Any) -> bytes:
    """`value` of dicts, lists, text, numbers, None and NumPy's arrays and scalars as JSON; NaN becomes null."""
    return orjson.dumps(value, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):  # orjson takes contiguous arrays only, and not all types
        return value.tolist()
    raise TypeError(f"{type(value).__name__} can't be JSON")
