"""The `mocap` commands: list, download, info, convert."""

from pathlib import Path
from typing import Annotated

import typer

from motionenv.cli._shared import BodyModel, Fill, Fps, Unit, note, progress


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
    fps: Fps = None,
    unit: Unit = None,
    body_model: BodyModel = None,
) -> None:
    """Summarise a capture file.

    Example: motionenv mocap info walk.c3d
    """
    from motionenv.mocap import describe

    typer.echo(describe(path, fps=fps, unit=unit, body_model=body_model))


def convert(
    path: Annotated[Path, typer.Argument(help="A capture file.")],
    out: Annotated[Path, typer.Option(help="Output file: .bvh, .c3d, .csv, .glb, .mot, .npz, .rrd or .trc.")],
    fps: Fps = None,
    unit: Unit = None,
    body_model: BodyModel = None,
    fill: Fill = False,
) -> None:
    """Retarget capture to the 25-DOF body and write it in another format.

    Limbs that the capture doesn't show stay unknown; --fill estimates them.
    Example: motionenv mocap convert 02_01.amc --fps 120 --out walk.glb
    """
    from motionenv.body.gaps import listed, missing_parts
    from motionenv.mocap import write
    from motionenv.mocap.writing import check_suffix
    from motionenv.models.filling import read_motion

    check_suffix(out)
    motion = read_motion(path, fill=fill, fps=fps, unit=unit, body_model=body_model)
    if missing := missing_parts(motion.poses):
        note(f"{path.name} doesn't show {listed(missing)}: --fill estimates them")
    write(motion, out)
    share = "" if motion.filled is None else f", {motion.filled.mean():.0%} of the entries filled by the model"
    typer.echo(f"{out}  {motion.poses.shape[0]} frames{share}")
