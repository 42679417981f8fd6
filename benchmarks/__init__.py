"""Benchmarks, one module per claim. Each prints its tables; RESULTS.md holds the results.

Run them from a checkout: `motionenv bench NAME` or `python -m benchmarks.NAME`. With --quick, a benchmark does all its
steps on tiny inputs in seconds, to show that they run; `motionenv bench all --quick` does so for all of them.
"""

import argparse
import atexit
import importlib
import importlib.util
import io
import json
import os
import shutil
import sys
import tempfile
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
#: Default folder of motion capture; --mocap overrides it.
MOCAP = Path(os.environ.get("MOTIONENV_MOCAP", ROOT.parent / "shared" / "mocap"))
MARK, HEADLINE = "quick: ", "headline: "


class Skipped(SystemExit):
    """What a benchmark needs is missing. The status is 0 with --quick, which checks what can be checked."""

    def __init__(self, reason: str):
        self.reason = reason
        print(f"skipped: {reason}", flush=True)
        super().__init__(0 if "--quick" in sys.argv else 2)


class Arguments(argparse.ArgumentParser):
    """Command line of a benchmark: --quick, --mocap if it reads motion capture, and what it adds.

    Args:
        doc: its module's docstring, which shows how to run it.
        mocap: folders of the motion capture that it can't do without, or True if it does more where there is some.
    """

    def __init__(self, doc: str | None, *, mocap: tuple[str, ...] | bool = ()):
        super().__init__(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
        self._mocap, self._quick = mocap, {}
        self.add_argument("--quick", action="store_true", help="all steps on tiny inputs; the numbers mean nothing")
        if mocap:
            self.add_argument("--mocap", type=Path, default=MOCAP, help="folder of motion capture")

    def add_argument(self, *names: str, quick: Any = None, **how: Any) -> argparse.Action:
        """As of argparse; `quick` is the default with --quick, and makes an argument optional there."""
        action = super().add_argument(*names, **how)
        if quick is not None:
            self._quick[action.dest] = quick
        return action

    def parse_args(self, *given: Any) -> argparse.Namespace:
        """As of argparse. With --quick, everything that is printed from here on is marked.

        Raises:
            Skipped: there is no motion capture where it is needed.
        """
        if "--quick" in sys.argv:
            for action in self._actions:
                action.required = action.required and action.dest not in self._quick
            self.set_defaults(**self._quick)
        asked = super().parse_args(*given)
        if asked.quick and not isinstance(sys.stdout, _Marked):
            sys.stdout = _Marked(sys.stdout)
        for folder in self._mocap if isinstance(self._mocap, tuple) else ():
            if not (asked.mocap / folder).exists():
                raise Skipped(f"no motion capture at {asked.mocap / folder}; --mocap names its folder")
        if asked.quick and self._mocap and asked.mocap.is_dir():
            asked.mocap = importlib.import_module("benchmarks.few_captures").few(asked.mocap)
        if self._mocap is True and not asked.mocap.is_dir():
            print(f"skipped: what needs motion capture, as there is none at {asked.mocap}; --mocap names its folder")
            asked.mocap = None
        return asked


class _Marked(io.TextIOBase):
    """Lines that begin with a mark, so that nobody quotes them."""

    def __init__(self, stream):
        self.stream, self.begins = stream, True

    def write(self, text: str) -> int:
        for line in text.splitlines(keepends=True):
            self.stream.write(MARK * self.begins + line)
            self.begins = line.endswith("\n")
        return len(text)

    def flush(self) -> None:
        if not self.stream.closed:  # as it may be when this object goes
            self.stream.flush()


def has(*modules: str) -> bool:
    """Whether modules of a peer can be imported; says so where not."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        print(f"skipped: {', '.join(missing)} can't be imported (pip install -e '.[bench]')", flush=True)
    return not missing


def needs(*modules: str) -> None:
    """Skip the whole benchmark without these modules."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        raise Skipped(f"{', '.join(missing)} can't be imported (pip install -e '.[bench]')")


def shortest(call: Callable[[], object], repeats: int = 3, *, warm: bool = False) -> float:
    """Seconds of the fastest of some calls, as others use the machine too; after one that compiles if `warm`.

    With --quick, of one call.
    """
    if "--quick" in sys.argv:
        return timeit.timeit(call, number=1)
    if warm:
        call()
    return min(timeit.repeat(call, number=1, repeat=repeats))


def scratch() -> Path:
    """A new folder that is removed at the end."""
    folder = tempfile.mkdtemp(prefix="motionenv-bench-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def headline(**values: float) -> None:
    """Print the numbers of README's table as a line of JSON, which `benchmarks.readme` reads."""
    print(HEADLINE + json.dumps({name: float(value) for name, value in values.items()}), flush=True)


def headlines(text: str) -> dict[str, float]:
    """The numbers that `headline` printed in a benchmark's output."""
    lines = [line.removeprefix(MARK) for line in text.splitlines()]
    found = [json.loads(line.removeprefix(HEADLINE)) for line in lines if line.startswith(HEADLINE)]
    return {name: value for values in found for name, value in values.items()}
