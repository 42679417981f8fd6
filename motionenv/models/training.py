"""From a folder of motion capture to the fitted models that ship: which walks, of whom, and the model card."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from motionenv import __version__
from motionenv.body import markers as markers_of
from motionenv.cycles import estimate_period
from motionenv.errors import MotionError
from motionenv.mocap import read, retarget, to_markers
from motionenv.mocap.sources import find_source
from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.gait import STRAIGHT, gait_channels, straightness
from motionenv.models.walkerprior import WalkerPrior
from motionenv.models.walking import WalkingModel
from motionenv.types import MARKERS, Markers, Motion

__all__ = ["MODELS", "Walks", "fit", "read_walks"]

# CMU's subjects 12 and 37 are one person, 07 and 38 probably too: each pair counts as one.
_SAME_PERSON = {"37": "12", "38": "07"}
#: Names under which `fit` fits models.
MODELS = ("walk/fpca", "walk/eigenwalkers", "walk/prior")

_CMU_CARD = {
    "data": "straight overground walks of the CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu)",
    "data licence": "CMU: free to use for research and in products; the data itself may not be resold",
    "model licence": "MIT",
    "intended use": "{} of straight walking; few people, most trials of one of them",
}
_UNKNOWN_CARD = {
    "data": "straight walks from files that motionenv doesn't know",
    "data licence": "not stated: ask whoever the capture is from",
    "model licence": "not stated: it depends on the capture's",
    "intended use": "{} of straight walking",
}
_USES = dict.fromkeys(MODELS, "synthesis and tracking") | {"walk/prior": "3D from 2D points, and synthesis,"}
_SUFFIXES = {".amc", ".bvh", ".c3d", ".npz", ".trc"}


@dataclass(frozen=True)
class Walks:
    """Captured straight walks.

    Attributes:
        motions: retargeted, (frames, 25) each.
        markers: their 15 markers.
        subjects: the person's label of each.
        left_out: reason by file, of what was not used.
        cmu: whether all of it is known to be CMU's, file by file.
    """

    motions: tuple[Motion, ...]
    markers: tuple[Markers, ...]
    subjects: tuple[str, ...]
    left_out: dict[str, str]
    cmu: bool


def read_walks(
    folder, *, fps: float | None = None, unit: str | None = None, on_file: Callable[[str], None] = lambda name: None
) -> Walks:
    """Every straight, periodic walk among the capture files below `folder`.

    The person is the file's name up to the first "_", as CMU numbers its trials; of CMU's, known by their SHA-256,
    numbers that are one person count as one.

    Args:
        folder: searched with its subfolders for AMC, BVH, C3D, NPZ and TRC.
        fps: frames per second, where the files don't say (AMC never does; CMU's is 120).
        unit: unit of length, where the files don't say.
        on_file: called with each file's name before it is read.

    Raises:
        MotionError: no such folder, no capture in it, or no straight walk among it.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in _SUFFIXES)
    if not paths:
        raise MotionError(
            f"no AMC, BVH, C3D, NPZ or TRC file below {folder}; motionenv mocap download cmu-walks --to DIR gets some"
        )
    known = {file.sha256 for file in find_source("cmu-walks").files}
    used, left_out, cmu = [], {}, []
    for path in paths:
        on_file(path.name)
        try:
            motion, markers = _walk(path, fps, unit)
            cmu.append(hashlib.sha256(path.read_bytes()).hexdigest() in known)
            person = path.stem.partition("_")[0]
            used.append((motion, markers, _SAME_PERSON.get(person, person) if cmu[-1] else person))
        except MotionError as error:
            left_out[path.name] = str(error)
    if not used:
        raise MotionError(f"none of {len(paths)} files is a straight walk; the first: {next(iter(left_out.values()))}")
    motions, shown, subjects = zip(*used, strict=True)
    return Walks(motions, shown, subjects, left_out, all(cmu))


def fit(name: str, walks: Walks, command: str) -> WalkingModel | Eigenwalkers:
    """Fit the model called `name` to captured walks, with its card.

    Args:
        name: one of `MODELS`.
        walks: from `read_walks`.
        command: the command line that does this, for the card.

    Raises:
        MotionError: no model is fitted under that name.
    """
    check_name(name)
    model: WalkingModel | Eigenwalkers
    if name == "walk/fpca":
        model = WalkingModel().fit(walks.motions, walks.subjects)
    else:
        model = (WalkerPrior() if name == "walk/prior" else Eigenwalkers()).fit_from_markers(
            walks.markers, walks.subjects
        )
    model.card_ = _card(name, walks, command)
    return model


def check_name(name: str) -> None:
    """Refuse the `name` of a model that `fit` doesn't know, before an hour of reading.

    Raises:
        MotionError: it isn't one of `MODELS`.
    """
    if name not in MODELS:
        raise MotionError(f"model must be tree, {', '.join(MODELS[:-1])} or {MODELS[-1]}, got {name!r}")


def _walk(path: Path, fps: float | None, unit: str | None) -> tuple[Motion, Markers]:
    """One file as motion and markers.

    Raises:
        MotionError: it can't be read or retargeted, turns, or has no period.
    """
    suffix = path.suffix.lower()
    capture = read(path, fps=None if suffix in {".c3d", ".npz"} else fps, unit=None if suffix == ".npz" else unit)
    motion = capture if isinstance(capture, Motion) else retarget(capture)
    if motion.poses.ndim != 2:
        raise MotionError("holds several motions: save one to a file")
    straight = straightness(motion)
    if straight < STRAIGHT:
        raise MotionError(f"not straight: gets {straight:.0%} of its path's length ahead")
    estimate_period(gait_channels(motion)[:, :19], motion.fps)
    if isinstance(capture, Motion):
        return motion, Markers(MARKERS, markers_of(motion.poses, motion.skeleton), motion.fps, name=path.stem)
    return motion, to_markers(capture)


def _card(name: str, walks: Walks, command: str) -> dict:
    """What people need to know of a fitted model (Mitchell et al. 2019)."""
    known = _CMU_CARD if walks.cmu else _UNKNOWN_CARD
    return {
        "model": name,
        "people": len(set(walks.subjects)),
        "trials": len(walks.motions),
        "frames": int(sum(len(m.poses) for m in walks.motions)),
        "seconds": round(sum(m.seconds for m in walks.motions), 1),
        **{key: text.format(_USES[name]) for key, text in known.items()},
        "command": command,
        "motionenv": __version__,
    }
