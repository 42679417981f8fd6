"""Every baseline on every named task: benchmarks/LEADERBOARD.md.

    motionenv bench leaderboard [--tasks Marker] [--agents recurrent] [--minutes 3] [--episodes 64] [--again]

Each result is kept as a JSON file of `motionenv.envs.agents.score` in the folder `--results`; the table is made of all
that lie there, so that it can be made in parts: what lies there isn't run again, unless `--again` says so (`--agents
filter --again` replaces the particle filters' rows). Trained agents learn on split "train" for `--minutes` of one
core's time each, and are scored once, on "eval" and "ood".

Needs PyTorch and Stable-Baselines3: pip install -e '.[agents,bench]'
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import motionenv.envs  # noqa: F401 (registers the tasks)
from benchmarks import Arguments, needs, scratch

needs("torch", "stable_baselines3")
from benchmarks.envs.tasks.imitation import imitate
from benchmarks.envs.tasks.networks import Learned
from benchmarks.envs.tasks.ppo import improve
from motionenv.envs.agents import TrackingAgent, score, truth_start
from motionenv.envs.tasks import TASKS
from motionenv.tracking import FPCAPrior, MixturePrior, VelocityPrior

HERE = Path(__file__).parent
SPLITS = ("eval", "ood")
FAMILIES = ("Walker", "Marker", "Arm")
EPISODES, SLOW = 64, 16  # of an evaluation, and of a particle filter's


def _arm_filter(env):
    return TrackingAgent(env, VelocityPrior(part="right_arm"), 500, start=truth_start, seed=0, threads=1)


def _mixture_filter(env):
    prior = MixturePrior(FPCAPrior(), VelocityPrior(skeleton=FPCAPrior().skeleton))
    return TrackingAgent(env, prior, seed=0, threads=1)


#: Agents that don't learn: name, how they are made, and the families that they can play.
FIXED: dict[str, tuple[str | Callable, tuple[str, ...]]] = {
    "mean pose": ("mean-pose", ("Walker", "Marker", "Arm")),
    "blob": ("blob", ("Walker", "Marker")),
    "constant velocity": ("constant-velocity", ("Walker", "Marker")),
    "particle filter": ("particle-filter", ("Walker",)),
    "particle filter, mixed prior": (_mixture_filter, ("Walker",)),
    "particle filter, first pose given": (_arm_filter, ("Arm",)),
}
#: Agents that learn: name, and what trains them for a task.
TRAINED: dict[str, Callable[[str, float], Callable]] = {
    "memoryless network": lambda task, minutes: partial(_played, imitate(task, False, minutes)),
    "recurrent network": lambda task, minutes: partial(_played, imitate(task, True, minutes)),
    "PPO, γ = 0": lambda task, minutes: partial(_same, improve(task, minutes)),
}
_SLOW_LEARNER = "it learns far more slowly than imitation, and was run in MarkerTracking-Easy only."
#: Why an agent has no result in a family: those that can't play it, and those that weren't run everywhere.
REASONS = {
    ("blob", "Arm"): "an arm's silhouette stays where it is, so its place tells nothing.",
    ("constant velocity", "Arm"): "an arm's silhouette stays where it is, so its place tells nothing.",
    ("particle filter", "Marker"): "it follows people in pictures only.",
    ("particle filter, mixed prior", "Marker"): "it follows people in pictures only.",
    ("particle filter", "Arm"): "it can't find an arm's first pose, and is told it in a row of its own.",
    ("particle filter, mixed prior", "Arm"): "its priors are of walking.",
    ("particle filter, first pose given", "Walker"): "it is for arms, whose first pose it can't find.",
    ("particle filter, first pose given", "Marker"): "it follows people in pictures only.",
    **dict.fromkeys([("PPO, γ = 0", family) for family in FAMILIES], _SLOW_LEARNER),
}
NOT_RUN = "not run yet, for want of time; `motionenv bench leaderboard --agents` with its name adds it."


def _played(network, env) -> Learned:
    return Learned(env, network)


def _same(agent, _):
    return agent


def results(
    folder: Path, tasks: list[str], agents: list[str], minutes: float, episodes: int, again: bool = False
) -> None:
    """Score `agents` on `tasks`, and write each result to `folder`; those that lie there only if `again`."""
    for task in tasks:
        for name in agents:
            file = folder / f"{task.removeprefix('motionenv/')} {name}.json"
            if name in FIXED and not any(f"/{family}" in task for family in FIXED[name][1]):
                continue
            if file.exists() and not again:
                continue
            make = FIXED[name][0] if name in FIXED else TRAINED[name](task, minutes)
            n = min(SLOW, episodes) if "filter" in name else episodes
            reports = {split: score(task, make, n, split=split) for split in SPLITS}
            trained = {} if name in FIXED else {"minutes": minutes}
            file.write_text(json.dumps({"name": name, **trained, **reports}), encoding="utf-8")
            print(f"{file.stem}: {cell(reports['eval'])}", flush=True)


def cell(report: dict) -> str:
    """Mean error with its interval, in millimetres."""
    low, high = report["error_interval"]
    return f"{1000 * report['mean_error']:.0f} ({1000 * low:.0f}–{1000 * high:.0f})"


def table(folder: Path) -> str:
    """The leaderboard, of all results in `folder`."""
    found = {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.glob("*.json"))}
    lines = [INTRODUCTION]
    for family in FAMILIES:
        tasks = [task for task in TASKS if f"/{family}" in task]
        names = [name.removeprefix("motionenv/").removesuffix("-v1") for task in tasks for name in (task, "ood")]
        lines.append(f"\n## {family}Tracking\n\n| error per joint [mm] | {' | '.join(names)} |")
        lines.append("|-|" + "-|" * len(names))
        for agent in (*FIXED, *TRAINED):
            row = [found.get(f"{task.removeprefix('motionenv/')} {agent}") for task in tasks]
            if any(row):
                cells = [cell(r[split]) if r else "–" for r in row for split in SPLITS]
                minutes = sorted({f"{r['minutes']:g}" for r in row if r and "minutes" in r})
                name = f"{agent}, {' or '.join(minutes)} min" if minutes else agent
                episodes = min(len(r["eval"]["errors"]) for r in row if r)
                name += f", {episodes} episodes" if episodes < EPISODES else ""
                lines.append(f"| {name} | {' | '.join(cells)} |")
        lines += ["", *memory(found, tasks), *missing(found, family, tasks)]
    return "\n".join(lines) + "\n"


def memory(found: dict, tasks: list[str]) -> list[str]:
    """What memory gains on `tasks`: errors of the memoryless network over those of the recurrent one."""
    lines = []
    for task in (task.removeprefix("motionenv/") for task in tasks):
        pair = [found.get(f"{task} {kind} network") for kind in ("memoryless", "recurrent")]
        if all(pair):
            without, with_ = (np.array(r["eval"]["errors"]) for r in pair)
            gain, better = without.mean() / with_.mean(), 100 * (with_ < without).mean()
            lines.append(f"- {task}: memory divides the error by {gain:.2f}, and helps in {better:.0f} % of episodes.")
    return lines


def missing(found: dict, family: str, tasks: list[str]) -> list[str]:
    """Which agents lack results on `tasks` of a `family`, and why."""
    lines = []
    for agent in (*FIXED, *TRAINED):
        names = [task.removeprefix("motionenv/") for task in tasks]
        if any(f"{name} {agent}" not in found for name in names):
            lines.append(f"- {agent}: {REASONS.get((agent, family), NOT_RUN)}")
    return lines


INTRODUCTION = """# Leaderboard

