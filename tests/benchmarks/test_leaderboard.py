"""The leaderboard's table: every result stands in it, and every agent without one has a reason."""

import json
import re

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is missing: pip install -e '.[integrations]'")
from benchmarks.leaderboard import FIXED, TRAINED, resampled, table


def write(folder, task: str, agent: str, *runs: list[float]) -> None:
    reports = [{key: {"errors": run, "normalised_return": 0.5} for key in ("eval", "ood")} for run in runs]
    trained = {"frames": 3000} if agent in TRAINED else {}
    (folder / f"{task} {agent}.json").write_text(json.dumps({**trained, "runs": reports}))


def test_results_stand_in_their_cells_and_what_is_missing_has_a_reason(tmp_path):
    write(tmp_path, "MarkerTracking-Easy-v1", "memoryless network", *[[0.04] * 64] * 3)
    write(tmp_path, "MarkerTracking-Easy-v1", "recurrent network", *[[0.02] * 32 + [0.06] * 32] * 3)
    write(tmp_path, "MarkerTracking-Easy-Full-v1", "memoryless network", *[[0.01] * 64] * 3)
    section = table(tmp_path).split("## MarkerTracking")[1].split("## ")[0]
    cell = "40 (40–40), 0.50"
    assert f"| memoryless network, 3,000 frames | {cell} | {cell} | – | – | – | – |" in section
    assert re.search(r"MarkerTracking-Easy-v1: memory divides the error by 1.00 \(0.\d\d–1.\d\d\)", section)
    assert "and helps in 50 % of episodes." in section
    assert "not seeing costs the memoryless network 30 mm; it is off by 10 mm in MarkerTracking-Easy-Full-v1" in section
    for agent in (*FIXED, *TRAINED):
        assert f"- {agent}: " in section


def test_networks_are_compared_on_equal_frames_only(tmp_path):
    for kind, frames in (("memoryless", 3000), ("recurrent", 6000)):
        write(tmp_path, "ArmTracking-Easy-v2", f"{kind} network", [0.04] * 64)
        file = tmp_path / f"ArmTracking-Easy-v2 {kind} network.json"
        file.write_text(json.dumps({**json.loads(file.read_text()), "frames": frames}))
    assert "| recurrent network, 6,000 frames, 1 seed | 40" in table(tmp_path)
    assert "memory divides" not in table(tmp_path)


def test_intervals_are_over_episodes_and_seeds():
    """Of many seeds and episodes that differ independently, the variances of both means add."""
    rng = np.random.default_rng(0)
    seeds, episodes = rng.normal(0, 1.0, (40, 1)), rng.normal(0, 2.0, (1, 60))
    expected = np.sqrt(seeds.var() / 40 + episodes.var() / 60)
    means = resampled(seeds + episodes)
    assert means.std() == pytest.approx(expected, rel=0.05)
    assert means.mean() == pytest.approx((seeds + episodes).mean(), abs=0.05)
