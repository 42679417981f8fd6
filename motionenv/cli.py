"""The command line: `motionenv demo | fit | synth | render | mocap | models`.

Each command checks its request, does the work through the public names of the library, shows progress on stderr and
writes files whole or not at all. What the user got wrong ends in one line on stderr and exit code 2.
"""

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from motionenv import __version__
from motionenv.errors import MotionError

app = typer.Typer(
    help="Walking people with known ground truth: motion capture, models, bodies, pictures.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
mocap_app = typer.Typer(help="Motion capture: what can be fetched, and files in and out.", no_args_is_help=True)
app.add_typer(mocap_app, name="mocap")

_err = Console(stderr=True)
_VIEWS = {"side": 0.0, "front": math.pi / 2, "oblique": math.pi / 4}

Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same bytes.")]
Fps = Annotated[float | None, typer.Option(help="Frames per second, where the file doesn't say (CMU's AMC: 120).")]
Unit = Annotated[str | None, typer.Option(help="Unit of length, where the file doesn't say: m, cm, mm, inch, cmu.")]
Height = Annotated[float | None, typer.Option(help="Body height in metres; by default the model's.")]
Speed = Annotated[float | None, typer.Option(help="Walking speed in m/s; by default the walker's own.")]


def main() -> None:
    """Run the command line; a MotionError becomes one line on stderr and exit code 2."""
    try:
        app()
    except MotionError as error:
        _err.print(f"motionenv: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        sys.exit(2)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        typer.echo(f"motionenv {__version__}")
        raise typer.Exit


@contextmanager
def _progress(title: str, total: int | None) -> Iterator:
    """A bar on stderr, where that is a terminal; gives a function to call once per step."""
    columns = (TextColumn("{task.description:32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=_err, disable=not _err.is_terminal) as bar:
        task = bar.add_task(title, total=total)
        yield lambda _=None: bar.advance(task)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results; made when missing.")] = Path("motionenv-demo"),
    seed: Seed = 1,
) -> None:
    """Synthesise a person who walks, and film it beside its point-light twin.

    Needs no data and no graphics library. Example: motionenv demo --seed 7
    """
    from motionenv.demo import SECONDS, make_demo

    with _progress("a person walks", SECONDS * 30) as step:
        made = make_demo(out, seed=seed, on_frame=step)
    for path, what in made.items():
        typer.echo(f"{path}  {what}")


@app.command()
def synth(
    model: Annotated[str, typer.Argument(help="A model's name or file: see `motionenv models`.")],
    out: Annotated[Path, typer.Option(help="Where to: .bvh, .c3d, .csv, .glb or .npz.")],
    seconds: Annotated[float, typer.Option(help="Duration in seconds.")] = 10.0,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 60.0,
    seed: Seed = 0,
    speed: Speed = None,
    height: Height = None,
    phase: Annotated[float, typer.Option(help="Where in the cycle to start, in cycles.")] = 0.0,
    variation: Annotated[float, typer.Option(help="How much cycles differ; 0 repeats one exactly.")] = 1.0,
) -> None:
    """Synthesise a walk into a motion file.

    Example: motionenv synth walk/fpca --seconds 5 --speed 1.4 --seed 3 --out walk.bvh
    """
    from motionenv.mocap import write
    from motionenv.models.synthesis import synthesize

    motion = synthesize(model, seconds, fps, seed=seed, speed=speed, height=height, phase=phase, variation=variation)
    write(motion, out)
    typer.echo(f"{out}  {motion.poses.shape[0]} frames, {motion.seconds:g} s at {motion.fps:g} fps")


@app.command()
def render(
    motion: Annotated[Path, typer.Argument(help="A motion file: ours (.npz), or capture to retarget.")],
    out: Annotated[Path, typer.Option(help="Where to: .mp4, .gif, .webp, or a folder name for PNG frames.")],
    view: Annotated[str, typer.Option(help="side, front, oblique, or an angle in degrees.")] = "side",
    size: Annotated[str, typer.Option(help="Picture size, WIDTHxHEIGHT.")] = "640x480",
    points: Annotated[bool, typer.Option("--points", help="Point lights instead of a body.")] = False,
    engine: Annotated[str, typer.Option(help="raycast, or pyrender (OpenGL).")] = "raycast",
    still: Annotated[bool, typer.Option("--still", help="Hold the camera still instead of following.")] = False,
    fps: Fps = None,
    unit: Unit = None,
) -> None:
    """Film a motion.

    Example: motionenv render walk.npz --view oblique --out walk.mp4
    """
    from motionenv.mocap import read_motion
    from motionenv.render.film import film
    from motionenv.render.video import write_video

    width, height = _parsed_size(size)
    alpha = _parsed_view(view)
    loaded = read_motion(motion, fps=fps, unit=unit)
    frames = film(loaded, alpha, width=width, height=height, points=points, engine=engine, follow=not still)
    with _progress("rendering", len(loaded.poses)) as step:
        write_video(out, frames, loaded.fps, progress=step)
    typer.echo(f"{out}  {len(loaded.poses)} frames")


@app.command()
def fit(
    model: Annotated[str, typer.Argument(help="walk/fpca or walk/eigenwalkers.")],
    mocap: Annotated[Path, typer.Option(help="Folder of capture files; subfolders too.")],
    out: Annotated[Path, typer.Option(help="Model file to write (.npz).")],
    fps: Fps = None,
    unit: Unit = None,
) -> None:
    """Fit a walking model to motion capture.

    Example: motionenv fit walk/fpca --mocap cmu-walks --fps 120 --out my-walk.npz
    """
    from motionenv.models import training

    training.check_name(model)
    if not out.parent.is_dir():
        raise MotionError(f"can't write {out}: there is no folder {out.parent}; make it first, or choose another")
    with _progress("reading walks", None) as step:
        walks = training.read_walks(mocap, fps=fps, unit=unit, on_file=step)
    for name, why in walks.left_out.items():
        _err.print(f"left out {name}: {why}", markup=False, highlight=False, soft_wrap=True)
    with _err.status(f"fitting {model} to {len(walks.motions)} walks of {len(set(walks.subjects))} people"):
        rate = "" if fps is None else f" --fps {fps:g}"
        fitted = training.fit(model, walks, f"motionenv fit {model} --mocap {mocap.name}{rate} --out {out.name}")
        fitted.save(out)
    typer.echo(f"{out}  {len(walks.motions)} walks of {len(set(walks.subjects))} people")


@app.command()
def models() -> None:
    """List the models that ship, with their cards.

    Example: motionenv models
    """
    from motionenv.models.store import load, names

    for name in names():
        typer.echo(name)
        for key, value in load(name).card_.items():
            typer.echo(f"    {key}: {value}")


@mocap_app.command("list")
def mocap_list() -> None:
    """List the sources of motion capture that can be fetched.

    Example: motionenv mocap list
    """
    from motionenv.mocap.sources import list_sources

    for source in list_sources():
        typer.echo(str(source))


@mocap_app.command()
def download(
    name: Annotated[str, typer.Argument(help="A source's name: see `motionenv mocap list`.")],
    to: Annotated[Path, typer.Option(help="Folder to write to; made when missing.")],
    yes: Annotated[bool, typer.Option("--yes", help="Agree to the licence without being asked.")] = False,
    base_url: Annotated[str | None, typer.Option(help="A mirror that has the same files.")] = None,
) -> None:
    """Fetch motion capture, each file checked by SHA-256; run it again to go on where it stopped.

    Example: motionenv mocap download cmu-walks --to cmu-walks
    """
    from motionenv.mocap.sources import download as fetch
    from motionenv.mocap.sources import find_source

    source = find_source(name)
    typer.echo(str(source))
    if not yes:
        typer.confirm("Fetch under this licence?", abort=True)
    with _progress(f"fetching {name}", len(source.files)) as step:
        paths = fetch(source, to, base_url=base_url, on_file=step)
    typer.echo(f"{to}  {len(paths)} files")


@mocap_app.command()
def info(path: Annotated[Path, typer.Argument(help="A capture file.")], fps: Fps = None, unit: Unit = None) -> None:
    """Say what is in a capture file.

    Example: motionenv mocap info walk.c3d
    """
    from motionenv.mocap import describe

    typer.echo(describe(path, fps=fps, unit=unit))


@mocap_app.command()
def convert(
    path: Annotated[Path, typer.Argument(help="A capture file.")],
    out: Annotated[Path, typer.Option(help="Where to: .bvh, .c3d, .csv, .glb or .npz.")],
    fps: Fps = None,
    unit: Unit = None,
) -> None:
    """Retarget capture to the 25-DOF body and write it in another format.

    Example: motionenv mocap convert 02_01.amc --fps 120 --out walk.glb
    """
    from motionenv.mocap import read_motion, write

    motion = read_motion(path, fps=fps, unit=unit)
    write(motion, out)
    typer.echo(f"{out}  {motion.poses.shape[0]} frames")


def _parsed_view(text: str) -> float:
    """View angle α [rad] (paper B) from "side", "front", "oblique" or degrees.

    Raises:
        MotionError: none of them.
    """
    try:
        alpha = _VIEWS[text] if text in _VIEWS else math.radians(float(text))
    except ValueError:
        alpha = math.nan
    if not math.isfinite(alpha):
        raise MotionError(f"view must be {', '.join(_VIEWS)} or an angle in degrees, got {text!r}")
    return alpha


def _parsed_size(text: str) -> tuple[int, int]:
    """Width and height [pixels] from "640x480".

    Raises:
        MotionError: not two whole numbers from 16 to 4096.
    """
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdecimal() and 16 <= int(p) <= 4096 for p in parts):
        raise MotionError(f"size must be WIDTHxHEIGHT in pixels from 16 to 4096, such as 640x480; got {text!r}")
    return int(parts[0]), int(parts[1])
