"""The command line.

`motionenv demo | synth | sample | render | lift | track | evaluate | report | compare | fit | models | stimuli |
serve | bench | mocap | dataset | compile`.

Each command validates its arguments, does the work through the library's public names, shows progress on stderr and
writes files atomically. User errors end in one line on stderr and exit code 2.
"""

import sys
import warnings
from typing import Annotated

import typer

from motionenv import __version__
from motionenv.cli import bench, dataset, evaluate, gait, lifting, mocap, models, serve, synthesis, tracking
from motionenv.cli._shared import err, note
from motionenv.errors import CaptureWarning, MotionError

__all__ = ["app", "main"]

app = typer.Typer(
    help="Walking people with known ground truth: motion capture, motion models, rendering, tracking.",
    no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
)  # fmt: skip
app.command()(synthesis.demo)
app.command()(synthesis.synth)
app.command()(synthesis.sample)
app.command()(synthesis.render)
app.command()(lifting.lift)
app.command()(tracking.track)
app.command()(evaluate.evaluate)
app.command()(gait.report)
app.command()(gait.compare)
app.command()(models.fit)
app.command()(dataset.stimuli)
_passed_on = {"allow_extra_args": True, "ignore_unknown_options": True}
app.command(context_settings=_passed_on, add_help_option=False)(serve.serve)
app.command("compile")(bench.compile_kernels)
app.command(context_settings=_passed_on)(bench.bench)

dataset_app = typer.Typer(help="Data sets of walking people: preview, make, verify.", no_args_is_help=True)
dataset_app.command()(dataset.presets)
dataset_app.command()(dataset.schema)
dataset_app.command()(dataset.preview)
dataset_app.command()(dataset.make)
dataset_app.command()(dataset.verify)
app.add_typer(dataset_app, name="dataset")

models_app = typer.Typer()
models_app.callback(invoke_without_command=True)(models.models)
models_app.command()(models.describe)
app.add_typer(models_app, name="models")

mocap_app = typer.Typer(help="Motion capture: download, inspect and convert files.", no_args_is_help=True)
mocap_app.command("list")(mocap.mocap_list)
mocap_app.command()(mocap.download)
mocap_app.command()(mocap.info)
mocap_app.command("map")(mocap.guess)
mocap_app.command()(mocap.convert)
app.add_typer(mocap_app, name="mocap")


def main() -> None:
    """Run the command line; a MotionError becomes one line on stderr and exit code 2."""
    warnings.simplefilter("always", CaptureWarning)
    warnings.showwarning = lambda message, *_: note(f"motionenv: {message}")
    try:
        app()
    except MotionError as error:
        err.print(f"motionenv: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        sys.exit(2)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        typer.echo(f"motionenv {__version__}")
        raise typer.Exit
