"""The `report` and `compare` commands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from motionenv._core.representation import counted
from motionenv.cli._shared import Fps, Map, Person, Static, Unit, Up, Wands, check_folder, marker_map, note, progress
from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.gait import Band


def report(
    files: Annotated[list[Path], typer.Argument(help="Captures of one person: .c3d, .trc, .bvh, .amc or .npz.")],
    out: Annotated[Path, typer.Option(help="Output page, .html; .json and .csv are written beside it.")],
    fps: Fps = None, unit: Unit = None, up: Up = None, person: Person = None, map_: Map = None, static: Static = None,
    wands: Wands = "auto",
    group: Annotated[Path | None, typer.Option(
        help="Reference: a folder of captures, or a file of --save-group; by default CMU's people.")] = None,
    save_group: Annotated[Path | None, typer.Option(help="Write the band of --group to this file, .json.")] = None,
    age: Annotated[float | None, typer.Option(
        help="Age [years], to show published norms beside step parameters.")] = None,
    sex: Annotated[str | None, typer.Option(help="female or male, for norms that part them.")] = None,
) -> None:  # fmt: skip
    """Write a gait report: step parameters, and joint angles over the gait cycle against a reference.

    In a folder of captures a file's name up to the first "_" is the person's label.

    Example: motionenv report walk1.c3d walk2.c3d --static standing.c3d --out report.html
    """
    from motionenv.gait import norms_for, write_report

    if save_group is not None and group is None:
        raise MotionError("--save-group writes the band of --group: give the folder of captures with --group")
    check_folder(out)
    norms_for(age, sex)
    chosen = marker_map(map_)
    band = None if group is None else _band(group, marker_map=chosen, fps=fps, unit=unit, wands=wands)
    if band is not None and save_group is not None:
        band.save(save_group)
    with progress("analysing", len(files)) as step:
        session = write_report(
            files, out, static=static, marker_map=chosen, fps=fps, unit=unit, up=up, person=person, wands=wands,
            band=band, age=age, sex=sex, on_step=step,
        )  # fmt: skip
    for trial in session.trials:
        for doubt in trial.doubts:
            note(f"{trial.name} is not plausible: {doubt}")
    for name, why in session.left_out.items():
        note(f"{name} was left out: {why}")
    typer.echo(f"{out}  {counted(len(session.strides), 'stride')} of {session.person}")


def compare(
    folders: Annotated[list[Path], typer.Argument(help="One or two folders of captures.")],
    out: Annotated[Path, typer.Option(help="Output page, .html; .json and .csv are written beside it.")],
    effect: Annotated[str | None, typer.Option(
        help="speed, or a column of --people; by default the second folder over the first.")] = None,
    adjust: Annotated[str, typer.Option(help="What is held constant: speed or columns, separated by commas.")] = "",
    people: Annotated[Path | None, typer.Option(help='Table, .csv, with a column "person" and others.')] = None,
    paired: Annotated[bool | None, typer.Option(
        "--paired/--independent", help="Are equal labels in both folders the same people?")] = None,
    side: Annotated[str, typer.Option(help="Whose strides: both, left or right.")] = "both",
    level: Annotated[float, typer.Option(min=0.5, max=0.999, help="Of the bands.")] = 0.95,
    fps: Fps = None, unit: Unit = None, map_: Map = None, wands: Wands = "auto",
) -> None:  # fmt: skip
    """Compare joint angles of two groups of people, or test what speed or anything else has to do with them.

    A file's name up to the first "_" is the person's label.

    Example: motionenv compare slow fast --paired --out compare.html
    """
    from motionenv.gait import compare, read_people, read_table, write_comparison

    check_folder(out)
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) < len(names):
        names = [str(folder) for folder in folders]
    groups = {}
    for name, folder in zip(names, folders, strict=True):
        if not folder.is_dir():
            raise MotionError(f"{folder} is no folder of captures")
        with progress(f"reading {name}", None) as step:
            groups[name], left_out = read_people(
                folder, marker_map=marker_map(map_), fps=fps, unit=unit, wands=wands, on_file=step
            )
        for file, why in left_out.items():
            note(f"{file} was left out: {why}")
    found = compare(
        groups, effect=effect, adjust=[name for name in adjust.split(",") if name],
        table=None if people is None else read_table(people), paired=paired, side=side, level=level,
    )  # fmt: skip
    write_comparison(found, out)
    for text in (*found.doubts, *found.notes):
        note(text)
    differ = [name.replace("_", " ") for name, p in found.p.items() if p <= 1 - level]
    typer.echo(f"{out}  {found.what}: {', '.join(differ) or 'no angle'} (of {counted(len(found.p), 'angle')})")


def _band(group: Path, **how: Any) -> "Band":
    """The band of a folder of captures, or of a file of one."""
    from motionenv.gait import load_band, read_group

    if not group.is_dir():
        return load_band(group)
    with progress("reading the group", None) as step:
        band, left_out = read_group(group, on_file=step, **how)
    for name, why in left_out.items():
        note(f"{name} is not in the group: {why}")
    return band
