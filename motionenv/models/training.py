"""Fit the shipped models to a folder of motion capture: select straight walks, group them by person, write the card."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionenv import __version__
from motionenv._core.validation import did_you_mean
from motionenv.body.gaps import PARTS, listed, missing_parts
from motionenv.body.kinematics import shown_markers
from motionenv.cycles import estimate_period
from motionenv.errors import MotionError
from motionenv.mocap import SUFFIXES, MarkerMap, person_label, read, retarget, to_markers
from motionenv.mocap.plausibility import check_plausible
from motionenv.mocap.sources import find_source
from motionenv.models import filling
from motionenv.models.base import GaitModel
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.walking.model import WalkingModel
from motionenv.models.walking.preprocessing import STRAIGHT, gait_channels, straightness
from motionenv.types import MARKERS, Markers, Motion

__all__ = ["MODELS", "Walks", "fit", "read_walks"]

# CMU's subjects 12 and 37 are one person, and 07 and 38 probably are: each pair counts as one.
_SAME_PERSON = {"37": "12", "38": "07"}
#: Classes of the models that `fit` knows, by name.
MODELS: dict[str, type[GaitModel]] = {
    "walk/fpca": WalkingModel,
    "walk/eigenwalkers": Eigenwalkers,
    "walk/prior": WalkerPrior,
}

_CMU_CARD = {
    "data": "straight overground walks of the CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu)",
    "data licence": "CMU: free to use for research and in products; the data itself may not be resold",
    "model licence": "MIT",
    "intended use": "{} of straight walking; learned from few people",
}
_UNKNOWN_CARD = {
    "data": "straight walks from files of unknown origin",
    "data licence": "not stated: ask the source of the capture",
    "model licence": "not stated: it depends on the licence of the capture",
    "intended use": "{} of straight walking",
}
_USES = dict.fromkeys(MODELS, "synthesis and tracking") | {"walk/prior": "3D from 2D points, and synthesis,"}


@dataclass(frozen=True)
class Walks:
    """Captured straight walks.

    Attributes:
        motions, subjects: the retargeted walks, each (frames, 25), and the label of each one's person.
        markers: the 15 markers of each walk; NaN where the capture doesn't show them.
        left_out: files that were not used, and why.
        cmu: whether every walk is a known CMU file.
    """

    motions: tuple[Motion, ...]
    markers: tuple[Markers, ...]
    subjects: tuple[str, ...]
    left_out: dict[str, str]
    cmu: bool


def read_walks(
    folder: Path,
    *,
    fps: float | None = None,
    unit: str | None = None,
    marker_map: MarkerMap | None = None,
    fill: bool = False,
    up: str | None = None,
    person: str | None = None,
    on_file: Callable[[str], None] = lambda name: None,
) -> Walks:
    """Read every straight, periodic walk among the capture files below `folder`.

    A file's name up to the first "_" is the person's label, as in CMU's trials. CMU files are recognised by their
    SHA-256; CMU's two numbers for one person count as one label.

    Args:
        folder: searched with its subfolders for files of `motionenv.mocap.SUFFIXES`.
        fps: frames per second, for files that don't state it (AMC never does; CMU's is 120).
        unit: unit of length, for files that don't state it.
        marker_map: which points of the files are which landmarks; None recognises them by their names.
        fill: whether to fill what the capture doesn't show (`motionenv.fill`). Otherwise captures of part of the body
            give walks of that part.
        up, person: vertical axis, and the one of several people in a file, as of `motionenv.read`.
        on_file: called with each file's name before it is read.

    Raises:
        MotionError: no such folder, or no capture or no straight walk in it.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in SUFFIXES)
    if not paths:
        raise MotionError(
            f"no capture ({', '.join(sorted(SUFFIXES))}) below {folder}; "
            "motionenv mocap download cmu-walks --to DIR gets some"
        )
    known = {file.sha256 for file in find_source("cmu-walks").files}
    used, left_out, cmu = [], {}, []
    for path in paths:
        on_file(path.name)
        try:
            motion, markers = _walk(path, fps, unit, marker_map, fill, up, person)
            cmu.append(hashlib.sha256(path.read_bytes()).hexdigest() in known)
            person = person_label(path)
            used.append((motion, markers, _SAME_PERSON.get(person, person) if cmu[-1] else person))
        except MotionError as error:
            left_out[path.name] = str(error)
    if not used:
        raise MotionError(f"none of {len(paths)} files is a straight walk; the first: {next(iter(left_out.values()))}")
    motions, shown, subjects = zip(*used, strict=True)
    return Walks(motions, shown, subjects, left_out, all(cmu))


