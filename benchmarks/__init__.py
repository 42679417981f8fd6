"""Benchmarks, one module per claim. Each prints its tables; RESULTS.md holds the results.

Run them from a checkout: `python -m benchmarks.NAME` or `motionenv bench NAME`.
"""

from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Default folder of motion capture; --mocap overrides it.
MOCAP = ROOT.parent / "shared" / "mocap"
