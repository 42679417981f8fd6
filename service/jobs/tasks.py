"""The work of each kind of job, run in its process: function(settings, folder, progress).

`folder` holds the files in `input` and receives `result`, and `model.npz` for a fit. Invalid input raises MotionError.
Imports that only one kind needs are local, since every job starts by importing this module.
"""

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import orjson

import motionenv
from motionenv import Motion, MotionError
from motionenv.mocap import MarkerMap
from motionenv.types import POSE

Progress = Callable[[float, str], None]
_SHOWN_FPS, _SHOWN_FRAMES = 30.0, 3600  # of a preview, at most
_MOVED = 0.3  # [m] that the points of a walk move at least
#: What to do at the command line about names that no marker set has.
_COMMANDS = re.compile(r" If these points have other names, .*", re.DOTALL)
_READING = 0.8  # share of reading files in the progress of a fit


def fit_model(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Fit a model to all files; settings of `service.schemas.jobs.FitFields`."""
    files = _captures(folder)
    left_out: dict[str, str] = {}
    begun: list[str] = []

    def reading(name: str) -> None:
        begun.append(name)
        progress(_READING * (len(begun) - 1) / len(files), f"reading {name}, {len(begun)} of {len(files)}")
        if len(begun) == len(files):
            progress(_READING, "fitting")

    command = f"POST /v1/models kind={settings['kind']} name={settings['name']}"
    options = {**_how(settings), "fill": settings.get("fill", False), "on_file": reading}
    model: Any
    if settings["kind"] == "tree":
        from motionenv.models.motion_tree import fit_tree

        model = fit_tree(
            folder / "input", activity=settings["activity"] or "motion", mirrored=settings["mirrored"], command=command,
            on_left_out=left_out.__setitem__, **options,
        )  # fmt: skip
    else:
        from motionenv.models.training import fit, read_walks

        walks = read_walks(folder / "input", **options)
        left_out = walks.left_out
        model = fit(f"walk/{settings['kind']}", walks, command, settings.get("groups"))
    model.save(folder / "model.npz")
    motionenv.load(folder / "model.npz")
    _write_result(folder, {
        "model": f"fitted/{settings['name']}", "kind": model.kind, "card": model.card_,
        "used": [path.name for path in files if path.name not in left_out],
        "left_out": {name: plain(why) for name, why in left_out.items()},
        "notes": [] if settings["kind"] == "tree" else [trait.note for trait in model.own_traits()],
    })  # fmt: skip


def import_model(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Check the file of a model and take it; settings of `service.schemas.jobs.ModelFields`."""
    (path,) = _captures(folder)
    progress(0.0, f"reading {path.name}")
    model = motionenv.load(path)
    shutil.copyfile(path, folder / "model.npz")
    _write_result(folder, {
        "model": f"fitted/{settings['name']}", "kind": model.kind, "card": model.card_, "used": [path.name],
        "left_out": {}, "notes": [],
    })  # fmt: skip


def inspect(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Describe the content of each file, with a preview; settings of `service.schemas.jobs.ReadFields`."""
    files, found = _captures(folder), []
    for i, path in enumerate(files):
        progress(i / len(files), f"reading {path.name}, {i + 1} of {len(files)}")
        try:
            found.append(_inspected(path, **_how(settings)))
        except MotionError as error:
            found.append({"name": path.name, "problem": plain(str(error))})
    _write_result(folder, {"pose": POSE, "files": found})


def convert(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Convert one file; settings of `service.schemas.jobs.ConvertFields`, and the `suffix` of the other format."""
    from motionenv.mocap import read_motion
    from motionenv.models.filling import fill

    files = _captures(folder)
    if len(files) != 1:
        raise MotionError(f"one capture file is converted at a time, got {len(files)}")
    progress(0.0, f"reading {files[0].name}")
    motion = read_motion(files[0], **_how(settings), override=False)
    motion = fill(motion) if settings.get("fill") else motion
    if motion.poses.ndim != 2:
        raise MotionError(f"{files[0].name} holds several motions: save one to a file")
    progress(0.8, "writing")
    if settings["suffix"] == ".json":
        marked = {} if motion.filled is None else {"filled": motion.filled}
        shown = _shown(motion, motion.fps, len(motion.poses))
        _write_result(folder, {"name": files[0].name, "pose": POSE, **shown, **marked})
        return
    path = folder / f"converted{settings['suffix']}"
    motionenv.write(motion, path)
    path.rename(folder / "result")


def points(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """List the points of one file and propose which landmarks they are; settings as of `inspect`."""
    from motionenv.mocap.marker_sets import LANDMARKS, guess_map, recognise, resolve

    path = _captures(folder)[0]
    progress(0.0, f"reading {path.name}")
    how = _how(settings)
    marker_map, problem = how.pop("marker_map"), None
    held = motionenv.read(path, **how, override=False)
    if isinstance(held, Motion):
        raise MotionError(f"{path.name} holds angles of the body and no points: it needs no marker map")
    if held.positions.ndim != 3:
        raise MotionError(f"{path.name} holds several captures: save one to a file")
    progress(0.5, "recognising the points")
    try:
        motionenv.retarget(held, marker_map=marker_map)
    except MotionError as error:
        problem = plain(str(error))
    known, named = recognise(held.names)
    shown = marker_map or guess_map(held)
    assigned = resolve(shown, held.names)
    seen = np.isfinite(held.positions).all(axis=2)
    frame = int(seen.sum(axis=1).argmax())
    places = zip(held.positions[frame].tolist(), seen[frame], strict=True)
    _write_result(folder, {
        "name": path.name, "points": held.names, "frame": frame, "heading": _heading(held.positions),
        "positions": [place if there else None for place, there in places], "problem": problem,
        "marker_set": known.name if named else None, "landmarks": LANDMARKS, "assigned": assigned,
        "map": shown.to_toml() if shown.points else None,
        "unfound": [landmark for landmark in shown.points if landmark not in assigned],
    })  # fmt: skip


def report(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Write a gait report on all files; settings of `service.schemas.jobs.ReportFields`, and `suffix` of its format."""
    from motionenv.gait import write_report

    static = settings["static"]
    trials = [path for path in _captures(folder) if path.name != static]
    analysed: list[str] = []

    def step(name: str) -> None:
        analysed.append(name)
        progress(0.9 * len(analysed) / len(trials), f"analysed {name}, {len(analysed)} of {len(trials)}")

    progress(0.0, f"analysing {trials[0].name}, 1 of {len(trials)}")
    standing = folder / "input" / static if static else None
    about = {name: settings[name] for name in ("age", "sex", "wands") if name in settings}  # older jobs lack wands
    write_report(trials, folder / "report.html", static=standing, on_step=step, **about, **_how(settings))
    (folder / f"report{settings['suffix']}").rename(folder / "result")


def render(settings: dict[str, Any], folder: Path, progress: Progress) -> None:
    """Render a walk; settings `request`, of `SynthesisRequest`, `model`, a name or file, and `suffix` of the video."""
    from service.formats.films import arguments
    from service.schemas.synthesis import SynthesisRequest

    asked = SynthesisRequest.model_validate(settings["request"])
    progress(0.0, "synthesizing the walk")
    motion = asked.make(settings["model"], asked.seed)
    many = len(motion.poses)
    words = max(1, many // 100)  # frames between words

    def drawn(n: int) -> None:
        if n % words == 0:
            progress(0.99 * n / many, f"frame {n} of {many}")

    path = folder / f"film{settings['suffix']}"
    motionenv.write_video(path, motionenv.film(motion, **arguments(asked.picture)), motion.fps, progress=drawn)
    path.rename(folder / "result")


#: Functions by kind of job.
KINDS = {
    "fit": fit_model, "import": import_model, "inspect": inspect, "points": points, "convert": convert,
    "report": report, "render": render,
}  # fmt: skip


def _captures(folder: Path) -> list[Path]:
    files = sorted(path for path in (folder / "input").iterdir() if path.suffix != ".asf")
    if not files:
        raise MotionError("the files contain only skeletons (ASF): add the motion (AMC)")
    return files


def _how(settings: dict[str, Any]) -> dict[str, Any]:
    """How files are read; jobs of an older version have neither axis nor person."""
    told = {name: settings.get(name) for name in ("fps", "unit", "up", "person")}
    return {**told, "marker_map": _marker_map(settings)}


def _marker_map(settings: dict[str, Any]) -> MarkerMap | None:
    """The map that was sent with the files; jobs of an older version have no such setting."""
    text = settings.get("map")
    return MarkerMap.parse(text) if text else None


def _heading(positions: np.ndarray) -> float | None:
    """Direction [degrees] in which points (frames, points, 3) [m] move, from x towards y; None if they stay."""
    seen = np.isfinite(positions).all(axis=2)
    each = np.flatnonzero(seen.any(axis=0))
    first, last = seen.argmax(axis=0)[each], len(seen) - 1 - seen[::-1].argmax(axis=0)[each]
    moved = positions[last, each] - positions[first, each]
    x, y = np.median(moved[:, :2], axis=0) if len(each) else (0.0, 0.0)
    return float(np.degrees(np.arctan2(y, x))) if np.hypot(x, y) > _MOVED else None


def _inspected(path: Path, marker_map: MarkerMap | None, **how: Any) -> dict[str, Any]:
    from motionenv.models.walking.preprocessing import straightness

    held = motionenv.read(path, **how, override=False)
    ours = isinstance(held, Motion)
    values = held.poses if isinstance(held, Motion) else held.positions
    told: dict[str, Any] = {
        "name": path.name, "format": path.suffix[1:], "points": POSE if isinstance(held, Motion) else held.names,
        "frames": values.shape[0], "fps": held.fps, "seconds": values.shape[0] / held.fps,
        "gaps": float(np.isnan(values).mean()), "notes": [*map(plain, held.notes)],
        "doubts": [*map(plain, motionenv.mocap.find_doubts(held, marker_map))],
    }  # fmt: skip
    try:
        if values.ndim != (2 if ours else 3):
            raise MotionError("holds several motions: save one to a file")
        motion = held if isinstance(held, Motion) else motionenv.retarget(held, marker_map=marker_map)
        shown = _shown(motion) | {"points": None if ours else _thinned(held.positions.round(4), motion.fps)}
        told |= {
            "motion": shown, "notes": [*map(plain, motion.notes)], "straightness": straightness(motion), "walk": None,
        }  # fmt: skip
        if told["doubts"]:
            raise MotionError("no model learns from it, as it can't be of a person as it was read")
        told["walk"] = _walk(motion, held, marker_map)
        steady = motionenv.gait.analyse(held, marker_map=marker_map).steady
        told["strides"] = {side: sum(stride.side == side for stride in steady) for side in ("left", "right")}
    except MotionError as error:
        told["problem"] = plain(str(error))
    return told


def _walk(motion: Motion, held: Any, marker_map: MarkerMap | None) -> dict[str, Any]:
    from motionenv.models.walking.strides import walk_strides

    found = walk_strides(motion, held, marker_map)
    left = [s.start + (0.5 * s.seconds if s.side == "right" else 0.0) for s in found.strides]
    one = np.mean([stride.seconds for stride in found.strides])
    starts = [t for i, t in enumerate(sorted(left)) if i == 0 or t - sorted(left)[i - 1] > 0.5 * one]
    return {"stride": float(one), "starts": starts, "speed": found.speed}


def _shown(motion: Motion, fps: float = _SHOWN_FPS, most: int = _SHOWN_FRAMES) -> dict[str, Any]:
    body = motion.skeleton
    return {
        "fps": motion.fps / max(1, round(motion.fps / fps)), "height": body.height, "offsets": body.offsets,
        "radii": body.radii, "poses": _thinned(motion.poses, motion.fps, fps, most),
    }  # fmt: skip


def _thinned(frames: np.ndarray, own: float, fps: float = _SHOWN_FPS, most: int = _SHOWN_FRAMES) -> np.ndarray:
    return np.ascontiguousarray(frames[:: max(1, round(own / fps))][:most])


def _write_result(folder: Path, what: dict[str, Any]) -> None:
    (folder / "result").write_bytes(orjson.dumps(what, option=orjson.OPT_SERIALIZE_NUMPY))


def plain(problem: str) -> str:
    """A message in the words of this interface, and without paths of this machine."""
    problem = problem.replace(f"{Path.cwd()}/", "").replace("input/", "")
    problem = re.sub(r"(\w+)= \(--[\w-]+\)", r"the field \1", problem)
    return _COMMANDS.sub(" If these points have other names, send a marker map in the field map", problem)
