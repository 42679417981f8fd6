"""Clips from a folder of capture files, with labels from the file names."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from motionenv.body.gaps import PARTS, check_shown
from motionenv.errors import MotionError
from motionenv.mocap import SUFFIXES, MarkerMap, person_label, read_motion
from motionenv.models import filling
from motionenv.models.motion_tree.database import Clip

_BANDAI = re.compile(r"dataset-\d+_(?P<activity>[^_]+)_(?P<style>[^_]+)_\d+")


def read_clips(
    folder: str | Path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | None = None,
    activity: str | None = None, fill: bool = False, on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> Iterator[Clip]:  # fmt: skip
    """Yield every capture file below `folder` as a clip, read one at a time.

    Bandai-Namco's file names give the activity and the style, which is used as the person's label. For other files, the
    activity is the folder's name, and the person is the file's name up to the first "_", as in CMU's trials.

    Args:
        folder: searched with its subfolders for AMC, BVH, C3D, NPZ and TRC files.
        fps: frames per second, for files that don't state it.
        unit: unit of length, for files that don't state it.
        marker_map: which points of the files are which landmarks; None recognises them by their names.
        activity: activity of all files; None takes it from the names.
        fill: whether to fill what the capture doesn't show (`motionenv.fill`); otherwise captures of part of the body
            are left out.
        on_file: called with each file's name before it is read.
        on_left_out: called with name and reason of each file that can't be read or retargeted, or doesn't show the
            whole body.

    Raises:
        MotionError: there is no such folder, or no capture in it.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in SUFFIXES)
    if not paths:
        raise MotionError(f"no AMC, BVH, C3D, NPZ or TRC file below {folder}: name a folder of motion capture")
    for path in paths:
        on_file(path.name)
        try:
            motion = read_motion(path, fps=fps, unit=unit, marker_map=marker_map, override=False)
            motion = filling.fill(motion) if fill else motion
            check_shown(motion.poses, PARTS, "a clip")
        except MotionError as error:
            on_left_out(path.name, str(error))
            continue
        known = _BANDAI.fullmatch(path.stem)
        done = known["activity"] if known else path.parent.name
        person = known["style"] if known else person_label(path)
        yield Clip(motion, path.name, activity or done, person)
