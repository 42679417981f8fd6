"""Read clips from a folder of motion capture, with labels from the names; fit a motion tree to them; its card."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from motionenv import __version__
from motionenv.body.gaps import PARTS, check_shown
from motionenv.errors import MotionError
from motionenv.mocap import SUFFIXES, MarkerMap, person_label, read, retarget
from motionenv.mocap.plausibility import check_plausible
from motionenv.models import filling
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.features import WINDOW
from motionenv.models.motion_tree.model import MotionTree
from motionenv.types import Motion

_BANDAI = re.compile(r"dataset-\d+_(?P<activity>[^_]+)_(?P<style>[^_]+)_\d+")


def read_clips(
    folder: str | Path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | None = None,
    activity: str | None = None, fill: bool = False, up: str | None = None, person: str | None = None,
    on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> Iterator[Clip]:  # fmt: skip
    """Yield every capture file below `folder` as a clip, read one at a time.

    Bandai-Namco's file names give the activity and the style, which is used as the person's label. For other files, the
    activity is the folder's name, and the person is the file's name up to the first "_", as in CMU's trials.

    Args:
        folder: searched with its subfolders for files of `motionenv.mocap.SUFFIXES`.
        fps: frames per second, for files that don't state it.
        unit: unit of length, for files that don't state it.
        marker_map: which points of the files are which landmarks; None recognises them by their names.
        activity: activity of all files; None takes it from the names.
        fill: whether to fill what the capture doesn't show (`motionenv.fill`); otherwise captures of part of the body
            are left out.
        up, person: vertical axis, and the one of several people in a file, as of `motionenv.read`.
        on_file: called with each file's name before it is read.
        on_left_out: called with name and reason of each file that can't be read or retargeted, or doesn't show the
            whole body.

    Raises:
        MotionError: there is no such folder, or no capture in it.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in SUFFIXES)
    if not paths:
        raise MotionError(f"no capture ({', '.join(sorted(SUFFIXES))}) below {folder}: name a folder of motion capture")
    for path in paths:
        on_file(path.name)
        try:
            capture = read(path, fps=fps, unit=unit, up=up, person=person, override=False)
            check_plausible(capture, marker_map)
            motion = capture if isinstance(capture, Motion) else retarget(capture, marker_map=marker_map)
            motion = filling.fill(motion) if fill else motion
            check_shown(motion.poses, PARTS, "a clip")
        except MotionError as error:
            on_left_out(path.name, str(error))
            continue
        known = _BANDAI.fullmatch(path.stem)
        done = known["activity"] if known else path.parent.name
        person = known["style"] if known else person_label(path)
        yield Clip(motion, path.name, activity or done, person)


def fit_tree(
    folder: Path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | None = None,
    activity: str | None = None, mirrored: bool = False, fill: bool = False, up: str | None = None,
    person: str | None = None, command: str = "",
    on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> MotionTree:  # fmt: skip
    """Fit a tree to all capture below a folder.

    Args:
        folder, fps, unit, marker_map, activity, fill, up, person, on_file: as of
            `motionenv.models.motion_tree.read_clips`.
        mirrored: also include the left-right mirror image of every clip.
        command: the command line to record in the card.
        on_left_out: called with name and reason of each file that is not used.

    Raises:
        MotionError: the folder has no capture, or none that can be used.
    """
    left_out: dict[str, str] = {}

    def leave_out(name: str, why: str) -> None:
        left_out[name] = why
        on_left_out(name, why)

    clips = read_clips(
        folder, fps=fps, unit=unit, marker_map=marker_map, activity=activity, fill=fill, up=up, person=person,
        on_file=on_file, on_left_out=leave_out,
    )  # fmt: skip
    short = f"has no {WINDOW + 1} contiguous frames at 30 frames/s"
    try:
        database = build_database(clips, mirrored=mirrored, on_short=lambda name: leave_out(name, short))
    except MotionError as error:
        if not left_out:
            raise
        name, why = next(iter(left_out.items()))
        raise MotionError(f"none of {len(left_out)} files can be used; the first, {name}: {why}") from error
    tree = MotionTree().fit_database(database)
    tree.card_ = {
        "model": "tree", "people": len(set(database.persons)), "clips": len(set(database.clips)),
        "activities": ", ".join(sorted(set(database.activities))), "frames": len(database.poses),
        "windows": len(database.windows), "components": len(tree.basis_.deviation),
        "variance kept": f"{tree.basis_.share:.0%}", "data": "files of unknown origin",
        "data licence": "not stated: ask the source of the capture",
        "model licence": "not stated: that of the capture, which the model contains",
        "intended use": "synthesis and tracking of motion like that in the capture", "command": command,
        "motionenv": __version__,
    }  # fmt: skip
    return tree
