"""The `dataset` commands, and `stimuli`: point-light walkers for experiments on perception."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motionenv.cli._shared import check_folder, err, made_progress, note, parsed_numbers, progress
from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.data import Made, Specification

Spec = Annotated[str, typer.Argument(
    help="Specification, .toml or .json, or a preset: see `motionenv dataset presets`.")]  # fmt: skip
Frames = Annotated[str | None, typer.Option(help="Frames, as 1e6; by default the specification's.")]
Backgrounds = Annotated[Path | None, typer.Option(help="Folder of your own photographs, before which people walk.")]
Seed = Annotated[int | None, typer.Option(min=0, help="The same seed gives the same bytes; default: specification's.")]
Form = Annotated[str, typer.Option(help="Format: webdataset or coco.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes; by default one for each core.")]


def presets(name: Annotated[str | None, typer.Argument(help="Print this one, to begin your own with.")] = None) -> None:
    """List the specifications that come with motionenv, or print one.

    Example: motionenv dataset presets tracking > mine.toml
    """
    from motionenv.data import PRESETS, Specification
    from motionenv.data.specification import preset

    if name is not None:
        typer.echo(preset(name), nl=False)
        return
    for each in PRESETS:
        spec = Specification.read(each)
        size = f"{spec.pictures.width}x{spec.pictures.height}"
        typer.echo(f"{each:16} clips of {spec.clip} frame(s), {size}: {', '.join(spec.output.fields)}")


def schema() -> None:
    """Print the JSON Schema of specifications, for editors that check files as they are written.

    Example: motionenv dataset schema > specification.schema.json
    """
    from motionenv.data import Specification

    typer.echo(json.dumps(Specification.schema(), indent=1))


def preview(
    spec: Spec, out: Annotated[Path, typer.Option(help="Contact sheet, .png.")] = Path("preview.png"),
    samples: Annotated[int, typer.Option(min=1, help="Samples in the contact sheet.")] = 16, frames: Frames = None,
    seed: Seed = None, backgrounds: Backgrounds = None,
) -> None:  # fmt: skip
    """Draw a contact sheet of a data set, before anything is made.

    Example: motionenv dataset preview tracking --samples 25 --out preview.png
    """
    from motionenv.data.preview import contact_sheet
    from motionenv.render.video.encode import write_image

    check_folder(out)
    wanted = _specification(spec, frames, seed, backgrounds)
    with err.status("drawing"):
        write_image(out, contact_sheet(wanted, samples))
    typer.echo(f"{out}  the first of {wanted.samples:,} samples in {wanted.shards:,} shards, with their joints")


def make(
    spec: Spec,
    out: Annotated[str, typer.Option(help="Folder to write to.")],
    frames: Frames = None,
    seed: Seed = None,
    backgrounds: Backgrounds = None,
    format: Form = "webdataset",
    workers: Workers = None,
    split: Annotated[str | None, typer.Option(
        help="Shares of parts with other people each: 0.8,0.1,0.1 writes train, validation, test.")] = None,
    shards: Annotated[str | None, typer.Option(help="Only these: FIRST:STOP, as 0:100, for a job of an array.")] = None,
    resume: Annotated[str, typer.Option(help="Go on with what is there? never, always, if-possible.")] = "if-possible",
) -> None:  # fmt: skip
    """Make a data set, or what is missing of it. Ctrl-C stops it; the same command goes on.

    Exit codes: 0, all that was asked for is there; 3, some shards failed (listed on stderr, the others are whole); 130,
    stopped.
    Example: motionenv dataset make keypoints --frames 1e5 --format coco --out people --workers 2
    """
    from motionenv.data import split as parts_of

    wanted = _specification(spec, frames, seed, backgrounds)
    if split is None:
        return _made(wanted, out, shards, resume, format, workers)
    if shards is not None:
        raise MotionError("--shards is for one set: leave it or --split out")
    for name, part in parts_of(wanted, parsed_numbers(split, "--split") or ()).items():
        _made(part, f"{out.rstrip('/')}/{name}", None, resume, format, workers)


def _made(wanted: "Specification", out: str, shards: str | None, resume: str, format: str, workers: int | None) -> None:
    from motionenv.data import generate

    chosen = _shards(shards, wanted)
    with made_progress("making", len(chosen) * wanted.shard_samples * wanted.clip) as step:
        made = generate(
            wanted, out, chosen, resume=resume, format=format, workers=workers,
            on_shard=lambda row: step(row["frames"], sum(file["bytes"] for file in row["files"])),
        )  # fmt: skip
    _tell(made, wanted, out)


def verify(out: Annotated[str, typer.Argument(help="Folder of a data set.")]) -> None:
    """Compare every file of a data set with the manifest. Exit code 3 if anything is missing or differs.

    Example: motionenv dataset verify people
    """
    from motionenv.data import verify as check

    with err.status("reading"):
        wrong = check(out)
    for path, why in wrong.items():
        note(f"{path} {why}")
    if wrong:
        raise typer.Exit(3)
    typer.echo(f"{out}  all files are as they were written")


def _specification(source: str, frames: str | None, seed: int | None, backgrounds: Path | None) -> "Specification":
    """The specification of `source` with --frames, --seed and --backgrounds."""
    from motionenv.data import Specification

    spec = Specification.read(source)
    if frames is not None:
        try:
            count = float(frames)
        except ValueError:
            count = 0.5
        if count != int(count) or count < 1:
            raise MotionError(f"--frames must be a whole number from 1, such as 5000 or 1e6, got {frames!r}")
        spec = spec.replace(frames=int(count))
    if backgrounds is not None:
        spec = spec.replace(pictures={"background": str(backgrounds)})
    return spec if seed is None else spec.replace(seed=seed)


def _shards(text: str | None, spec: "Specification") -> range:
    """Shards from "0:100", both ends optional; all from None."""
    if text is None:
        return range(spec.shards)
    parts = text.split(":")
    if len(parts) != 2 or not all(part == "" or part.isdecimal() for part in parts):
        raise MotionError(f"--shards must be FIRST:STOP, such as 0:100, got {text!r}")
    chosen = range(int(parts[0] or 0), min(int(parts[1] or spec.shards), spec.shards))
    if not chosen:
        raise MotionError(f"--shards {text} has none of the data set's {spec.shards}: they are 0 to {spec.shards - 1}")
    return chosen


def _tell(made: "Made", spec: "Specification", out: str) -> None:
    """Say what was made, and end with the exit code that fits."""
    typer.echo(
        f"{out}  {made.frames:,} frames in {len(made.shards)} shards ({made.bytes / 1e6:,.1f} MB); "
        f"{len(made.skipped)} were there; {made.missing} of {spec.shards} are missing"
    )
    for shard, why in made.failed.items():
        note(f"shard {shard} failed: {why}")
    if made.interrupted:
        note("stopped: run the same command again to go on")
        raise typer.Exit(130)
    if made.failed:
        note("run the same command again to make the failed shards")
        raise typer.Exit(3)


def stimuli(
    source: Annotated[Path, typer.Argument(help="What to show: .toml or .json, also the stimuli.json of a set.")],
    out: Annotated[Path, typer.Option(help="Folder that is new or empty.")],
) -> None:
    """Make a set of point-light stimuli: films or frames, tables of the dots, and stimuli.json, which makes it again.

    Example: motionenv stimuli masked.toml --out masked
    """
    from motionenv.data.stimuli import StimulusSet, write_stimuli

    asked = StimulusSet.read(source)
    with progress("drawing", asked.stimuli * asked.frames) as step:
        told = write_stimuli(asked, out, step=step)
    typer.echo(f"{told.parent}  {asked.stimuli} stimuli of {asked.frames} frames")
