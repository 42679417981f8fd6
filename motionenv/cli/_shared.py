"""Common parts of the commands: options, console, progress, and parsing of views and sizes."""

import inspect
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from motionenv.arguments import ARGUMENTS, WALK_ARGUMENTS
from motionenv.errors import MotionError

if TYPE_CHECKING:
    from motionenv.mocap import MarkerMap

#: Console for everything except results.
err = Console(stderr=True)

Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same bytes.")]
Fps = Annotated[float | None, typer.Option(help="Frame rate, if the file doesn't specify it (CMU's AMC files: 120).")]
Unit = Annotated[str | None, typer.Option(
    help="Length unit, if the file doesn't specify it: m, cm, mm, inch, cmu, or metres per unit.")]  # fmt: skip
Up = Annotated[str | None, typer.Option(help="Vertical axis of the file, if it isn't the usual one: x, y or z.")]
Person = Annotated[str | None, typer.Option(
    help="Which of several people: the name in front of their points. Default: the wholest.")]  # fmt: skip
BodyModel = Annotated[Path | None, typer.Option(help="NPZ file of the body model, for poses of AMASS.")]
Map = Annotated[str | None, typer.Option(
    "--map", help="Marker map (file of `motionenv mocap map`), or a marker set's name.")]  # fmt: skip
Static = Annotated[Path | None, typer.Option(help="Standing trial of the same person (.c3d or .trc).")]
Wands = Annotated[str, typer.Option(
    help="Markers on thighs and shanks: use, ignore, or auto, which leaves out those that can't be.")]  # fmt: skip
Fill = Annotated[bool, typer.Option("--fill", help="Fill what the capture doesn't show, such as arms, by a prior.")]
View = Annotated[str, typer.Option(help="side, front, oblique, or a view angle in degrees.")]
Size = Annotated[str, typer.Option(help="Image size in pixels, WIDTHxHEIGHT.")]

Detector = Annotated[str, typer.Option(help="What detects people in a film: blazepose or rtmpose.")]
Weights = Annotated[Path | None, typer.Option(
    help="The detector's models: their folder, or MediaPipe's .task file or wheel; else downloaded once.")]  # fmt: skip

_Command = TypeVar("_Command", bound=Callable[..., None])
_VIEWS = {"side": 0.0, "front": math.pi / 2, "oblique": math.pi / 4}


def walk_options(command: _Command) -> _Command:
    """Decorator that gives a command with `**walk` an option for each of `WalkArguments`."""
    signature = inspect.signature(command)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    options = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=ARGUMENTS[name].default,
            annotation=Annotated[ARGUMENTS[name].type, typer.Option(help=str(ARGUMENTS[name].meaning))],
        )
        for name in WALK_ARGUMENTS
    ]  # fmt: skip
    command.__signature__ = signature.replace(parameters=[*own, *options])  # type: ignore[attr-defined]
    return command


