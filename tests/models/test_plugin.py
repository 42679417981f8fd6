"""Another package's model of ten lines is found in Python, on the command line, and in environments."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import motionenv
from tests.models.toy_package import install

ROOT = Path(motionenv.__file__).parents[1]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs Python with arguments where the package is installed."""
    folder = install(tmp_path_factory.mktemp("installed"))
    environment = os.environ | {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}

    def run(*arguments: str, **options) -> subprocess.CompletedProcess:
        command = [sys.executable, *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment, **options)

    return run


def test_it_is_loaded_saved_and_loaded_again(run, tmp_path):
    done = run(
        "-c",
        """
import json, sys, motionenv
from motionenv import models
model = motionenv.load("toy/bounce")
model.save(sys.argv[1])
again = motionenv.load(sys.argv[1])
motion = motionenv.synthesize("toy/bounce", 2, 30, speed=1.5, height=1.8, seed=1)
print(json.dumps({
    "names": models.names(), "card": models.card("toy/bounce"), "kinds": [model.kind, again.kind],
    "shape": motion.poses.shape, "height": motion.skeleton.height, "way": motion.poses[-1, 0],
    "walkers": model.walker(seed=1) == model.walker(seed=2), "ours": motionenv.load("walk/fpca").kind,
}))
""",
        str(tmp_path / "bounce.npz"),
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {"toy/bounce", "toy/broken", "walk/fpca"} <= set(told["names"])
    assert told["card"] == {"data": "none", "model licence": "CC0"}
    assert told["kinds"] == ["bounce", "bounce"]
    assert (told["shape"], told["height"]) == ([60, 25], 1.8)
    assert told["way"] == pytest.approx(1.5 * 59 / 30)
    assert told["walkers"]
    assert told["ours"] == "walking", "nobody takes a name of ours"


@pytest.mark.parametrize(
    ("name", "why"), [("toy/broken", "No module named 'toy_gait_that_is_missing'"), ("toy/failing", "out of order")]
)
def test_one_that_is_broken_is_told_by_name_and_spoils_nothing(run, name, why):
    done = run("-m", "motionenv", "synth", name, "--out", "x.npz")
    assert done.returncode == 2
    assert name in done.stderr
    assert "toy-gait" in done.stderr
    assert why in done.stderr
    listed = run("-m", "motionenv", "models")
    assert listed.returncode == 0
    assert f"{name}\n    unavailable: " in listed.stdout


def test_the_command_line_lists_it_and_makes_motion(run, tmp_path):
    listed = run("-m", "motionenv", "models")
    assert "toy/bounce\n    data: none\n    model licence: CC0\n" in listed.stdout
    out = tmp_path / "bounce.npz"
    done = run("-m", "motionenv", "synth", "toy/bounce", "--seconds", "1", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert motionenv.read(out).poses.shape == (30, 25)
    wrong = run("-m", "motionenv", "synth", "toy/bonce", "--out", str(out))
    assert wrong.returncode == 2
    assert "did you mean toy/bounce?" in wrong.stderr


def test_an_environment_shows_it(run):
    done = run(
        "-c",
        """
import json, gymnasium, motionenv.envs
env = gymnasium.make("motionenv/WalkerTracking-v1", motion="toy/bounce", horizon=5, size=36)
env.reset(seed=1)
truths = [env.unwrapped.truth()["pose"].tolist()]
for _ in range(5):
    env.step(env.action_space.sample())
    truths.append(env.unwrapped.truth()["pose"].tolist())
print(json.dumps(truths))
""",
    )
    assert done.returncode == 0, done.stderr
    poses = np.array(json.loads(done.stdout))
    np.testing.assert_array_equal(poses[:, 6:], 0)
    assert np.ptp(poses[:, 2]) > 0.001
