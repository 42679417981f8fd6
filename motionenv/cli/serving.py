"""The command that starts the service: serve."""

import runpy
import sys

import typer


def serve(context: typer.Context) -> None:
    """Serve motion over HTTP, and the page on which to play with it; the service reads its own options.

    Example: motionenv serve --port 8080 --workers 2
    """
    sys.argv = ["motionenv serve", *context.args]
    runpy.run_module("service", run_name="__main__")
