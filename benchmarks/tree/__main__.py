"""All benchmarks of the motion tree of paper C on real capture, as Markdown tables.

    python -m benchmarks.tree [--mocap FOLDER] [--quick] [--large] [--plot FILE]

Runs the modules below in turn, each in a separate process with one BLAS thread. Takes three minutes on two cores, four
with --large.
"""

import os
import subprocess
import sys

MODULES = ("variance", "accuracy", "prediction", "synthesis", "speed")


def main() -> int:
    """Run all modules; return the greatest exit code."""
    code = 0
    for name in MODULES:
        print(f"\n## {name}\n", flush=True)
        done = subprocess.run(
            [sys.executable, "-m", f"benchmarks.tree.{name}", *sys.argv[1:]],
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        code = max(code, done.returncode)
    return code


if __name__ == "__main__":
    sys.exit(main())
