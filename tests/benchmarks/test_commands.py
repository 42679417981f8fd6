"""Every benchmark can be asked for help and run quickly; README's table names only benchmarks, and can be made anew."""

import argparse
import importlib
import re
import sys
from pathlib import Path

import pytest

from benchmarks import Arguments, Skipped, headline, headlines, readme
from benchmarks.all import module
from motionenv.cli.bench import benchmarks

ROOT = Path(__file__).parents[2]
NAMES = benchmarks(ROOT)


@pytest.mark.slow
def test_every_benchmark_takes_quick_and_shows_an_example(monkeypatch, capsys):
    assert len(NAMES) > 50
    for name in NAMES:
        monkeypatch.setattr("sys.argv", [name, "--help"])
        with pytest.raises(SystemExit) as ended:
            importlib.import_module(module(name)).main()
        if isinstance(ended.value, Skipped):  # needs a library that isn't here
            continue
        assert ended.value.code == 0, name
        told = capsys.readouterr().out
        assert re.search(rf"^ *motionenv bench {re.escape(name)}( |$)", told, re.MULTILINE), f"{name} has no example"
        assert "--quick" in told, name


def test_the_table_of_readme_is_what_its_benchmarks_give():
    """Rows have the commands of README's, and as many."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition(readme.BEGIN)[2].partition(readme.END)[0]
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if "`motionenv bench " in line
    ]
    assert [(row[0], row[3]) for row in rows] == [(row.what, f"`motionenv bench {row.command}`") for row in readme.ROWS]
    assert {row.command.split()[0] for row in readme.ROWS} <= set(NAMES)


def test_a_row_is_filled_and_lacks_what_a_missing_peer_gives():
    row = readme.Row("speed", "{ours:,.0f}/s", "{ratio:.1f}× theirs", "render")
    assert (
        readme.line(row, {"ours": 1234.5, "ratio": 2.34})
        == "| speed | 1,234/s | 2.3× theirs | `motionenv bench render` |"
    )
    assert readme.line(row, {"ours": 1.0}) == "| speed | 1/s | – | `motionenv bench render` |"


def test_headlines_come_back_from_what_is_printed(capsys):
    headline(speed=3, ratio=0.5)
    assert headlines(capsys.readouterr().out) == {"speed": 3.0, "ratio": 0.5}


@pytest.fixture
def arguments(monkeypatch, capsys):
    def parsed(*words: str, **how) -> argparse.Namespace:
        monkeypatch.setattr("sys.argv", ["benchmark", *words])
        monkeypatch.setattr("sys.stdout", sys.stdout)  # which --quick replaces
        parser = Arguments("A benchmark.", **how)
        parser.add_argument("--n", type=int, default=1000, quick=2)
        parser.add_argument("--out", required=True, quick="here")
        asked = parser.parse_args()
        headline(n=asked.n)
        return asked

    return parsed


def test_quick_runs_are_small_need_nothing_and_mark_every_line(arguments, capsys):
    asked = arguments("--quick")
    assert (asked.n, asked.out) == (2, "here")
    told = capsys.readouterr().out
    assert all(line.startswith("quick: ") for line in told.splitlines())
    assert headlines(told) == {"n": 2.0}
    assert arguments("--quick", "--n", "3").n == 3


def test_full_runs_are_not_marked_and_say_what_is_missing(arguments, capsys):
    assert arguments("--out", "there").n == 1000
    assert capsys.readouterr().out.startswith("headline: ")
    with pytest.raises(SystemExit) as ended:
        arguments()
    assert ended.value.code == 2
    assert "--out" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "status"), [(["--quick"], 0), (["--out", "x"], 2)])
def test_missing_capture_is_skipped_when_quick_and_an_error_otherwise(arguments, capsys, tmp_path, words, status):
    with pytest.raises(Skipped) as ended:
        arguments(*words, "--mocap", str(tmp_path), mocap=("cmu_asfamc",))
    assert ended.value.code == status
    assert "no motion capture at" in capsys.readouterr().out
