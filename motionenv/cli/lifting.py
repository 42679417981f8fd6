"""The `lift` command: 3D motion from 2D points."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from motionenv._core.files import atomic_write
from motionenv._core.representation import counted
from motionenv._core.validation import checked_fps
from motionenv.cli._shared import (
    Detector,
    Unit,
    Weights,
    check_folder,
    check_picture,
    detected,
    err,
    note,
    parsed_person,
    parsed_size,
    parsed_view,
)
from motionenv.errors import MotionError
from motionenv.types import MARKERS, Points

_CAPTURE = {".amc", ".bvh", ".c3d", ".npz", ".tsv"}  # 3D, but for VideoPose3D's .npz
_FILMS = {".avi", ".m4v", ".mkv", ".mov", ".mp4", ".webm"}
_WITH_GAPS = {".c3d", ".csv", ".npz", ".trc"}
_SEEN = 256  # [pixels] width of a film in which the camera's motion is looked for
_PELVIS = MARKERS.index("pelvis")


def lift(
    points: Annotated[Path, typer.Argument(
        help="2D points (a detector's file or folder, .trc, .csv), a film, or 3D capture.")],
    out: Annotated[Path, typer.Option(help="Output file: .bvh, .c3d, .csv, .glb, .mot, .npz or .trc.")],
    elevation: Annotated[str, typer.Option(help="Angle by which the camera looks down, in degrees, or unknown.")] = "0",
    project: Annotated[str | None, typer.Option(help="For 3D capture: the view to project it to.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Plot of the estimate (.png, .pdf, .svg).")] = None,
    report: Annotated[Path | None, typer.Option(help="Page of joint angles and steps with intervals, .html.")] = None,
    angles: Annotated[Path | None, typer.Option(help="Table of joint angles with 90 % bands, .csv.")] = None,
    height: Annotated[float | None, typer.Option(help="The person's height [m]; by default an adult's.")] = None,
    camera: Annotated[Path | None, typer.Option(help="Calibrated camera (.json, .toml); by default guessed.")] = None,
    which: Annotated[str | None, typer.Option(help="Name of the camera in a .toml file.")] = None,
    person: Annotated[str | None, typer.Option(
        help="Index of the person in a film or detector's file; 0,3 joins parts of one person.")] = None,
    format: Annotated[str | None, typer.Option(help="Keypoints in JSON, such as halpe-26; else recognised.")] = None,
    size: Annotated[str | None, typer.Option(help="Picture, WIDTHxHEIGHT, if points are relative to it.")] = None,
    up: Annotated[bool, typer.Option("--up", help="Pixels are counted upwards.")] = False,
    detector: Detector = "blazepose", weights: Weights = None,
    fps: Annotated[float | None, typer.Option(
        help="Frame rate of points, or at which a film in slow motion was taken.")] = None,
    unit: Unit = None,
) -> None:  # fmt: skip
    """Lift people who walk, turn or run from the 2D points of one camera to 3D.

    People in films are detected by BlazePose (pip install 'motionenv[detect]').

    Points in metres are those of a picture's plane, seen from afar. Capture (.amc, .bvh, .c3d, .trc) is projected
    first, and the result compared with it.
    Example: motionenv lift keypoints.json --fps 30 --height 1.75 --out walk.npz --report walk.html --angles walk.csv
    """
    from motionenv.lifting import lift as lift_points
    from motionenv.lifting.saving import write_lifted
    from motionenv.mocap.writing import check_suffix

    check_suffix(out)
    _check_outputs(out, plot, report, angles)
    picture = None if size is None else parsed_size(size)
    of_detector = {"person": parsed_person(person), "format": format, "size": picture,
                   "up": _checked_up(up, size, camera)}  # fmt: skip
    if weights is not None and points.suffix.lower() not in _FILMS:
        raise MotionError(f"--weights is for films, in which people are detected; {points.name} has points: omit it")
    known = _camera(camera, which)
    if points.suffix.lower() in _FILMS:
        others = {"project": project, "unit": unit, **of_detector, "person": None}
        loaded, known = _of_film(points, (detector, weights), of_detector["person"], fps, others, known)
    else:
        loaded = _read(points, project, elevation, fps, unit, of_detector)
    with err.status("lifting") as status:
        lifted = lift_points(
            loaded, elevation=_parsed_elevation(elevation), height=height,
            on_progress=lambda share: status.update(f"lifting, {share:.0%}"), **known,
        )  # fmt: skip
        motion = lifted.motion()
    _check_gaps(np.isnan(motion.poses).any(axis=1), motion.fps, out)
    write_lifted(lifted, motion, out)
    typer.echo(f"{out}  {len(motion.poses)} frames, {motion.seconds:.2f} s at {motion.fps:g} fps")
    for line in _report(lifted):
        typer.echo(line)
    if plot is not None:
        from motionenv.lifting.plot import lifted_walk

        with atomic_write(plot) as temporary:
            lifted_walk(lifted).savefig(temporary, dpi=130)
        typer.echo(f"{plot}  points and depth, with 90 % bands")
    _write_gait(lifted, report, angles)


def _check_outputs(out: Path, plot: Path | None, report: Path | None, angles: Path | None) -> None:
    """Refuse files that can't be written before anything is lifted."""
    check_folder(out)
    if plot is not None:
        check_picture(plot, "--plot")
    for name, path, suffix in (("--report", report, ".html"), ("--angles", angles, ".csv")):
        if path is not None:
            check_folder(path)
            if path.suffix.lower() != suffix:
                raise MotionError(f"{name} must end in {suffix}, got {path.name}")


