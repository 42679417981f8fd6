"""What README and docs/ show of the service works on one: their Python, and their curl."""

import shlex
import shutil
import subprocess

import numpy as np
import pytest

import motionenv
from tests.contracts.markdown import PAGES, ROOT, SERVICE, blocks


def here(text: str, server) -> str:
    """`text` that asks this server."""
    return text.replace(SERVICE, server.url.removeprefix("http://"))


def test_python_blocks_run(server, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    walk = motionenv.synthesize("walk/fpca", 4, 30, seed=7, speed=1.3)
    motionenv.write(walk, "walk.bvh")
    names: dict = {"motionenv": motionenv}
    codes = [code for page in PAGES for code in blocks(page, "python") if SERVICE in code]
    assert codes
    for code in codes:
        exec(compile(here(code, server), "docs, Python that asks a service", "exec"), names)
    np.testing.assert_array_equal(names["walk"]["poses"], walk.poses)
    assert len(names["poses"]) == 30


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("curl") is None, reason="curl isn't installed")
def test_curl_gets_what_is_shown(server, tmp_path):
    pages = [ROOT / "README.md", ROOT / "docs" / "service.md"]
    code = "".join(block for page in pages for block in blocks(page, "bash")).replace("\\\n", " ")
    lines = [line for line in code.splitlines() if line.startswith("curl ")]
    assert len(lines) >= 3
    for line in lines:
        words = shlex.split(here(line, server), comments=True)
        subprocess.run([*words, "--fail", "--max-time", "60"], cwd=tmp_path, check=True)
    assert b'"poses"' in (tmp_path / "walk.json").read_bytes()
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"
