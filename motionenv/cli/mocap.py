"""The `mocap` commands: list, download, info, map, convert."""

from pathlib import Path
from typing import Annotated, Any

import typer

from motionenv.cli._shared import (
    BodyModel,
    Fill,
    Fps,
    Map,
    Person,
    Static,
    Unit,
    Up,
    check_folder,
    marker_map,
    note,
    progress,
)  # fmt: skip
from motionenv.errors import GapError, MotionError


def mocap_list() -> None:
    """List the motion capture that can be downloaded.

    Example: motionenv mocap list
    """
    from motionenv.mocap.sources import list_sources

    for source in list_sources():
        typer.echo(str(source))


def download(
    name: Annotated[str, typer.Argument(help="Name of the source: see `motionenv mocap list`.")],
    to: Annotated[Path, typer.Option(help="Output folder; created if necessary.")],
    yes: Annotated[bool, typer.Option("--yes", help="Accept the licence without a prompt.")] = False,
    base_url: Annotated[str | None, typer.Option(help="URL of a mirror with the same files.")] = None,
) -> None:
    """Download motion capture and verify each file by SHA-256. Run it again to resume.

    Example: motionenv mocap download cmu-walks --to cmu-walks
    """
    from motionenv.mocap.sources import download as fetch
    from motionenv.mocap.sources import find_source

    source = find_source(name)
    typer.echo(str(source))
    if not yes:
        typer.confirm("Download under this licence?", abort=True)
    with progress(f"fetching {name}", len(source.files)) as step:
        paths = fetch(source, to, base_url=base_url, on_file=step)
    typer.echo(f"{to}  {len(paths)} files")


def info(
    path: Annotated[Path, typer.Argument(help="A capture file.")],
    fps: Fps = None, unit: Unit = None, up: Up = None, person: Person = None, body_model: BodyModel = None,
) -> None:  # fmt: skip
    """Summarise a capture file.

    Example: motionenv mocap info walk.c3d
    """
    from motionenv.mocap import describe

    typer.echo(describe(path, fps=fps, unit=unit, up=up, person=person, body_model=body_model))


def guess(
    path: Annotated[Path, typer.Argument(help="A capture file.")],
    out: Annotated[Path, typer.Option(help="Output file, .toml.")],
    fps: Fps = None, unit: Unit = None, up: Up = None, person: Person = None,
) -> None:  # fmt: skip
    """Write a first guess of which points of a file are which landmarks, to be edited and passed with --map.

    Example: motionenv mocap map walk.c3d --out map.toml
    """
    from motionenv._core.files import atomic_write
    from motionenv.mocap import MarkerMap, read
    from motionenv.mocap.marker_sets import annotated
    from motionenv.types import Motion

    check_folder(out)
    capture = read(path, fps=fps, unit=unit, up=up, person=person)
    if isinstance(capture, Motion):
        raise MotionError(f"{path}: holds poses of the body, which need no marker map")
    text = annotated(capture)
    with atomic_write(out) as temporary:
        Path(temporary).write_text(text, encoding="utf-8")
    guessed = len(MarkerMap.parse(text).points)
    typer.echo(f"{out}  {guessed} landmarks guessed from {len(capture.names)} points: check them")


def convert(
    path: Annotated[Path, typer.Argument(help="A capture file.")],
    out: Annotated[Path, typer.Option(help="Output file: .bvh, .c3d, .csv, .glb, .mot, .npz or .trc.")],
    fps: Fps = None, unit: Unit = None, up: Up = None, person: Person = None, body_model: BodyModel = None,
    map_: Map = None, static: Static = None, fill: Fill = False,
    points: Annotated[bool, typer.Option("--points", help="Keep the file's own points (.c3d and .trc).")] = False,
) -> None:  # fmt: skip
    """Retarget capture to the 25-DOF body and write it in another format.

    Limbs that the capture doesn't show stay unknown; --fill estimates them. C3D files also get gait events and clinical
    joint angles. With --points, a C3D or TRC file gets the capture's own points instead of the body's.

    Example: motionenv mocap convert 02_01.amc --fps 120 --out walk.glb
    """
    from motionenv.body.gaps import listed, missing_parts
    from motionenv.mocap import read_motion, write
    from motionenv.mocap.writing import check_suffix
    from motionenv.models import filling

    check_suffix(out)
    how: dict[str, Any] = {"fps": fps, "unit": unit, "up": up, "person": person, "body_model": body_model}
    chosen = marker_map(map_)
    if points:
        _convert_points(path, out, chosen, static, how)
        return
    motion = read_motion(path, marker_map=chosen, static=static, **how)
    motion = filling.fill(motion) if fill else motion
    if missing := missing_parts(motion.poses):
        note(f"{path.name} doesn't show {listed(missing)}: --fill estimates them")
    write(motion, out, **_gait(path, out, chosen, static, how))
    share = "" if motion.filled is None else f", {motion.filled.mean():.0%} of the entries filled by the model"
    typer.echo(f"{out}  {motion.poses.shape[0]} frames{share}")


def _convert_points(path: Path, out: Path, chosen, static: Path | None, how: dict) -> None:
    """Write the points of a capture, with events and angles where the format holds them."""
    from motionenv.mocap import read, write_markers
    from motionenv.mocap.plausibility import find_doubts
    from motionenv.types import Motion

    capture = read(path, **how)
    if isinstance(capture, Motion):
        raise MotionError(f"{path}: holds poses of the body and no points: leave out --points")
    for doubt in find_doubts(capture, chosen):
        note(f"{path.name} is not plausible: {doubt}")
    write_markers(capture, out, **_gait(path, out, chosen, static, how))
    typer.echo(f"{out}  {len(capture.positions)} frames, {len(capture.names)} points")


def _gait(path: Path, out: Path, chosen, static: Path | None, how: dict) -> dict:
    """Events and clinical angles of a capture, for a C3D file; nothing if it shows no gait."""
    from motionenv.gait import analyse
    from motionenv.mocap import read, read_static

    if out.suffix.lower() != ".c3d":
        return {}
    standing = None if static is None else read_static(static, unit=how["unit"], up=how["up"])
    try:
        trial = analyse(read(path, **how), static=standing, marker_map=chosen)
    except GapError as error:
        note(f"no events or clinical angles: {error}")
        return {}
    return {"events": trial.events.events, "angles": trial.angles}
