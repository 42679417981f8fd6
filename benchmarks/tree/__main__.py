"""All benchmarks of the motion tree of paper C on real capture, as Markdown tables.

    motionenv bench tree [--mocap FOLDER] [--large] [--plot FILE]

Runs the modules below in turn, each in a separate process with one BLAS thread. Takes three minutes on two cores, four
with --large.
"""

import os
import subprocess
import sys

from benchmarks.tree.capture import options

MODULES = ("variance", "accuracy", "prediction", "synthesis", "speed")


def main() -> None:
    """Run all modules; exit with the greatest status."""
    options(__doc__).parse_args()
    code = 0
    for name in MODULES:
        print(f"\n## {name}\n", flush=True)
        command = [sys.executable, "-m", f"benchmarks.tree.{name}", *sys.argv[1:]]
        code = max(code, subprocess.run(command, env={**os.environ, "OMP_NUM_THREADS": "1"}, check=False).returncode)
    sys.exit(code)


if __name__ == "__main__":
    main()
