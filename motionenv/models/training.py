"""Fit the shipped models to a folder of motion capture: find strides, group them by person, write the card."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from motionenv import __version__
from motionenv._core.validation import did_you_mean
from motionenv.body.gaps import PARTS, listed, missing_parts
from motionenv.body.kinematics import shown_markers
from motionenv.errors import GapError, MotionError
from motionenv.mocap import SUFFIXES, MarkerMap, person_label, read, retarget, to_markers
from motionenv.mocap.plausibility import check_plausible
from motionenv.mocap.sources import find_source
from motionenv.models import filling
from motionenv.models.base import GaitModel
from motionenv.models.eigenwalkers.extraction import fourier_walker, walker_of_strides
from motionenv.models.eigenwalkers.fourier_series import FourierWalker
from motionenv.models.eigenwalkers.model import Eigenwalkers
from motionenv.models.eigenwalkers.walker_prior import WalkerPrior
from motionenv.models.walking.model import WalkingModel
from motionenv.models.walking.strides import WalkStrides, walk_strides
from motionenv.types import MARKERS, Markers, Motion

__all__ = ["MODELS", "Walks", "fit", "read_walks"]

# CMU's subjects 12 and 37 are one person, and 07 and 38 probably are: each pair counts as one.
_SAME_PERSON = {"37": "12", "38": "07"}
#: Classes of the models that `fit` knows, by name.
MODELS: dict[str, type[GaitModel]] = {
    "walk/fpca": WalkingModel, "walk/eigenwalkers": Eigenwalkers, "walk/prior": WalkerPrior,
}  # fmt: skip

_CMU_CARD = {
    "data": "overground walks of the CMU Graphics Lab Motion Capture Database (mocap.cs.cmu.edu)",
    "data licence": "CMU: free to use for research and in products; the data itself may not be resold",
    "model licence": "MIT",
    "intended use": "{} of walking; learned from few people",
}
_UNKNOWN_CARD = {
    "data": "walks from files of unknown origin", "data licence": "not stated: ask the source of the capture",
    "model licence": "not stated: it depends on the licence of the capture", "intended use": "{} of walking",
}  # fmt: skip
_OF_WALKS = ("motions", "markers", "subjects", "strides")
_USES = dict.fromkeys(MODELS, "synthesis and tracking") | {"walk/prior": "3D from 2D points, and synthesis,"}


@dataclass(frozen=True)
class Walks:
    """Captured walks.

    Attributes:
        motions, subjects: the retargeted walks, each (frames, 25), and the label of each one's person.
        markers: the 15 markers of each walk; NaN where the capture doesn't show them.
        strides: of each walk, that models learn from.
        left_out: files that were not used, and why.
        cmu: whether every walk is a known CMU file.
    """

    motions: tuple[Motion, ...]
    markers: tuple[Markers, ...]
    subjects: tuple[str, ...]
    strides: tuple[WalkStrides, ...]
    left_out: dict[str, str]
    cmu: bool

    def straight(self) -> "Walks":
        """Those that are long, straight and steady, and so cut by their period: the shipped models' are CMU's."""
        kept = [walk.found == "period" for walk in self.strides]
        some: dict[str, Any] = {name: tuple(compress(getattr(self, name), kept)) for name in _OF_WALKS}
        if not any(kept):
            raise MotionError("no walk is long, straight and steady: leave --straight out")
        return replace(self, **some)

    def summary(self) -> dict[str, int | str]:
        """What models learn from: numbers of people, trials and strides, and ranges of speed and curvature."""
        strides = [stride for walk in self.strides for stride in walk.strides]
        speeds = np.array([stride.speed for stride in strides])
        bends = np.abs([stride.curvature for stride in strides])
        kinds = [stride.activity for stride in strides]
        return {
            "people": len(set(self.subjects)), "trials": len(self.motions), "strides": len(strides),
            **{f"{kind} strides": kinds.count(kind) for kind in ("running",) if kind in kinds},
            "speeds": _range(speeds, "m/s"), "curvatures": _range(bends, "1/m"),
        }  # fmt: skip


def read_walks(
    folder: Path, *, fps: float | None = None, unit: str | None = None, marker_map: MarkerMap | None = None,
    fill: bool = False, up: str | None = None, person: str | None = None,
    on_file: Callable[[str], None] = lambda name: None,
) -> Walks:  # fmt: skip
    """Read every walk with a stride among the capture files below `folder`.

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
        MotionError: no such folder, or no capture or no stride in it.
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
            motion, markers, strides = _walk(path, marker_map, fill, fps=fps, unit=unit, up=up, person=person)
            cmu.append(hashlib.sha256(path.read_bytes()).hexdigest() in known)
            label = person_label(path)
            used.append((motion, markers, _SAME_PERSON.get(label, label) if cmu[-1] else label, strides))
        except MotionError as error:
            left_out[path.name] = str(error)
    if not used:
        raise MotionError(f"none of {len(paths)} files is a walk; the first: {next(iter(left_out.values()))}")
    motions, shown, subjects, found = zip(*used, strict=True)
    return Walks(motions, shown, subjects, found, left_out, all(cmu))


