"""The pages on how to add something, followed to the letter in a copy of the library."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "extending").glob("*.md"))
_BLOCK = re.compile(r"^```(python|toml|diff)\n(.*?)^```", re.DOTALL | re.MULTILINE)
_NAMED = re.compile(r"# ([\w/]+\.\w+)\n")


def changed(path: Path, change: str) -> None:
    """Make the changes of a diff without line numbers: each part once, where its old lines stand."""
    text = path.read_text(encoding="utf-8")
    for part in re.split(r"^@@\n", change, flags=re.MULTILINE)[1:]:
        lines = part.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(old) == 1, f"{path.name} has no, or more than one:\n{old}"
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def installed(folder: Path, project: str) -> None:
    """Leave in `folder` what pip leaves there of a package: its name and its entry points."""
    read = tomllib.loads(project)["project"]
    about = folder / f"{read['name']}-{read['version']}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {read['name']}\nVersion: {read['version']}\n")
    points = "\n".join(
        f"[{group}]\n" + "\n".join(f"{name} = {place}" for name, place in named.items())
        for group, named in read["entry-points"].items()
    )
    (about / "entry_points.txt").write_text(points)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_followed_to_the_letter_it_works(page, tmp_path):
    for package in ("motionenv", "service"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "web"))
    ran = 0
    for language, code in _BLOCK.findall(page.read_text(encoding="utf-8")):
        file = _NAMED.match(code)
        if language == "diff":
            changed(tmp_path / re.search(r"^\+\+\+ b/(.*)$", code, re.MULTILINE)[1], code)
        elif language == "toml":
            installed(tmp_path, code)
        elif file:
            (tmp_path / file[1]).write_text(code[file.end() :], encoding="utf-8")
        else:
            environment = os.environ | {"PYTHONPATH": str(tmp_path)}
            done = subprocess.run(
                [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
            )
            assert done.returncode == 0, done.stderr
            ran += 1
    assert ran == 1
