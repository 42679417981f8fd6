"""Files of a lifted motion, with what is known of its certainty beside it."""

from pathlib import Path

import numpy as np

from motionenv.lifting.pipeline import Lifted
from motionenv.mocap import npz
from motionenv.mocap.writers import csv
from motionenv.mocap.writers.common import save
from motionenv.mocap.writing import write
from motionenv.types import MARKERS, Motion


def write_lifted(lifted: Lifted, motion: Motion, path: str | Path) -> None:
    """Write the `motion` of what was `lifted` as `motionenv.write` does, .npz and .csv with all that is known beside it.

    Raises:
        GapError: the motion has gaps in time, which the format can't represent.
        MotionError: another suffix, or the file can't be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".npz":
        npz.write(motion, path, known_of(lifted))
    elif suffix == ".csv":
        columns = {
            f"{name}_band_{axis}_m": lifted.band[:, i, k] for i, name in enumerate(MARKERS) for k, axis in enumerate("xyz")
        }  # fmt: skip
        columns |= {f"{name}_confidence": lifted.confidence[:, i] for i, name in enumerate(MARKERS)}
        save(csv.encode(motion, columns | {"unlike": lifted.unlike.astype(float)}), path)
    else:
        write(motion, path)


def known_of(lifted: Lifted) -> dict[str, np.ndarray]:
    """All that is known of a lifted motion, by name (`docs/file-formats.md`)."""
    fit = lifted.free or lifted.posterior
    assert fit is not None
    found = {
        "markers": np.array(MARKERS), "positions": lifted.positions, "deviations": fit.deviations, "band": lifted.band,
        "confidence": lifted.confidence, "unlike": lifted.unlike, "heading": lifted.heading, "contact": lifted.contact,
        "swapped": lifted.swapped, "weights": fit.weights, "misfit": np.array(fit.misfit),
        "plausible": np.array(lifted.plausible), "points": lifted.points.positions,
    }  # fmt: skip
    if lifted.free is not None:
        free = lifted.free
        found |= {
            "unit": np.array(free.unit), "unit_deviation": np.array(free.unit_deviation), "noise": np.array(free.noise),
            "origin": free.origin, "focal": np.array(free.focal), "focal_deviation": np.array(free.focal_deviation),
            "surprise": free.surprise,
        }  # fmt: skip
        if lifted.feet is not None:
            found["feet"] = lifted.feet
        if free.other is not None:
            found |= {"other_positions": free.other.positions, "other_probability": np.array(free.other.probability)}
    if lifted.posterior is not None:
        steady = lifted.posterior
        scalars = {"alpha": steady.alpha, "elevation": steady.elevation, "scale": steady.scale,
                   "frequency": steady.frequency, "alpha_deviation": steady.standard_deviation("alpha")}  # fmt: skip
        found |= {name: np.array(value) for name, value in scalars.items()} | {"coefficients": steady.coefficients}
    return found
