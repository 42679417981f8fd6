"""From a folder of motion capture to a tree, with its card."""

from collections.abc import Callable

from motionenv import __version__
from motionenv.errors import MotionError
from motionenv.models.tree.capture import read_clips
from motionenv.models.tree.database import build_database
from motionenv.models.tree.frames import WINDOW
from motionenv.models.tree.model import MotionTree

__all__ = ["fit_tree"]


def fit_tree(
    folder,
    *,
    fps: float | None = None,
    unit: str | None = None,
    activity: str | None = None,
    mirrored: bool = False,
    command: str = "",
    on_file: Callable[[str], None] = lambda name: None,
    on_left_out: Callable[[str, str], None] = lambda name, why: None,
) -> MotionTree:
    """The tree of all capture below a folder.

    Args:
        folder: searched with its subfolders.
        fps: frames per second, where the files don't say.
        unit: unit of length, where the files don't say.
        activity: what is done in all of them; None takes it from the names.
        mirrored: also take the left-right mirror image of everything.
        command: the command line that does this, for the card.
        on_file: called with each file's name before it is read.
        on_left_out: called with name and reason of each file that is not used.

    Raises:
        MotionError: there is no capture in the folder, or none that can be used.
    """
    left_out: dict[str, str] = {}

    def leave_out(name: str, why: str) -> None:
        left_out[name] = why
        on_left_out(name, why)

    clips = read_clips(folder, fps=fps, unit=unit, activity=activity, on_file=on_file, on_left_out=leave_out)
    short = f"has no {WINDOW + 1} frames without a gap, at 30 frames/s"
    try:
        database = build_database(clips, mirrored=mirrored, on_short=lambda name: leave_out(name, short))
    except MotionError as error:
        if not left_out:
            raise
        name, why = next(iter(left_out.items()))
        raise MotionError(f"none of {len(left_out)} files can be used; the first, {name}: {why}") from error
    tree = MotionTree().fit(database)
    tree.card_ = {
        "model": "tree",
        "people": len(set(database.persons)),
        "clips": len(set(database.clips)),
        "activities": ", ".join(sorted(set(database.activities))),
        "frames": len(database.poses),
        "windows": len(database.windows),
        "components": len(tree.basis_.deviation),
        "variance kept": f"{tree.basis_.share:.0%}",
        "data": "files that motionenv doesn't know",
        "data licence": "not stated: ask whoever the capture is from",
        "model licence": "not stated: it holds the capture itself, so the capture's",
        "intended use": "synthesis and tracking of motion like that in the capture",
        "command": command,
        "motionenv": __version__,
    }
    return tree
