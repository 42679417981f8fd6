"""The command line: `motionenv demo | synth | sample | render | lift | track | fit | models | serve | bench | mocap`.

Each command checks its request, does the work through the public names of the library, shows progress on stderr and
writes files whole or not at all. What the user got wrong ends in one line on stderr and exit code 2.
"""

import sys
from typing import Annotated

import typer

from motionenv import __version__
from motionenv.cli import bench, capture, learning, lifting, making, serving, tracking
from motionenv.cli._shared import err
from motionenv.errors import MotionError

__all__ = ["app", "main"]

app = typer.Typer(
    help="Walking people with known ground truth: motion capture, models, bodies, pictures.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.command()(making.demo)
app.command()(making.synth)
app.command()(making.sample)
app.command()(making.render)
app.command()(lifting.lift)
app.command()(tracking.track)
app.command()(learning.fit)
app.command()(learning.models)
_passed_on = {"allow_extra_args": True, "ignore_unknown_options": True}
app.command(context_settings=_passed_on, add_help_option=False)(serving.serve)
app.command(context_settings=_passed_on)(bench.bench)

mocap_app = typer.Typer(help="Motion capture: what can be fetched, and files in and out.", no_args_is_help=True)
mocap_app.command("list")(capture.mocap_list)
mocap_app.command()(capture.download)
mocap_app.command()(capture.info)
mocap_app.command()(capture.convert)
app.add_typer(mocap_app, name="mocap")


def main() -> None:
    """Run the command line; a MotionError becomes one line on stderr and exit code 2."""
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