Made by `motionenv bench leaderboard`. Mean error per joint in millimetres over episodes with fixed seeds, with its 95 %
bootstrap interval: 64 episodes, fewer where it says so. After each task, its split `ood`: smaller and faster people of
another model, before another camera. Trained agents learned on split `train` for as many minutes of one core's time as
stand after their names, and were scored once. Score your own agent with `motionenv evaluate AGENT --task ID`.

Networks learn by imitation; the recurrent one sees fewer frames in the same time. Dashes, and agents that aren't there,
have their reasons below each table. ActiveTracking, where what one does changes what one sees, has
[a table of its own](RESULTS.md#envsactive)."""


def main() -> None:
    """Score what is asked for, and write the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--tasks", default="", quick="Easy", help="only those whose id contains this")
    parser.add_argument("--agents", default="", help="only those whose name contains this")
    parser.add_argument("--minutes", type=float, default=3.0, quick=0.001, help="of one core's time, of each training")
    parser.add_argument("--episodes", type=int, default=EPISODES, quick=1)
    parser.add_argument("--again", action="store_true", help="also what has a result already")
    parser.add_argument("--results", type=Path, default=Path("leaderboard"), quick=scratch(), help="folder of results")
    parser.add_argument("--out", type=Path, default=HERE / "LEADERBOARD.md", quick=scratch() / "LEADERBOARD.md")
    asked = parser.parse_args()
    asked.results.mkdir(parents=True, exist_ok=True)
    tasks = [task for task in TASKS if asked.tasks in task and any(f"/{family}" in task for family in FAMILIES)]
    agents = [name for name in (*FIXED, *TRAINED) if asked.agents in name]
    results(asked.results, tasks, agents, asked.minutes, asked.episodes, asked.again)
    asked.out.write_text(table(asked.results), encoding="utf-8")
    print(table(asked.results))


if __name__ == "__main__":
    main()