@contextmanager
def progress(title: str, total: int | None) -> Iterator[Callable[..., None]]:
    """A progress bar on stderr, if that is a terminal; yields a function to call after each step."""
    columns = (TextColumn("{task.description:32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, disable=not err.is_terminal) as bar:
        task = bar.add_task(title, total=total)
        yield lambda _=None: bar.advance(task)


@contextmanager
def made_progress(title: str, total: int, unit: str = "frames") -> Iterator[Callable[[int, int], None]]:
    """A progress bar of much work, with rate, time left and bytes; yields a function of how much more, and bytes."""
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[size]}"), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=err, disable=not err.is_terminal) as bar:
        task, written = bar.add_task(title, total=total, rate="", size=""), 0

        def step(more: int, size: int) -> None:
            nonlocal written
            written += size
            speed = bar.tasks[0].finished_speed or bar.tasks[0].speed
            rate = f"{speed:,.0f} {unit}/s" if speed else ""
            bar.update(task, advance=more, rate=rate, size=f"{written / 1e6:,.0f} MB" if written else "")

        yield step


def detected(film: Path, name: str, weights: Path | None, seconds: float = 3600.0) -> tuple[list, int, float]:
    """Tracks of everybody whom a detector sees in a film, the number of frames, and their rate [Hz]; says who it is."""
    from motionenv.mocap.keypoints.detector import detect_people, detector
    from motionenv.render.video.decode import read_frames, video_info

    fps, seen_by = video_info(film).fps, detector(name, weights)
    with progress("detecting people", None) as step:
        tracks, frames = detect_people(read_frames(film, seconds=seconds), seen_by, on_progress=step, name=str(film))
    people = "; ".join(f"{i}: in {len(track)} frames from {min(track)}" for i, track in enumerate(tracks[:5]))
    note(f"{film.name}: {frames} frames at {fps:.4g} fps; {name} found {len(tracks)} people, {people}")
    return tracks, frames, fps


def parsed_person(text: str | None) -> int | list[int] | None:
    """Index of a person from "2", or of the parts of one from "0,3"; None from None."""
    if text is None:
        return None
    if not all(part.strip().isdecimal() for part in text.split(",")):
        raise MotionError(f"--person must be a number, or those of the parts of one person, such as 0,3; got {text!r}")
    numbers = [int(part) for part in text.split(",")]
    return numbers[0] if len(numbers) == 1 else numbers


def note(text: str) -> None:
    """Print one line on stderr, without formatting."""
    err.print(text, markup=False, highlight=False, soft_wrap=True)


def marker_map(text: str | None) -> "MarkerMap | str | None":
    """The marker map of --map: that of a file, or the name of a set."""
    from motionenv.mocap import MarkerMap
    from motionenv.mocap.marker_sets import marker_sets

    names = [known.name for known in marker_sets()]
    if text is None or text in names:
        return text
    if not Path(text).is_file():
        near = get_close_matches(text, names, 1, 0.0)[0]
        raise MotionError(
            f"--map must be a file, or a marker set ({', '.join(names)}); did you mean {near}? Got {text}"
        )
    return MarkerMap.read(text)


def check_folder(out: Path) -> None:
    """Check that the folder of an output file exists, before any work."""
    if not out.parent.is_dir():
        raise MotionError(f"can't write {out}: there is no folder {out.parent}; create it, or choose another")


def check_picture(out: Path, option: str) -> None:
    """Check the file to which matplotlib is to draw, before any work; `option` names it."""
    if out.suffix.lower() not in (".pdf", ".png", ".svg"):
        raise MotionError(f"{option} must end in .pdf, .png or .svg, got {out}")
    check_folder(out)


def parsed_numbers(text: str | None, name: str) -> list[float] | None:
    """Numbers from "1,0,-2"; None from None. `name` is the option, with its dashes."""
    try:
        return None if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise MotionError(f"{name} must be numbers separated by commas, such as 1,0,-2; got {text!r}") from None


def parsed_speed(text: str | None) -> float | list[list[float]] | None:
    """A speed from "1.3", rows (time, speed) from "0:0 1:1.3"; None from None."""
    try:
        if text is None or ":" not in text:
            return None if text is None else float(text)
        rows = [[float(number) for number in pair.split(":")] for pair in text.split()]
        if any(len(row) != 2 for row in rows):
            raise ValueError
    except ValueError:
        raise MotionError(
            f"--speed must be a number of m/s, or TIME:SPEED pairs, as '0:0 1:1.3'; got {text!r}"
        ) from None
    return rows


def parsed_path(text: str | None):
    """A path from "arc:3,90", points (n, 2) from "0,0 2,0 3,1" or a file of such rows; None from None."""
    from motionenv.models.paths import WalkPath

    if text is None:
        return None
    is_arc = text.startswith("arc:")
    try:
        rows = Path(text).read_text().splitlines() if text.endswith(".csv") else text.removeprefix("arc:").split()
        points = [[float(number) for number in row.split(",")] for row in rows if row.strip()]
        if any(len(point) != 2 for point in points) or (is_arc and len(points) != 1):
            raise ValueError
    except OSError as error:
        raise MotionError(f"can't read --path {text}: {error.strerror}") from None
    except ValueError:
        wanted = "arc:RADIUS,DEGREES, points 'X,Y X,Y ...' in metres, or a .csv file with X,Y in each row"
        raise MotionError(f"--path must be {wanted}; got {text!r}") from None
    return WalkPath.arc(points[0][0], math.radians(points[0][1])) if is_arc else WalkPath.through(points)


def parsed_view(text: str) -> float:
    """View angle α [rad] (paper B) from "side", "front", "oblique" or degrees."""
    try:
        alpha = _VIEWS[text] if text in _VIEWS else math.radians(float(text))
    except ValueError:
        alpha = math.nan
    if not math.isfinite(alpha):
        raise MotionError(f"view must be {', '.join(_VIEWS)} or an angle in degrees, got {text!r}")
    return alpha


def parsed_size(text: str) -> tuple[int, int]:
    """Width and height, 16 to 4096 [pixels], from "640x480"."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdecimal() and 16 <= int(p) <= 4096 for p in parts):
        raise MotionError(f"size must be WIDTHxHEIGHT in pixels from 16 to 4096, such as 640x480; got {text!r}")
    return int(parts[0]), int(parts[1])
