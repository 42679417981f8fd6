"""`motionenv bench` in a checkout and outside of one, and `motionenv compile`."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import motionenv
from tests.cli.talking import refused


@pytest.mark.slow
def test_bench_lists_runs_and_refuses(run, tmp_path):
    listed = run("bench")
    assert listed.code == 0
    assert {"cycles", "startup", "lifting", "lifting.raw", "render"} <= set(listed.out.split())
    refused(run("bench", "speed"), "startup")
    environment = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}
    command = [sys.executable, "-m", "motionenv", "bench"]
    options = {"capture_output": True, "text": True, "env": environment, "cwd": tmp_path}
    done = subprocess.run([*command, "startup", "--imports"], **options)
    assert (done.returncode, done.stderr) == (0, "")
    assert "| `import motionenv` |" in done.stdout
    explained = subprocess.run([*command, "models.synthesis", "--", "--help"], **options)
    assert explained.returncode == 0
    assert "--walks" in explained.stdout
    assert subprocess.run([*command, "models.synthesis", "--no-such-option"], **options).returncode == 2


def test_bench_outside_a_checkout_says_where_benchmarks_are(tmp_path):
    package = Path(motionenv.__file__).parent
    shutil.copytree(package, tmp_path / "motionenv", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [sys.executable, "-m", "motionenv", "bench", "render"], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2
    assert "clone the repository" in done.stderr


def test_compile_compiles_what_a_task_needs(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "motionenv", "compile", "report"]
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        assert (done.returncode, done.stderr) == (0, "kernels compiled: 1\n")
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


def test_compile_suggests_a_task(run):
    refused(run("compile", "lfit"), "did you mean lift?")
