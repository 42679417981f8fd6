"""Importing `motionenv.envs` registers the environments; importing `motionenv` doesn't import Gymnasium."""

import subprocess
import sys

import pytest

from motionenv.envs.registration import ENVIRONMENTS

ID = "motionenv/WalkerTracking-v1"


@pytest.mark.parametrize(
    "script",
    [
        "import gymnasium, motionenv.envs\n"
        f"gymnasium.register_envs(motionenv.envs)\nassert gymnasium.make({ID!r}).spec.namespace == 'motionenv'",
        f"import gymnasium\ngymnasium.make('motionenv.envs:{ID}')",
        "import motionenv.envs, sys\nassert 'numba' not in sys.modules",
        f"import gymnasium, motionenv\ntry:\n    gymnasium.make({ID!r})\n"
        "except gymnasium.error.NamespaceNotFound:\n    pass\nelse:\n    raise AssertionError",
    ],
)
def test_in_a_fresh_process(script):
    run = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_docstrings_have_the_house_headings(name):
    import gymnasium

    entry = gymnasium.spec(name).entry_point
    text = gymnasium.envs.registration.load_env_creator(entry).__doc__
    headings = ["Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End",
                "Arguments", "Vectorized environment", "Version History"]  # fmt: skip
    at = [text.find(f"## {heading}\n") for heading in headings]
    assert -1 not in at
    assert at == sorted(at)
