"""The motion tree of paper C, everything that is measured of it on real capture, as markdown tables.

    python benchmarks/tree.py [--mocap FOLDER] [--quick] [--large] [--plot FILE]

Runs the scripts below one after the other, each by itself and with one BLAS thread: what uses two cores says so. Takes
three minutes on two cores, four with --large.
"""

import os
import subprocess
import sys
from pathlib import Path

SCRIPTS = ("tree_variance", "tree_accuracy", "tree_prediction", "tree_synthesis", "tree_speed")


def main() -> int:
    """Run them all; the exit code is that of the worst."""
    code = 0
    for name in SCRIPTS:
        print(f"\n## {name}.py\n", flush=True)
        done = subprocess.run(
            [sys.executable, str(Path(__file__).with_name(f"{name}.py")), *sys.argv[1:]],
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        code = max(code, done.returncode)
    return code


if __name__ == "__main__":
    sys.exit(main())
