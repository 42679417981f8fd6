"""What the README shows of the service works on one: its Python, and its curl."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import motionenv

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
SERVE = README[README.index("## Serve") : README.index("## The command line")]
ADDRESS = "127.0.0.1:8000"


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", SERVE, flags=re.DOTALL | re.MULTILINE)


def here(text: str, server) -> str:
    """`text` that asks this server."""
    return text.replace(ADDRESS, server.url.removeprefix("http://"))


def test_python_blocks_run(server, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    walk = motionenv.synthesize("walk/fpca", 4, 30, seed=7, speed=1.3)
    motionenv.write(walk, "walk.bvh")
    codes = blocks("python")
    assert any(ADDRESS in code for code in codes)
    names: dict = {"motionenv": motionenv}
    for code in codes:
        exec(compile(here(code, server), "README, Serve", "exec"), names)
    np.testing.assert_array_equal(names["served"].poses, walk.poses)
    assert (names["job"].status, len(names["strolling"])) == ("done", 30)


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl isn't installed")
def test_curl_gets_what_is_shown(server, tmp_path):
    lines = [line for block in blocks("bash") for line in block.splitlines() if line.startswith("curl ")]
    assert len(lines) >= 2
    for line in lines:
        words = shlex.split(here(line, server), comments=True)
        subprocess.run([*words, "--fail", "--max-time", "60"], cwd=tmp_path, check=True)
    assert b'"poses"' in (tmp_path / "walk.json").read_bytes()
    assert (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp"
