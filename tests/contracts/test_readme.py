"""README and docs/ are true: their Python runs, their commands and options exist, their links lead somewhere."""

import doctest
import re
import shlex
from importlib import import_module

import pytest

from tests.contracts.markdown import PAGES, ROOT, SERVICE, blocks, commands, examples, name

README = PAGES[0]
COMMANDS = {shlex.join(words): words for page in PAGES for words in commands(page)}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
SERVICES = ("serve", "work")
SERVE = [words for words in COMMANDS.values() if words[0] in SERVICES]
WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in (ROOT / "motionenv").rglob("*.py")
    if ">>> " in (text := path.read_text(encoding="utf-8")) and "+SKIP" not in text  # those need a service, or Ray
)
LINKING = [*PAGES, *(ROOT / path for path in ("benchmarks/RESULTS.md", "renders/README.md", "service/web/README.md"))]


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python") and p.parent.name != "extending"], ids=name)
def test_python_blocks_run_in_order(page, tmp_path, monkeypatch, capsys, request):
    if "track_video(" in page.read_text(encoding="utf-8"):
        request.getfixturevalue("blazepose")
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "__main__"}
    for number, (code, shown) in enumerate((code, shown) for code, shown in examples(page) if SERVICE not in code):
        exec(compile(code, f"{name(page)}, Python block {number + 1}", "exec"), names)
        printed = capsys.readouterr().out
        if shown is not None:
            assert NUMBER.sub("#", printed) == NUMBER.sub("#", shown)
            values = [[float(n) for n in NUMBER.findall(text)] for text in (printed, shown)]
            assert values[0] == pytest.approx(values[1], rel=0.05)  # processors round differently


@pytest.mark.parametrize("words", [words for words in COMMANDS.values() if words[0] not in SERVICES], ids=" ".join)
def test_commands_exist_with_their_options(words):
    from typer.main import get_command

    from motionenv.cli import app

    command = get_command(app)
    while words and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
    assert not (getattr(command, "commands", {}) and words), f"no command {words[0]} under {command.name}"
    params = list(command.params)
    if command.name == "batch":  # options of the command that it runs follow
        top = get_command(app).commands
        params += (top.get(words[0]) or top["mocap"].commands[words[0]]).params
    if command.name == "bench":
        return  # options of the benchmark follow, which tests/benchmarks checks
    known = {option for p in params for option in (*p.opts, *p.secondary_opts)} | {"--help"}
    assert {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)} <= known


@pytest.mark.parametrize("words", SERVE, ids=" ".join)
def test_the_service_takes_the_options_that_are_shown(words, monkeypatch):
    from pydantic_settings import CliApp

    from service.settings import Settings

    monkeypatch.setenv("MOTIONENV_SERVICE_KEYS", '["a-key-that-only-tests-know"]')
    if "--help" in words:
        with pytest.raises(SystemExit) as ended:
            CliApp.run(Settings, cli_args=words[1:])
        assert ended.value.code == 0
    else:
        assert CliApp.run(Settings, cli_args=words[1:]).data


def test_every_benchmark_that_is_named_exists(run):
    text = "\n".join(page.read_text(encoding="utf-8") for page in LINKING)
    named = set(re.findall(r"motionenv\s+bench\s+([\w.]*\w)", text))
    assert named
    assert named <= set(run("bench").out.split())


@pytest.mark.parametrize("page", LINKING, ids=name)
def test_links_and_pictures_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert not [target for target in targets if not (page.parent / target).exists()]


def test_the_readme_is_a_page():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 200


def test_the_guide_lists_every_page():
    docs = ROOT / "docs"
    listed = (docs / "README.md").read_text(encoding="utf-8")
    pages = [page.relative_to(docs).as_posix() for page in PAGES[1:] if page.name != "README.md"]
    assert not [page for page in pages if f"({page})" not in listed]


def test_one_line_each_for_the_main_job_and_for_the_tests():
    """The two lines to paste in a fresh clone; `.ci/run` takes the second from here."""
    lines = [line for code in blocks(README, "bash") for line in code.splitlines()]
    assert sum(line.startswith("python3 -m venv") and line.endswith("motionenv demo") for line in lines) == 1
    assert sum(line.startswith("python3 -m venv") and "/pytest" in line for line in lines) == 1


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_docstrings_run(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tried = doctest.testmod(import_module(module))
    assert tried.attempted > 0
    assert tried.failed == 0
