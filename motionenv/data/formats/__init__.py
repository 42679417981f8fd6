"""File formats of data sets."""

from motionenv.data.formats.base import Format
from motionenv.data.formats.coco import Coco
from motionenv.data.formats.webdataset import WebDataset
from motionenv.errors import MotionError

#: Formats by name.
FORMATS: dict[str, type[Format]] = {kind.name: kind for kind in (WebDataset, Coco)}


def format_of(name: str) -> Format:
    """The format `name`, one of `FORMATS`; otherwise raises MotionError."""
    if name not in FORMATS:
        raise MotionError(f"format must be one of {', '.join(FORMATS)}, got {name!r}")
    return FORMATS[name]()


__all__ = ["FORMATS", "Format", "format_of"]
