"""`import motionenv` in a fresh interpreter: prints nothing, starts nothing, loads nothing heavy."""

import json
import subprocess
import sys

HEAVY = {
    "OpenGL", "PIL", "av", "ezc3d", "fastapi", "gymnasium", "matplotlib", "numba", "pooch", "pyglet", "pyrender",
    "requests", "rich", "scipy", "service", "trimesh", "typer", "uvicorn",
}  # fmt: skip

PROBE = """
import json, os, sys, threading
import numpy
before = len(os.listdir("/proc/self/task"))
import motionenv
after = len(os.listdir("/proc/self/task"))
top = sorted({name.split(".")[0] for name in sys.modules})
with open(sys.argv[1], "w") as out:
    json.dump({"threads": [before, after, threading.active_count()], "modules": top}, out)
"""


def test_import_is_silent_single_threaded_and_light(tmp_path):
    report = tmp_path / "report.json"
    run = subprocess.run([sys.executable, "-W", "error", "-c", PROBE, report], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
    found = json.loads(report.read_text())
    before, after, python_threads = found["threads"]
    assert after == before
    assert python_threads == 1
    assert not HEAVY & set(found["modules"])


def test_public_names_are_listed_before_they_are_loaded():
    """`dir(motionenv)` shows what `__all__` promises, and each name is really there."""
    import motionenv

    names = getattr(motionenv, "__all__", [])
    assert set(names) <= set(dir(motionenv))
    assert all(getattr(motionenv, name) is not None for name in names)
