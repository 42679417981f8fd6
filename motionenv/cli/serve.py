"""The commands `serve` and `work`."""

import runpy
import sys

import typer


def serve(context: typer.Context) -> None:
    """Start the HTTP service with its web page. See `motionenv serve --help` for its options.

    Example: motionenv serve --port 8080 --workers 2
    """
    sys.argv = ["motionenv serve", *context.args]
    runpy.run_module("service", run_name="__main__")


def work(context: typer.Context) -> None:
    """Run jobs of a service of several machines. See `motionenv work --help` for its options.

    Example: motionenv work --database postgresql://motionenv@db/motionenv --store s3://motionenv
    """
    sys.argv = ["motionenv work", *context.args]
    runpy.run_module("service.cluster", run_name="__main__")