def _write_gait(lifted, report: Path | None, angles: Path | None) -> None:
    """Write the gait's page and table, and tell what they have."""
    from motionenv.lifting import gait_of
    from motionenv.lifting.report import known_angles, write_angles, write_gait

    if report is None and angles is None:
        return
    with err.status("drawing from the posterior"):
        found = gait_of(lifted)
    for warning in found.warnings:
        note(warning)
    if report is not None:
        write_gait(found, report)
        of_both = {p.name: p for p in found.parameters if not p.side}
        told = [f"{p.name} {p.mean:.2f} ({p.low:.2f} to {p.high:.2f}) {p.unit}"
                for name in ("speed", "step_length", "cadence") if (p := of_both.get(name))]  # fmt: skip
        typer.echo(f"{report}  {', '.join([counted(len(found.strides), 'stride'), *told]).replace('_', ' ')}")
    if angles is not None:
        write_angles(found, angles)
        typer.echo(f"{angles}  {counted(len(known_angles(found)), 'angle')} with 90 % bands")
    for cut in found.cut:
        note(f"{cut.start:.1f} to {cut.end:.1f} s: {cut.why}")


def _check_gaps(gone: np.ndarray, fps: float, out: Path) -> None:
    """Refuse formats that can't say that nobody is there in some frames (frames,)."""
    if gone.any() and out.suffix.lower() not in _WITH_GAPS:
        when = np.flatnonzero(gone)[[0, -1]] / fps
        raise MotionError(
            f"nobody is seen at times from {when[0]:.1f} to {when[1]:.1f} s, which {out.suffix} can't represent: write "
            f"{', '.join(sorted(_WITH_GAPS))}, or cut the points"
        )


def _camera(path: Path | None, which: str | None) -> dict:
    """The arguments `camera` and `distortion` of `lift`."""
    from motionenv.render.cameras import read_camera, read_distortion

    if path is None:
        if which is not None:
            raise MotionError("--which needs --camera")
        return {}
    return {"camera": read_camera(path, which), "distortion": read_distortion(path, which)}


def _checked_up(up: bool, size, camera) -> bool | None:
    if up and camera is not None and size is None:
        raise MotionError("--up with --camera needs --size: pixels are counted from the picture's lower edge")
    return up or None


def _of_film(
    film: Path, how: tuple[str, Path | None], person, taken: float | None, others: dict, known: dict
) -> tuple[Points, dict]:
    """Points of a person detected in a film, as a camera that stands still would see them, and what is known of that.

    `taken` is the rate of a film in slow motion. Refuses `others`, options of files of points.
    """
    from motionenv.mocap.keypoints.people import chosen
    from motionenv.mocap.keypoints.points2d import points_of

    if given := [name for name, value in others.items() if value is not None]:
        raise MotionError(f"--{given[0]} is only for files of points; {film.name} is a film: omit it")
    taken = taken if taken is None else checked_fps(taken)
    tracks, frames, fps = detected(film, *how)
    points = points_of(film, [chosen(film, tracks, person)], frames, taken or fps)[0]
    return _steadied(film, tracks, points, known)


def _steadied(film: Path, tracks: list, points: Points, known: dict) -> tuple[Points, dict]:
    """The points without the camera's turns, and what is known of the camera then; tells how it moves."""
    from motionenv.lifting import camera_motion
    from motionenv.mocap.keypoints.people import boxes
    from motionenv.render.video.decode import Film, video_info

    width, camera = video_info(film).width, known.get("camera")
    with err.status("looking for the camera's motion"):
        motion = camera_motion(
            Film(film, _SEEN), boxes(tracks, len(points.positions)), None if camera is None else camera.K, width=width
        )
    if motion.kind == "unknown":
        note("the background has too little structure to tell whether the camera moves: it's assumed to stand still")
    if motion.doubtful:
        note(
            f"warning: the camera moves, and perhaps not only turns ({motion.agree:.0%} of the background agree with "
            "turns), so paths, speeds and contacts may not hold: use a tripod, or turn it without walking or zooming"
        )
    if motion.kind != "turns":
        return points, known
    note(f"the camera turns by up to {motion.degrees:.1f} degrees from the first frame, which is taken out")
    steady = motion.steadied(points, distortion=known.get("distortion"), level=camera is None)
    return steady, {"camera": motion.inner if camera is None else camera}