def fit(name: str, walks: Walks, command: str, groups: Mapping[str, Sequence[str]] | None = None) -> GaitModel:
    """Fit the model `name`, a key of `MODELS`, to `walks` and write its card, with the `command` line that fits it.

    With `groups`, two names with labels of people, eigenwalkers get the axis between them (`Eigenwalkers.fit`).

    Raises:
        MotionError: `name` isn't a key of `MODELS`, or groups for another model than eigenwalkers, or as of its fit.
    """
    check_name(name)
    model = MODELS[name]()
    motions = getattr(walks, model.learns_from)
    if groups is None:
        model.fit(motions, walks.subjects)
    elif isinstance(model, Eigenwalkers):
        model.fit(motions, walks.subjects, groups=groups)
    else:
        raise MotionError(f"{name} has no axis between groups of people: fit walk/eigenwalkers")
    model.card_ = _card(name, walks, command)
    return model


def check_name(name: str) -> None:
    """Raise a `MotionError` if `name` isn't a key of `MODELS`, before an hour of reading files."""
    if name not in MODELS:
        raise MotionError(
            f"model must be one of tree, {', '.join(MODELS)}, got {name!r}" + did_you_mean(name, ("tree", *MODELS))
        )


def _walk(
    path: Path,
    fps: float | None,
    unit: str | None,
    marker_map: MarkerMap | None,
    fill: bool,
    up: str | None,
    person: str | None,
) -> tuple[Motion, Markers]:
    capture = read(path, fps=fps, unit=unit, up=up, person=person, override=False)
    check_plausible(capture, marker_map)
    motion = capture if isinstance(capture, Motion) else retarget(capture, marker_map=marker_map)
    if motion.poses.ndim != 2:
        raise MotionError("holds several motions: save one per file")
    straight = straightness(motion)
    if straight < STRAIGHT:
        raise MotionError(f"not straight: net displacement is {straight:.0%} of the path's length")
    estimate_period(gait_channels(motion)[:, :19], motion.fps)
    if fill:
        motion = filling.fill(motion)
    shown = shown_markers(motion.poses, motion.skeleton)
    if isinstance(capture, Motion):
        return motion, Markers(MARKERS, shown, motion.fps, name=path.stem)
    markers = to_markers(capture, marker_map=marker_map)
    if fill:
        markers = replace(markers, positions=np.where(np.isnan(markers.positions), shown, markers.positions))
    return motion, markers


def _card(name: str, walks: Walks, command: str) -> dict:
    known = _CMU_CARD if walks.cmu else _UNKNOWN_CARD
    return {
        "model": name,
        "people": len(set(walks.subjects)),
        "trials": len(walks.motions),
        "frames": int(sum(len(m.poses) for m in walks.motions)),
        "seconds": round(sum(m.seconds for m in walks.motions), 1),
        **_parts(walks.motions),
        **{key: text.format(_USES[name]) for key, text in known.items()},
        "command": command,
        "motionenv": __version__,
    }


def _parts(motions: tuple[Motion, ...]) -> dict[str, str]:
    """Card entries about parts of the body that walks don't show, or that a model filled."""
    told = {}
    lacking = [part for part in PARTS if all(part in missing_parts(motion.poses) for motion in motions)]
    if lacking:
        told["not shown by any walk"] = listed(lacking)
    filled = sum(motion.filled is not None for motion in motions)
    if filled:
        told["filled by another model"] = f"what {filled} of {len(motions)} walks don't show"
    return told
