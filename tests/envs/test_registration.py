"""The environments are known to Gymnasium whichever of the two is imported first, and motionenv doesn't load it."""

import subprocess
import sys

import pytest

from motionenv.envs.registration import ENVIRONMENTS

MADE = "assert gymnasium.make('motionenv/WalkerTracking-v0').spec.namespace == 'motionenv'"


@pytest.mark.parametrize(
    "script",
    [
        f"import motionenv, sys; assert 'gymnasium' not in sys.modules; import gymnasium; {MADE}",
        f"import gymnasium, motionenv; {MADE}",
        "import gymnasium; gymnasium.make('motionenv:motionenv/WalkerTracking-v0')",
        "import motionenv.envs, sys; assert 'gymnasium' not in sys.modules",
        f"from motionenv.envs import WalkerTracking; import gymnasium; {MADE}",
        "import motionenv, gymnasium; from motionenv.envs.registration import register; register(); register()",
    ],
)
def test_in_a_fresh_process(script):
    run = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


def test_without_gymnasium_motionenv_imports(tmp_path):
    script = (
        "import sys; sys.modules['gymnasium'] = None\nimport motionenv\n"
        "try:\n    import gymnasium\nexcept ImportError:\n    print('missing')"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (0, "missing\n"), run.stderr


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_docstrings_have_the_house_headings(name):
    import gymnasium

    from motionenv.envs.registration import register

    register()
    entry = gymnasium.spec(name).entry_point
    text = gymnasium.envs.registration.load_env_creator(entry).__doc__
    headings = ["Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End",
                "Arguments", "Vectorized environment", "Version History"]  # fmt: skip
    at = [text.find(f"## {heading}\n") for heading in headings]
    assert -1 not in at
    assert at == sorted(at)
