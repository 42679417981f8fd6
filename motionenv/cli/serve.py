"""The command `serve`."""

import runpy
import sys

import typer


def serve(context: typer.Context) -> None:
    """Start the HTTP service with its web page. See `motionenv serve --help` for its options.

    Example: motionenv serve --port 8080 --workers 2
    """
    sys.argv = ["motionenv serve", *context.args]
    runpy.run_module("service", run_name="__main__")
