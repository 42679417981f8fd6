"""The `lift` command: 3D motion from 2D points."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from motionenv._core.files import atomic_write
from motionenv.cli._shared import Fps, Unit, check_folder, err, parsed_size, parsed_view
from motionenv.errors import MotionError

_POINTS = {".json", ".csv"}
_PICTURES = {".png", ".pdf", ".svg"}


def lift(
    points: Annotated[
        Path, typer.Argument(help="2D points (detector's .json, folder of them, .trc or .csv), or 3D capture.")
    ],
    out: Annotated[Path, typer.Option(help="Output file: .bvh, .c3d, .csv, .glb, .mot, .npz, .rrd or .trc.")],
    view: Annotated[str, typer.Option(help="unknown, side, front, oblique, or a view angle in degrees.")] = "unknown",
    elevation: Annotated[str, typer.Option(help="Angle by which the camera looks down, in degrees, or unknown.")] = "0",
    scale: Annotated[float | None, typer.Option(help="Pixels per metre at the walker; by default estimated.")] = None,
    project: Annotated[str | None, typer.Option(help="For 3D capture: the view to project it to.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Plot of the estimate (.png, .pdf, .svg).")] = None,
    prior: Annotated[str, typer.Option(help="Name or file of the prior; see `motionenv fit`.")] = "walk/prior",
    person: Annotated[int | None, typer.Option(help="Index of the person in a detector's file.")] = None,
    format: Annotated[str | None, typer.Option(help="Keypoints in JSON, such as halpe-26; else recognised.")] = None,
    size: Annotated[str | None, typer.Option(help="Picture, WIDTHxHEIGHT, if points are relative to it.")] = None,
    fps: Fps = None,
    unit: Unit = None,
) -> None:
    """Lift a walk from the 2D points of one camera to 3D, from any view.

    Capture (.amc, .bvh, .c3d, .trc) is projected first, and the result compared with it.
    Example: motionenv lift points.csv --view unknown --out walk.npz --plot walk.png
    """
    from motionenv.lifting import lift as lift_points
    from motionenv.mocap import write
    from motionenv.mocap.writing import check_suffix

    check_suffix(out)
    if plot is not None and plot.suffix.lower() not in _PICTURES:
        raise MotionError(f"--plot must end in {', '.join(sorted(_PICTURES))}, got {plot}")
    for path in (out, plot):
        if path is not None:
            check_folder(path)
    alpha = None if view == "unknown" else parsed_view(view)
    of_detector = {"person": person, "format": format, "size": None if size is None else parsed_size(size)}
    loaded = _read(points, project, elevation, fps, unit, of_detector)
    with err.status("lifting"):
        lifted = lift_points(loaded, alpha, prior=prior, elevation=_parsed_elevation(elevation), scale=scale)
        motion = lifted.motion()
    write(motion, out)
    typer.echo(f"{out}  {len(motion.poses)} frames, {motion.seconds:.2f} s at {motion.fps:g} fps")
    for line in _report(lifted):
        typer.echo(line)
    if plot is not None:
        from motionenv.lifting.plot import lifted_walk

        with atomic_write(plot) as temporary:
            lifted_walk(lifted).savefig(temporary, dpi=130)
        typer.echo(f"{plot}  points and depth, with 90 % bands")


def _read(path: Path, project: str | None, elevation: str, fps, unit, of_detector: dict):
    """Points from a file of points, or from capture by projection."""
    from motionenv.lifting import project_markers
    from motionenv.mocap import read, to_markers
    from motionenv.mocap.keypoints.points2d import read_points
    from motionenv.types import Motion

    if path.suffix.lower() in _POINTS or path.is_dir() or (path.suffix.lower() == ".trc" and project is None):
        if project is not None:
            raise MotionError(f"--project is only for 3D capture; {path.name} has 2D points: omit it")
        return read_points(path, fps=fps, unit=unit, **of_detector)
    if given := [f"--{name}" for name, value in of_detector.items() if value is not None]:
        raise MotionError(f"{given[0]} is only for detectors' files; {path.name} has one walker: omit it")
    if project is None:
        raise MotionError(f"{path.name} is 3D capture: give the view to project it to, such as --project 30")
    capture = read(path, fps=fps, unit=unit)
    if isinstance(capture, Motion):
        raise MotionError(f"{path.name} has poses of the body, not capture: use .amc, .bvh, .c3d or .trc")
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
    from motionenv.lifting import MISFIT_LIMIT
    from motionenv.lifting.posterior import BAND
    from motionenv.metrics import pelvis_mpjpe

    found, points = lifted.posterior, lifted.points
    degrees = math.degrees(found.alpha)
    sure = BAND * math.degrees(found.standard_deviation("alpha"))
    lines = [
        f"view {degrees:.1f} ± {sure:.1f} degrees (90 %), elevation {math.degrees(found.elevation):.1f}; "
        f"{found.frequency:.3f} strides per second, {lifted.walker.speed:.2f} m/s",
        f"joints ± {1000 * float(lifted.band.mean()):.0f} mm per axis (90 %), on average",
    ]
    for other in lifted.others:
        lines.append(f"or: view {math.degrees(other.alpha):.0f} degrees, with probability {other.probability:.0%}")
    if lifted.contradiction is not None:
        lines.append(
            f"warning: the points contradict --view and fit {math.degrees(lifted.contradiction.alpha):.0f} degrees: "
            "correct --view, or the left and right labels"
        )
    if not lifted.plausible:
        lines.append(
            f"warning: this walk is unlike those of the prior (misfit {lifted.misfit:.1f}, usually below "
            f"{MISFIT_LIMIT:g}), so the uncertainties above are invalid: check that it goes straight ahead at a steady "
            "pace, and the view, scale or camera if you gave one"
        )
    if lifted.swapped.any():
        lines.append(
            f"left and right were swapped in {int(lifted.swapped.any(axis=1).sum())} frames, which was corrected"
        )
    if points.truth is not None:
        errors = 1000 * pelvis_mpjpe(found.positions, points.truth.positions)
        if (known := np.isfinite(errors)).any():
            lines.append(f"error against the truth: {errors[known].mean():.0f} mm per known joint, pelvis-aligned")
    return lines
