"""Clips from a folder of capture files, with tags read from their names."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from motionenv.errors import MotionError
from motionenv.mocap import read_motion
from motionenv.models.tree.database import Clip

_SUFFIXES = {".amc", ".bvh", ".c3d", ".npz", ".trc"}
_BANDAI = re.compile(r"dataset-\d+_(?P<activity>[^_]+)_(?P<style>[^_]+)_\d+")


def read_clips(
    folder,
    *,
    fps: float | None = None,
    unit: str | None = None,
    activity: str | None = None,
    on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> Iterator[Clip]:
    """Every capture file below `folder` as a clip, read one at a time.

    Bandai-Namco's names give activity and style (the style stands for the person, who isn't named); of others the
    folder is the activity, and the name up to the first "_" the person, as CMU numbers its trials.

    Args:
        folder: searched with its subfolders for AMC, BVH, C3D, NPZ and TRC.
        fps: frames per second, where the files don't say.
        unit: unit of length, where the files don't say.
        activity: what is done in all of them; None takes it from the names.
        on_file: called with each file's name before it is read.
        on_left_out: called with name and reason of each file that can't be read or retargeted.

    Raises:
        MotionError: there is no such folder, or no capture in it.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in _SUFFIXES)
    if not paths:
        raise MotionError(f"no AMC, BVH, C3D, NPZ or TRC file below {folder}: name a folder of motion capture")
    for path in paths:
        on_file(path.name)
        says = {".c3d", ".npz"}
        try:
            motion = read_motion(
                path,
                fps=None if path.suffix.lower() in says else fps,
                unit=None if path.suffix.lower() == ".npz" else unit,
            )
        except MotionError as error:
            on_left_out(path.name, str(error))
            continue
        known = _BANDAI.fullmatch(path.stem)
        done = known["activity"] if known else path.parent.name
        person = known["style"] if known else path.stem.partition("_")[0]
        yield Clip(motion, path.name, activity or done, person)
