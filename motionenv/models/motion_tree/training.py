"""Fit a motion tree to a folder of motion capture, and write its card."""

from collections.abc import Callable
from pathlib import Path

from motionenv import __version__
from motionenv.errors import MotionError
from motionenv.mocap import MarkerMap
from motionenv.models.motion_tree.clips import read_clips
from motionenv.models.motion_tree.database import build_database
from motionenv.models.motion_tree.features import WINDOW
from motionenv.models.motion_tree.model import MotionTree

__all__ = ["fit_tree"]


def fit_tree(
    folder: Path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | None = None,
    activity: str | None = None, mirrored: bool = False, fill: bool = False, command: str = "",
    on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> MotionTree:  # fmt: skip
    """Fit a tree to all capture below a folder.

    Args:
        folder, fps, unit, marker_map, activity, fill, on_file: as of `motionenv.models.motion_tree.read_clips`.
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
        folder, fps=fps, unit=unit, marker_map=marker_map, activity=activity, fill=fill, on_file=on_file,
        on_left_out=leave_out,
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