def _read(path: Path, project: str | None, elevation: str, fps, unit, of_detector: dict):
    """Points from a file of points, or from capture by projection."""
    from motionenv.lifting import project_markers
    from motionenv.mocap import read, to_markers
    from motionenv.mocap.keypoints.exports import holds_points
    from motionenv.mocap.keypoints.points2d import read_points
    from motionenv.mocap.plausibility import find_doubts
    from motionenv.types import Motion

    suffix = path.suffix.lower()
    table = suffix in (".csv", ".trc")  # of 2D points or, to be projected, of 3D ones
    flat = suffix not in _CAPTURE and not (table and project)
    if flat or path.is_dir() or (suffix == ".npz" and holds_points(path)):
        if project is not None:
            raise MotionError(f"--project is only for 3D capture; {path.name} has 2D points: omit it")
        return read_points(path, fps=fps, unit=unit, **{k: v for k, v in of_detector.items() if v is not None})
    if given := [f"--{name}" for name, value in of_detector.items() if value is not None]:
        raise MotionError(f"{given[0]} is only for detectors' files; {path.name} has one walker: omit it")
    if project is None:
        raise MotionError(f"{path.name} is 3D capture: give the view to project it to, such as --project 30")
    capture = read(path, fps=fps, unit=unit)
    if isinstance(capture, Motion):
        raise MotionError(f"{path.name} has poses of the body, not capture: use .amc, .bvh, .c3d or .trc")
    for doubt in find_doubts(capture):
        note(f"{path.name} is not plausible: {doubt}")
    tilt = _parsed_elevation(elevation)
    return project_markers(to_markers(capture), parsed_view(project), elevation=0.0 if tilt is None else tilt)


def _parsed_elevation(text: str) -> float | None:
    """Elevation [rad], or None for "unknown"."""
    if text == "unknown":
        return None
    try:
        degrees = float(text)
    except ValueError:
        degrees = math.nan
    if not math.isfinite(degrees):
        raise MotionError(f"--elevation must be an angle in degrees or unknown, got {text!r}")
    return math.radians(degrees)


def _report(lifted) -> list[str]:
    """Summary of the result."""
    from motionenv.lifting.gait import doubts_about
    from motionenv.metrics import pelvis_mpjpe

    lines = _motion(lifted)
    band = lifted.band[np.isfinite(lifted.band)]
    if len(band):
        lines.append(f"joints ± {1000 * float(band.mean()):.0f} mm per axis (90 %), on average")
    if not lifted.plausible and not lifted.determined.any(axis=1).all():
        lines.append("warning: too little of the person shows, so uncertainties don't hold: show at least a whole leg")
    elif not lifted.plausible:
        lines.append(
            f"warning: this is unlike the people learned from (misfit {lifted.misfit:.1f}), so uncertainties don't "
            "hold: check that it shows somebody who walks or runs, and the camera if you gave one"
        )
    lines += [f"warning: {doubt}" for doubt in doubts_about(lifted)]
    if lifted.swapped.any():
        swapped = int(lifted.swapped.any(axis=1).sum())
        lines.append(f"left and right were swapped in {swapped} frames, which was corrected")
    if lifted.points.truth is not None:
        errors = 1000 * pelvis_mpjpe(lifted.positions, lifted.points.truth.positions)
        if (known := np.isfinite(errors)).any():
            lines.append(f"error against the truth: {errors[known].mean():.0f} mm per known joint, pelvis-aligned")
    return lines


def _motion(lifted) -> list[str]:
    """Directions, pace and doubtful stretches of a motion."""
    from motionenv.lifting.pipeline import FROM_AFAR

    fps, size = lifted.points.fps, lifted.free.unit_deviation
    way = np.diff(lifted.positions[:, _PELVIS, :2], axis=0)
    heading = np.degrees(lifted.heading)
    lines = [
        f"the body turns by {np.nanmax(heading) - np.nanmin(heading):.0f} degrees, mean speed "
        f"{np.nanmean(np.linalg.norm(way, axis=1)) * fps if len(way) else 0:.2f} m/s; all sizes ± {1.645 * size:.0%}"
    ]
    if lifted.points.unit == "m":
        lines.append(FROM_AFAR)
    if (other := lifted.free.other) is not None:
        lines.append(
            f"or: left and right are exchanged throughout, and the body faces another way, with probability "
            f"{other.probability:.0%}"
        )
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lifted.unlike, [0]])))
    for first, end in edges.reshape(-1, 2):
        absent = np.isnan(lifted.positions[first]).all()
        what = "nobody is seen" if absent else "postures unlike people who walk, turn or run; no bands there"
        lines.append(f"{first / fps:.1f} to {end / fps:.1f} s: {what}")
    return lines + _undetermined(lifted)


def _undetermined(lifted) -> list[str]:
    """Which markers aren't determined in which frames, one line for those that have these in common."""
    supposed = ~lifted.determined & np.isfinite(lifted.positions).all(axis=-1)
    together: dict[tuple, list[str]] = {}
    for name, frames in zip(MARKERS, supposed.T, strict=True):
        together.setdefault(tuple(np.flatnonzero(frames)), []).append(name)
    return [
        f"not determined in {len(frames)} of the frames {frames[0]}-{frames[-1]}: "
        f"{', '.join(names) if len(names) < len(MARKERS) else 'any marker, for want of a leg'}; no bands there"
        for frames, names in together.items() if frames
    ]  # fmt: skip
