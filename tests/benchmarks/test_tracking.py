"""The benchmark of trackers runs, on a folder of a few captured walks."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest


@pytest.mark.slow
def test_bench_tracking_compares_trackers(mocap, tmp_path):
    asked = ["--mocap", mocap, "--out", tmp_path, "--only", "body", "--episodes", "2", "--processes", "2", "--quick"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.tracking", *map(str, asked)],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "tracking.json").read_text(encoding="utf-8"))["body"]
    tree, velocity = rows[0], rows[2]
    assert tree["absolute [mm]"][0] < velocity["absolute [mm]"][0]
    for row in rows:
        assert row["name"] in done.stdout
        assert len(row["episodes"]) == 2
        for name in ("kept", "absolute [mm]", "relative [mm]", "coverage"):
            value, low, high = row[name]
            assert low - 1e-9 <= value <= high + 1e-9
            assert np.isfinite(value)