def fit(name: str, walks: Walks, command: str, groups: Mapping[str, Sequence[str]] | None = None) -> GaitModel:
    """Fit the model `name`, a key of `MODELS`, to `walks` and write its card, with the `command` line that fits it.

    With `groups`, two names with labels of people, eigenwalkers get the axis between them (`Eigenwalkers.fit`).

    Raises:
        MotionError: `name` isn't a key of `MODELS`, or groups for another model than eigenwalkers, or as of its fit.
    """
    check_name(name)
    model = MODELS[name]()
    if groups is not None and not isinstance(model, Eigenwalkers):
        raise MotionError(f"{name} has no axis between groups of people: fit walk/eigenwalkers")
    if isinstance(model, WalkingModel):
        model.fit(walks.motions, walks.subjects, walks.strides)
    else:
        walkers = [_walker(*walk) for walk in zip(walks.markers, walks.strides, strict=True)]
        model.fit(walkers, walks.subjects, **({} if groups is None else {"groups": groups}))
    model.card_ = _card(name, walks, command)
    return model


def check_name(name: str) -> None:
    """Raise a `MotionError` if `name` isn't a key of `MODELS`, before an hour of reading files."""
    if name not in MODELS:
        raise MotionError(
            f"model must be one of tree, {', '.join(MODELS)}, got {name!r}" + did_you_mean(name, ("tree", *MODELS))
        )


def _walk(path: Path, marker_map: MarkerMap | None, fill: bool, **how: Any) -> tuple[Motion, Markers, WalkStrides]:
    """One file's walk, read as `how` says. Every reason to leave a file out is raised here."""
    capture = read(path, **how, override=False)
    check_plausible(capture, marker_map)
    motion = capture if isinstance(capture, Motion) else retarget(capture, marker_map=marker_map)
    if motion.poses.ndim != 2:
        raise MotionError("holds several motions: save one per file")
    strides = walk_strides(motion, capture, marker_map)
    if fill:
        motion = filling.fill(motion)
    shown = shown_markers(motion.poses, motion.skeleton)
    if isinstance(capture, Motion):
        return motion, Markers(MARKERS, shown, motion.fps, name=path.stem), strides
    markers = to_markers(capture, marker_map=marker_map)
    if fill:
        markers = replace(markers, positions=np.where(np.isnan(markers.positions), shown, markers.positions))
    return motion, markers, strides


def _walker(markers: Markers, walk: WalkStrides) -> FourierWalker:
    if walk.found == "period":
        try:
            return fourier_walker(markers)
        except GapError:  # less than two strides of it are steady
            pass
    return walker_of_strides(markers, walk.strides, walk.headings)


def _range(values: np.ndarray, unit: str) -> str:
    """Least and greatest of some values, and their median."""
    low, middle, high = np.nanpercentile(values, [0, 50, 100])
    return f"{low:.2f} to {high:.2f} {unit}, median {middle:.2f}"


def _card(name: str, walks: Walks, command: str) -> dict:
    known = _CMU_CARD if walks.cmu else _UNKNOWN_CARD
    return {
        "model": name, **walks.summary(), "frames": int(sum(len(m.poses) for m in walks.motions)),
        "seconds": round(sum(m.seconds for m in walks.motions), 1), **_parts(walks.motions),
        **{key: text.format(_USES[name]) for key, text in known.items()}, "command": command, "motionenv": __version__,
    }  # fmt: skip


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
