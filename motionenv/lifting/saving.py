"""Files of a lifted motion, with what is known of its certainty beside it."""

from pathlib import Path

import numpy as np

from motionenv.lifting.pipeline import Lifted
from motionenv.mocap import npz
from motionenv.mocap.writers import csv
from motionenv.mocap.writers.common import save
from motionenv.mocap.writing import write
from motionenv.types import MARKERS, Motion

_OF_BOTH = (
    "positions", "band", "confidence", "unlike", "heading", "contact", "swapped", "misfit", "plausible", "feet",
)  # fmt: skip
_OF_FREE = (
    "deviations", "weights", "unit", "unit_deviation", "noise", "origin", "focal", "focal_deviation", "surprise",
)  # fmt: skip


def write_lifted(lifted: Lifted, motion: Motion, path: str | Path) -> None:
    """Write the `motion` of what was `lifted` as `motionenv.write` does; .npz and .csv also tell how certain it is.

    Raises:
        GapError: the motion has gaps in time, which the format can't represent.
        MotionError: another suffix, or the file can't be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".npz":
        npz.write(motion, path, known_of(lifted))
    elif suffix == ".csv":
        names = [f"{name}_band_{axis}_m" for name in MARKERS for axis in "xyz"]
        columns = dict(zip(names, lifted.band.reshape(len(lifted.band), -1).T, strict=True))
        columns |= dict(zip((f"{name}_confidence" for name in MARKERS), lifted.confidence.T, strict=True))
        save(csv.encode(motion, columns | {"unlike": lifted.unlike.astype(float)}), path)
    else:
        write(motion, path)


def known_of(lifted: Lifted) -> dict[str, np.ndarray]:
    """All that is known of a lifted motion, by name (`docs/file-formats.md`)."""
    found = {name: getattr(lifted, name) for name in _OF_BOTH} | {"points": lifted.points.positions}
    found |= {name: getattr(lifted.free, name) for name in _OF_FREE}
    if (other := lifted.free.other) is not None:
        found |= {"other_positions": other.positions, "other_probability": other.probability}
    return {name: np.asarray(value) for name, value in found.items() if value is not None}
