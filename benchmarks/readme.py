"""Make README's table "What is measured" anew: run its benchmarks one after the other, and print its rows.

    motionenv bench readme [--write] [--mujoco PYTHON]

Takes about an hour of a machine with two cores, which must be quiet in the first quarter; and motion capture, the extra
`bench` and wrk. --write puts the rows and where they were measured into README.md, between its markers; with --quick
they are only printed.
"""

import datetime
import os
import platform
import re
import subprocess
import sys
from dataclasses import dataclass

import motionenv
from benchmarks import ROOT, Arguments, headlines

BEGIN, END = "<!-- measured: `motionenv bench readme --write` makes these lines -->", "<!-- /measured -->"
HEAD = "| what | result | compared with | command |\n|-|-|-|-|"


@dataclass(frozen=True)
class Row:
    """A row of the table: what is measured, and templates for the numbers of `command`'s headline.

    What is `timed` runs first, so that the machine need be quiet for ten minutes only.
    """

    what: str
    result: str
    peer: str
    command: str
    timed: bool = False


ROWS = (
    Row("RGB, depth and limb ids, 64×64, one thread", "{images:,.0f} images/s",
        "{ratio:,.0f}× pyrender on EGL, same scene", "render", timed=True),
    Row("synthesis of four-second walks, 30 fps", "{frames:,.1f} M frames/s", "{ratio:.0f}× a loop over frames",
        "models.synthesis", timed=True),
    Row("functional PCA of 4,000 cycles with gaps, default / `svd`", "{ppca:.2f} s / {svd:.2f} s",
        "{ppca_ratio:.0f}× / {svd_ratio:.0f}× the paper's algorithm", "models.fpca", timed=True),
    Row("error of filled gaps, real walks", "{ratio:.2f}×", "the best of {peers:.0f} other methods",
        "models.imputation"),
    Row("depth from one known view, people left out", "{depth:.1f} mm rms",
        "{depth_ls:.1f} / {depth_map:.1f} mm, least squares / MAP of the paper", "lifting"),
    Row("unknown view, people left out", "{view:.1f}° mean error", "{view_map:.1f}°, MAP of the paper", "lifting"),
    Row("people who turn, of a data set never seen, camera known", "{turns:.0f} mm per joint",
        "{network:.0f} mm, a temporal network alone", "free_walking"),
    Row("motion-tree draws, 50,000 windows", "{draws:.1f} M/s", "{ratio:.0f}× the fastest brute force we wrote",
        "tree.speed", timed=True),
    Row("WalkerTracking, 64×64 RGB, 64 environments", "{frames:,.0f} frames/s",
        "{ratio:.0f}× MuJoCo Humanoid-v5 with plain pixels", "envs.speed", timed=True),
    Row("people no prior has seen, clutter, 1,000 particles", "{error:.0f} mm per joint, {kept:.0f} % kept",
        "constant velocity: {peer_kept:.0f} % kept", "tracking --only trackers"),
    Row("people who turn in a film, clutter, a passer-by, detections", 
        "{error:.0f} mm per joint, {kept:.0f} % of frames kept",
        "detected by BlazePose: {peer_error:.0f} mm, {peer_kept:.0f} % kept", "tracking.detected_films"),
    Row("four-second walks over HTTP, one worker", "{requests:,.0f} requests/s",
        "{ratio:.2f}× bare Starlette doing the same work", "service", timed=True),
)  # fmt: skip


def line(row: Row, numbers: dict[str, float]) -> str:
    """A row of the table; a dash where a peer was missing."""
    cells = [row.result, row.peer]
    for i, template in enumerate(cells):
        known = set(re.findall(r"{(\w+)", template)) <= numbers.keys()
        cells[i] = template.format(**numbers) if known else "–"
    return f"| {row.what} | {' | '.join(cells)} | `motionenv bench {row.command}` |"


def measured(command: str, more: list[str]) -> dict[str, float]:
    """Run a benchmark in a process of its own, showing its output; return its headline."""
    words = [sys.executable, "-m", f"benchmarks.{command.split()[0]}", *command.split()[1:], *more]
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    told = []
    with subprocess.Popen(words, env=os.environ | {"PYTHONPATH": path}, stdout=subprocess.PIPE, text=True) as running:
        for text in running.stdout:
            print(text, end="", flush=True)
            told.append(text)
    if running.returncode:
        raise SystemExit(f"{command} ended with status {running.returncode}")
    return headlines("".join(told))


def where() -> str:
    """The machine, the date and the version."""
    info = open("/proc/cpuinfo", encoding="utf-8").read() if os.path.exists("/proc/cpuinfo") else ""
    model = re.search(r"model name\s*: (.*)", info)
    processor = model[1] if model else platform.processor() or platform.machine()
    return f"Version {motionenv.__version__}, {datetime.date.today()}, {os.cpu_count()} cores of {processor}, no GPU."


def main() -> None:
    """Run the benchmarks, and print or write the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--write", action="store_true", help="write the rows into README.md")
    parser.add_argument("--mujoco", default=sys.executable, help="a Python that has gymnasium[mujoco]")
    asked = parser.parse_args()
    more = {"envs.speed": ["--mujoco", asked.mujoco]}
    quick = ["--quick"] if asked.quick else []
    commands = dict.fromkeys(row.command for row in sorted(ROWS, key=lambda row: not row.timed))
    numbers = {c: measured(c, [*more.get(c, []), *quick]) for c in commands}
    table = "\n".join([where(), "", HEAD, *(line(row, numbers[row.command]) for row in ROWS)])
    print(f"\n{table}")
    if asked.write and not asked.quick:
        readme = ROOT / "README.md"
        before, _, rest = readme.read_text(encoding="utf-8").partition(BEGIN)
        after = rest.partition(END)[2]
        readme.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
