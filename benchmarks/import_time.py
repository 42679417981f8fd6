"""Time of `import motionenv` in a fresh interpreter, compared with an empty script and `import numpy`.

Goal: under 0.3 s, no OpenGL, no FastAPI. Run: python -m benchmarks.import_time
"""

import statistics
import subprocess
import sys
import time

ROUNDS = 15
STATEMENTS = {"an empty script": "pass", "import numpy": "import numpy", "import motionenv": "import motionenv"}


def seconds(statement: str) -> float:
    """Wall time of one fresh interpreter that runs `statement`."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], check=True)
    return time.perf_counter() - start


def main() -> None:
    """Print the medians. Statements alternate, so that noise affects all equally."""
    times: dict[str, list[float]] = {name: [] for name in STATEMENTS}
    for statement in STATEMENTS.values():  # warm up bytecode and page cache
        seconds(statement)
    for _ in range(ROUNDS):
        for name, statement in STATEMENTS.items():
            times[name].append(seconds(statement))
    median = {name: statistics.median(values) for name, values in times.items()}
    print(f"| fresh interpreter, median of {ROUNDS} | s | relative to `import numpy` |\n|-|-|-|")
    for name, value in median.items():
        print(f"| {name} | {value:.3f} | {value / median['import numpy']:.2f}× |")


if __name__ == "__main__":
    main()
