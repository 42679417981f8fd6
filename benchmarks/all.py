"""Run every benchmark on tiny inputs in one process: the seconds of each, what it skipped, and which failed.

    motionenv bench all --quick [--only TEXT]

Prints the output of those that fail, and then exits with status 1.
"""

import contextlib
import faulthandler
import importlib
import io
import re
import sys
import time
import traceback

from benchmarks import MARK, ROOT, Arguments, headlines
from benchmarks.readme import ROWS, line
from motionenv.cli.bench import benchmarks

OTHERS = ("all", "readme", "tree")  # they only run others


def run(name: str) -> tuple[bool, str]:
    """Run a benchmark: whether it failed, and its output."""
    told, given = io.StringIO(), sys.argv
    sys.argv = [name, "--quick"]
    failed = False
    faulthandler.dump_traceback_later(600, exit=True, file=sys.__stderr__)  # one that hangs ends here
    with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
        try:
            importlib.import_module(module(name)).main()
        except SystemExit as ended:
            failed = bool(ended.code)
            print(ended.code or "")
        except Exception:  # noqa: BLE001 the others are still to be run
            failed = True
            print(traceback.format_exc())
        finally:
            sys.argv = given
            faulthandler.cancel_dump_traceback_later()
    return failed, told.getvalue()


def module(name: str) -> str:
    """The module of a benchmark."""
    path = ROOT / "benchmarks" / name.replace(".", "/")
    return f"benchmarks.{name}.__main__" if path.is_dir() else f"benchmarks.{name}"


def main() -> None:
    """Print a line for each benchmark, and the output of those that fail."""
    parser = Arguments(__doc__)
    parser.add_argument("--only", default="", help="only those whose name contains this")
    asked = parser.parse_args()
    if not asked.quick:
        parser.error("give --quick: in full, benchmarks run for hours, and some need arguments")
    began, failures, numbers = time.perf_counter(), [], {}
    print("| benchmark | s | skipped |\n|-|-|-|")
    for name in (n for n in benchmarks(ROOT) if n not in OTHERS and asked.only in n):
        start = time.perf_counter()
        failed, told = run(name)
        numbers[name] = headlines(told)
        skipped = dict.fromkeys(re.findall(rf"^(?:{MARK})?skipped: (.*)$", told, re.MULTILINE))
        if failed:
            failures.append(f"## {name}\n\n{told}")
        told = "FAILED" if failed else "; ".join(skipped)
        print(f"| {name} | {time.perf_counter() - start:.1f} | {told} |", flush=True)
    print(f"\n{time.perf_counter() - began:.0f} s in all. README's rows:\n")
    for row in ROWS:
        print(line(row, numbers.get(row.command.split()[0], {})))
    if failures:
        print("\n".join(["", *failures]))
        raise SystemExit(f"{len(failures)} benchmarks failed: {', '.join(f.split()[1] for f in failures)}")


if __name__ == "__main__":
    main()
