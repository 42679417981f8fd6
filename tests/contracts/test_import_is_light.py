"""`import motionenv` in a fresh interpreter: prints nothing, starts nothing, loads nothing heavy."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
HEAVY = {
    "OpenGL", "PIL", "av", "fastapi", "gymnasium", "matplotlib", "numba", "pooch", "pyglet", "pyrender",
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

PROBE_NAMES = """
import json, sys
import motionenv
found = {"promised": motionenv.__all__, "listed": dir(motionenv)}
found["loaded_early"] = sorted(set(motionenv.__all__) & set(vars(motionenv)))
found["missing"] = [name for name in motionenv.__all__ if getattr(motionenv, name, None) is None]
with open(sys.argv[1], "w") as out:
    json.dump(found, out)
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


def test_public_names_are_listed_before_they_are_loaded(tmp_path):
    """`dir(motionenv)` shows every public name while none is loaded, and each one can then be had."""
    report = tmp_path / "report.json"
    subprocess.run([sys.executable, "-c", PROBE_NAMES, report], check=True)
    found = json.loads(report.read_text())
    assert {"Motion", "load", "synthesize", "lift", "read_motion", "FormatError"} <= set(found["promised"])
    assert {"render", "gait", "lifting", "envs"} <= set(found["promised"])  # packages
    assert set(found["promised"]) <= set(found["listed"])
    assert found["loaded_early"] == []
    assert found["missing"] == []


_EACH_FIRST = """
import importlib, os, pkgutil, sys
import numba, numpy, pydantic, scipy.signal, scipy.spatial, typer

def imported(name):
    # What Python imports first in any case, the packages above, is loaded: so a module's own process is a fork.
    try:
        module = importlib.import_module(name)
    except ImportError as error:
        if "partially initialized" in str(error):
            print(name, flush=True)
        return
    for info in pkgutil.iter_modules(getattr(module, "__path__", ())):
        child = os.fork()
        if not child:
            imported(f"{name}.{info.name}")
            os._exit(0)
        os.waitpid(child, 0)

for name in sys.argv[1:]:
    if not os.fork():
        imported(name)
        os._exit(0)
    os.wait()
"""


def test_every_module_of_the_models_can_come_first(tmp_path):
    """Imports in a circle fail or not depending on which module comes first: each is imported in a fresh process."""
    made_up = tmp_path / "made_up"
    made_up.mkdir()
    (made_up / "__init__.py").write_text("")
    (made_up / "first.py").write_text("from made_up import second\nA = 1")
    (made_up / "second.py").write_text("from made_up.first import A")
    names = ["made_up", *(f"motionenv.{part}" for part in ("models", "data", "gait", "lifting"))]
    done = subprocess.run(
        [sys.executable, "-c", _EACH_FIRST, *names],
        capture_output=True, text=True, env=os.environ | {"PYTHONPATH": f"{tmp_path}:{ROOT}"}, timeout=300, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["made_up.first"], done.stderr
