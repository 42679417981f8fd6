"""Motions into files: the writer is picked by the file's suffix."""

from collections.abc import Iterator
from pathlib import Path

from motionenv.errors import MotionError
from motionenv.mocap import bvh_writer, c3d_writer, csv_writer, glb, npz
from motionenv.types import Motion

_WRITERS = {".bvh": bvh_writer, ".c3d": c3d_writer, ".csv": csv_writer, ".glb": glb, ".npz": npz}


def write(motion: Motion, path) -> None:
    """Write a motion whole or not at all, in the format of the suffix.

    ==========  =====================================================================  ==========================
    suffix      what it holds                                                          gaps (NaN)
    ==========  =====================================================================  ==========================
    .bvh        the skeleton and its joint angles [cm, degrees], for animation tools   refused
    .c3d        the 15 markers [mm], for gait analysis                                 residual -1
    .csv        poses and markers [m, rad], for statistics                             empty fields
    .glb        the moving, coloured cylinder body [m], for viewers and web pages      refused
    .npz        everything, to the bit, for motionenv; batched sequences too           kept
    ==========  =====================================================================  ==========================

    Args:
        motion: (frames, 25) poses and their skeleton.
        path: the file.

    Raises:
        GapError: the motion has gaps and the format no sign for them.
        MotionError: another suffix, not one sequence, or the file can't be written.
    """
    _check_motion(motion)
    check_suffix(path)
    _WRITERS[Path(path).suffix.lower()].write(motion, path)


def encode(motion: Motion, suffix: str) -> Iterator[bytes]:
    """The bytes of the file that `write` would write, in parts: one after the other is made as it is asked for.

    BVH and CSV come a few hundred frames at a time, the others whole. NPZ is not compressed here, for speed.

    Args:
        motion: (frames, 25) poses and their skeleton.
        suffix: as of `write`, such as ".bvh".

    Raises:
        GapError: the motion has gaps and the format no sign for them.
        MotionError: another suffix, or not one sequence.
    """
    _check_motion(motion)
    check_suffix(f"motion{suffix}")
    return _WRITERS[suffix.lower()].parts(motion)


def _check_motion(motion) -> None:
    if not isinstance(motion, Motion):
        raise MotionError(
            f"only a Motion can be written, got {type(motion).__name__}; retarget Markers to a body first"
        )


def check_suffix(path) -> None:
    """Refuse, before any work, the name of a file that `write` can't write: `path` with another suffix.

    Raises:
        MotionError: says which suffixes there are.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise MotionError(
            f"{path} can't be written by its suffix {suffix!r}; there are writers for {', '.join(_WRITERS)}"
        )
