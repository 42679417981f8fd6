"""The `evaluate` command: a report of an agent of one's own, and refusals in one line."""

import json
import subprocess
import sys

import pytest

AGENT = """
from motionenv.envs.agents import Blob


class Mine(Blob):
    pass
"""


def run(folder, *words):
    command = [sys.executable, "-c", "from motionenv.cli import main; main()", "evaluate", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_an_agent_of_ones_own_is_scored(tmp_path):
    (tmp_path / "agents.py").write_text(AGENT)
    task = "motionenv/MarkerTracking-Easy-v1"
    reports = []
    for agent in ("agents:Mine", "blob"):
        done = run(tmp_path, agent, "--task", task, "--episodes", "3", "--out", "r.json")
        told = [line for line in done.stderr.splitlines() if not line.startswith("compiling kernels")]
        assert (done.returncode, told) == (0, [])
        reports.append(json.loads((tmp_path / "r.json").read_text()))
        assert f"{1000 * reports[-1]['mean_error']:.1f} mm per joint" in done.stdout
        assert f"{reports[-1]['normalised_return']:.3f} of the way from mean pose to oracle" in done.stdout
    assert reports[0]["errors"] == reports[1]["errors"]
    assert [report["agent"] for report in reports] == ["agents:Mine", "blob"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("blob", "--task", "motionenv/Nothing-v1"), "task must be one of"),
        (("nobody", "--task", "motionenv/MarkerTracking-Easy-v1"), "mine:Follower"),
        (("nobody:Mine", "--task", "motionenv/MarkerTracking-Easy-v1"), "got 'nobody:Mine', and there is no nobody\n"),
        (("json:Mine", "--task", "motionenv/MarkerTracking-Easy-v1"), "got 'json:Mine', and there is no Mine\n"),
        (("blob", "--task", "motionenv/MarkerTracking-Easy-v1", "--split", "test"), "split must be one of"),
        (("blob", "--task", "motionenv/MarkerTracking-Easy-v1", "--out", "no/where.json"), "there is no folder"),
        (("blob", "--task", "motionenv/MarkerTracking-Easy-v1", "--motion", "walks"), "use it with split 'ood'"),
    ],
)
def test_what_can_not_be_scored_is_refused_in_one_line(tmp_path, words, says):
    done = run(tmp_path, *words)
    assert done.returncode == 2
    assert says in done.stderr
    assert done.stderr.count("\n") == 1
