"""The `batch` command: one command over many files, with a manifest, so that it can be stopped and continued."""

import hashlib
import io
import json
import os
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass
from functools import partial
from glob import glob
from pathlib import Path
from typing import Annotated, Any

import typer

from motionenv._core.files import atomic_write
from motionenv.cli._shared import made_progress, note
from motionenv.errors import MotionError

#: Commands that take a file and `--out`: how they are called, and the suffix of what they write.
_COMMANDS: dict[str, tuple[tuple[str, ...], str]] = {
    "convert": (("mocap", "convert"), ".npz"),
    "lift": (("lift",), ".npz"),
    "report": (("report",), ".html"),
    "track": (("track", "--video"), ".mp4"),
}


@dataclass(frozen=True)
class _Job:
    """Arguments of a worker: a command and its options, folder and suffix of the results, folder of the inputs."""

    command: str
    options: tuple[str, ...]
    out: str
    suffix: str
    base: str


def batch(
    context: typer.Context,
    command: Annotated[str, typer.Argument(help="convert, lift, report or track.")],
    pattern: Annotated[str, typer.Argument(help="Files, as 'clips/**/*.json'; quoted, so that the shell leaves it.")],
    out: Annotated[Path, typer.Option(help="Folder of the results; created if necessary.")],
    suffix: Annotated[str | None, typer.Option(help="Of the results; by default .npz, .html or .mp4.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; by default one for each core.")] = None,
    engine: Annotated[str, typer.Option(help="processes on this machine, or ray.")] = "processes",
    address: Annotated[str | None, typer.Option(help="Of Ray's head, as auto; by default Ray starts here.")] = None,
) -> None:
    """Run a command on each of many files; further options are the command's own. Files that are done are skipped.

    Results lie below OUT as their files lie below the pattern's folder. OUT/manifest has a row for each file, with what
    the command said. Exit codes: 0, all done; 3, some failed (listed on stderr, the others are whole); 130, stopped.
    Example: motionenv batch lift 'clips/**/*.json' --out lifted --suffix .bvh --workers 2 --fps 30
    """
    from motionenv.data import ray_executor
    from motionenv.data.making.engine import run

    job = _job(command, tuple(context.args), out, suffix, pattern)
    if engine not in ("processes", "ray"):
        raise MotionError(f"--engine must be processes or ray, got {engine!r}")
    files = sorted(file for file in glob(pattern, recursive=True) if os.path.isfile(file))
    if not files:
        raise MotionError(f"no file is like {pattern!r}: quote the pattern, and use ** for folders of any depth")
    _begin(job)
    names = [os.path.relpath(file, job.base) for file in files]
    todo = [name for name in names if not _is_done(job, name)]
    with ExitStack() as stack:
        executor = stack.enter_context(ray_executor(address)) if engine == "ray" else None
        step = stack.enter_context(made_progress(command, len(todo), unit="files"))
        outcome = run(partial(do_one, job), todo, executor=executor, workers=workers, on_done=lambda row: step(1, 0))
    refused = {row["file"]: row["error"] for row in outcome.done.values() if row["error"]}
    for name, why in sorted({**refused, **outcome.failed}.items()):
        note(f"{name} failed: {why}")
    done = len(outcome.done) - len(refused)
    typer.echo(f"{out}  {done} files done, {len(names) - len(todo)} were done before, {len(todo) - done} left")
    if outcome.interrupted:
        note("stopped: run the same command again to go on")
        raise typer.Exit(130)
    if done < len(todo):
        raise typer.Exit(3)


def _job(command: str, options: tuple[str, ...], out: Path, suffix: str | None, pattern: str) -> _Job:
    if command not in _COMMANDS:
        raise MotionError(f"batch takes {', '.join(_COMMANDS)}; got {command!r}")
    if "--out" in options:
        raise MotionError("--out is the folder of all results: give it once")
    base = pattern
    while any(sign in base for sign in "*?["):
        base = os.path.dirname(base)
    base = base if os.path.isdir(base or ".") else os.path.dirname(base)
    suffix = _COMMANDS[command][1] if suffix is None else suffix
    return _Job(command, options, str(out.resolve()), suffix, str(Path(base or ".").resolve()))


def _begin(job: _Job) -> None:
    """Write what the batch is, or check that it is the same as before."""
    head, content = Path(job.out) / "batch.json", {**asdict(job), "base": None, "out": None}
    if head.exists():
        before = json.loads(head.read_text())
        if json.loads(json.dumps(content)) != before:
            said = " ".join([before["command"], *before["options"]])
            raise MotionError(f"{job.out} has results of `{said}`: use the same options, or another --out")
        return
    Path(job.out).mkdir(parents=True, exist_ok=True)
    _write(head, content)


def _is_done(job: _Job, name: str) -> bool:
    """Whether a file has a result, and is still the same."""
    row = _row_of(job, name)
    if not row.exists():
        return False
    content = json.loads(row.read_text())
    return not content["error"] and content["sha256"] == _digest(Path(job.base) / name)


def do_one(job: _Job, name: str) -> dict[str, Any]:
    """Run the command of a `job` on the file `name`, below the job's base; returns the row of the manifest."""
    from motionenv.cli import app

    source, target = Path(job.base) / name, Path(job.out) / Path(name).with_suffix(job.suffix)
    target.parent.mkdir(parents=True, exist_ok=True)
    said, called = io.StringIO(), _COMMANDS[job.command][0]
    error, code = "", 0
    try:
        with redirect_stdout(said), redirect_stderr(said):
            code = app([*called, str(source), "--out", str(target), *job.options], standalone_mode=False) or 0
    except MotionError as problem:
        error = str(problem)
    except SystemExit as end:
        code = int(end.code or 0)
    except Exception as problem:  # noqa: BLE001  one file's failure is told in its row, and others go on
        error = f"{type(problem).__name__}: {problem}"
    if code == 2 and not error:
        error = said.getvalue().strip() or f"exit code {code}"
    row = {
        "file": name, "sha256": _digest(source), "result": str(target.relative_to(job.out)), "exit_code": code,
        "error": error, "said": said.getvalue(),
    }  # fmt: skip
    path = _row_of(job, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, row)
    return row


def _row_of(job: _Job, name: str) -> Path:
    return Path(job.out) / "manifest" / f"{name}.json"


def _write(path: Path, content: dict[str, Any]) -> None:
    with atomic_write(path) as part:
        part.write_text(json.dumps(content, indent=2, sort_keys=True))


def _digest(path: Path) -> str:
    with path.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
