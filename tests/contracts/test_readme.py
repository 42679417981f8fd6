"""The README is true: its Python runs, its commands exist with the options that it shows."""

import doctest
import re
import shlex
from pathlib import Path

import pytest

import motionenv

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)
SERVED = "http://127.0.0.1:8000"  # tests/service/test_serving_readme.py runs what asks a service
ENDS = {"&&", "||", "|", ";", "&", ">"}


def commands() -> list[list[str]]:
    """The arguments of every `motionenv …` in the bash blocks, lines joined where they end in a backslash."""
    found = []
    for line in "".join(code for kind, code in BLOCKS if kind == "bash").replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        for start, word in enumerate(words):
            if Path(word).name == "motionenv" and (start == 0 or words[start - 1] in ENDS):
                rest = words[start + 1 :]
                found.append(rest[: next((i for i, w in enumerate(rest) if w in ENDS), len(rest))])
    return found


def test_python_blocks_run_in_order(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    for number, code in enumerate(code for kind, code in BLOCKS if kind == "python" and SERVED not in code):
        exec(compile(code, f"README python block {number + 1}", "exec"), names)


@pytest.mark.parametrize("words", [words for words in commands() if words[0] != "serve"], ids=" ".join)
def test_commands_exist_with_their_options(words):
    from typer.main import get_command

    from motionenv.cli import app

    command = get_command(app)
    while words and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
    assert not (getattr(command, "commands", {}) and words), f"no command {words[0]} under {command.name}"
    known = {option for p in command.params for option in (*p.opts, *p.secondary_opts)} | {"--help"}
    assert {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)} <= known


@pytest.mark.parametrize("words", [words for words in commands() if words[0] == "serve"], ids=" ".join)
def test_the_service_takes_the_options_that_are_shown(words, monkeypatch):
    from pydantic_settings import CliApp

    from service.settings import Settings

    monkeypatch.setenv("MOTIONENV_SERVICE_KEYS", '["a-key-that-only-tests-know"]')
    assert CliApp.run(Settings, cli_args=words[1:]).host


def test_one_line_each_for_the_main_job_and_for_the_tests():
    """The two lines to paste in a fresh clone; `.ci/run` takes the second from here."""
    lines = [line for kind, code in BLOCKS if kind == "bash" for line in code.splitlines()]
    assert sum(line.startswith("python3 -m venv") and line.endswith("motionenv demo") for line in lines) == 1
    assert sum(line.startswith("python3 -m venv") and "/pytest" in line for line in lines) == 1


def test_the_packages_own_example_runs():
    tried = doctest.testmod(motionenv)
    assert tried.attempted > 3
    assert tried.failed == 0
