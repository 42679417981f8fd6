"""The leaderboard's table: every result stands in it, and every agent without one has a reason."""

import json

import pytest

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is missing: pip install -e '.[integrations]'")
from benchmarks.leaderboard import FIXED, TRAINED, table


def write(folder, task: str, agent: str, errors: list[float]) -> None:
    report = {"mean_error": sum(errors) / len(errors), "error_interval": [min(errors), max(errors)], "errors": errors}
    trained = {"minutes": 3.0} if agent in TRAINED else {}
    (folder / f"{task} {agent}.json").write_text(json.dumps({**trained, "eval": report, "ood": report}))


def test_results_stand_in_their_cells_and_what_is_missing_has_a_reason(tmp_path):
    write(tmp_path, "MarkerTracking-Easy-v1", "memoryless network", [0.03] * 40 + [0.05] * 40)
    write(tmp_path, "MarkerTracking-Easy-v1", "recurrent network", [0.02] * 40 + [0.06] * 40)
    section = table(tmp_path).split("## MarkerTracking")[1].split("## ")[0]
    assert "| memoryless network, 3 min | 40 (30–50) | 40 (30–50) | – | – | – | – |" in section
    assert "MarkerTracking-Easy-v1: memory divides the error by 1.00, and helps in 50 % of episodes." in section
    for agent in (*FIXED, *TRAINED):
        assert f"- {agent}: " in section
