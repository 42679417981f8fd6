"""Write motions to files; the suffix selects the writer."""

from collections.abc import Iterator
from pathlib import Path

from motionenv.errors import MotionError
from motionenv.mocap import npz
from motionenv.mocap.writers import bvh, c3d, csv, glb
from motionenv.types import Motion

_WRITERS = {".bvh": bvh, ".c3d": c3d, ".csv": csv, ".glb": glb, ".npz": npz}


def write(motion: Motion, path) -> None:
    """Write a motion atomically, in the format of the suffix.

    ==========  =====================================================================  ==========================
    suffix      content                                                                gaps (NaN)
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
        GapError: the motion has gaps, which the format can't represent.
        MotionError: another suffix, not one sequence, or the file can't be written.
    """
    _check_motion(motion)
    check_suffix(path)
    _WRITERS[Path(path).suffix.lower()].write(motion, path)


def encode(motion: Motion, suffix: str) -> Iterator[bytes]:
    """The bytes of the file that `write` would write, in parts that are made on demand.

    BVH and CSV are encoded a few hundred frames at a time, the others in one part. NPZ is not compressed, for speed.

    Args:
        motion: (frames, 25) poses and their skeleton.
        suffix: as in `write`, such as ".bvh".

    Raises:
        GapError: the motion has gaps, which the format can't represent.
        MotionError: another suffix, or not one sequence.
    """
    _check_motion(motion)
    check_suffix(f"motion{suffix}")
    return _WRITERS[suffix.lower()].parts(motion)


def _check_motion(motion) -> None:
    if not isinstance(motion, Motion):
        raise MotionError(f"motion must be a Motion, got {type(motion).__name__}; retarget Markers to a body first")


def check_suffix(path) -> None:
    """Reject paths with a suffix that `write` doesn't support, before any work.

    Raises:
        MotionError: another suffix; lists the supported ones.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise MotionError(f"can't write {path}: suffix {suffix!r} isn't supported; supported are {', '.join(_WRITERS)}")
