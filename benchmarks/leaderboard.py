"""Every baseline on every named task: benchmarks/LEADERBOARD.md.

    motionenv bench leaderboard [--tasks Marker] [--agents recurrent] [--share 1] [--seeds 3] [--episodes 64] [--again]

Each result is kept as a JSON file of reports of `motionenv.envs.agents.score` in the folder `--results`; the table is
made of all that lie there, so that it can be made in parts: what lies there isn't run again, unless `--again` says so
(`--agents filter --again` replaces the particle filters' rows). Trained agents learn on split "train" from a fixed
number of frames (`--share` of `FRAMES`), so that agents with and without memory have seen as much, once for each of
`--seeds`; each is scored once, on "eval" and "ood". Fully observable twins are played by what learns.

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
from motionenv.tracking import VelocityPrior

HERE = Path(__file__).parent
SPLITS = ("eval", "ood")
FAMILIES = ("Walker", "Marker", "Arm")
EPISODES, SEEDS = 64, 3  # of an evaluation, and of training
FRAMES = {"Walker": 400_000, "Marker": 2_000_000, "Arm": 300_000}  # of an imitation
STEPS = 100_000  # of PPO
_RESAMPLED = 2000  # bootstrap samples


def _arm_filter(env):
    return TrackingAgent(env, VelocityPrior(part="right_arm"), 500, start=truth_start, seed=0, threads=1)


#: Agents that don't learn: name, how they are made, and the families that they can play.
FIXED: dict[str, tuple[str | Callable, tuple[str, ...]]] = {
    "mean pose": ("mean-pose", ("Walker", "Marker", "Arm")),
    "blob": ("blob", ("Walker", "Marker")),
    "Kalman filter": ("kalman", ("Walker", "Marker")),
    "particle filter": ("particle-filter", ("Walker",)),
    "particle filter, first pose given": (_arm_filter, ("Arm",)),
}
#: Agents that learn: name, and what trains them for a task, from so many frames, with a seed.
TRAINED: dict[str, Callable[[str, int, int], Callable]] = {
    "memoryless network": lambda task, frames, seed: partial(_played, imitate(task, False, frames, seed)),
    "recurrent network": lambda task, frames, seed: partial(_played, imitate(task, True, frames, seed)),
    "PPO, γ = 0": lambda task, frames, seed: partial(_same, improve(task, frames, seed=seed)),
}
#: Why an agent has no result in a family: those that can't play it, and those that weren't run everywhere.
REASONS = {
    ("blob", "Arm"): "an arm's silhouette stays where it is, so its place tells nothing.",
    ("Kalman filter", "Arm"): "an arm's silhouette stays where it is, so its place tells nothing.",
    ("particle filter", "Marker"): "it follows people in pictures only.",
    ("particle filter", "Arm"): "it can't find an arm's first pose, and is told it in a row of its own.",
    ("particle filter, first pose given", "Walker"): "it is for arms, whose first pose it can't find.",
    ("particle filter, first pose given", "Marker"): "it follows people in pictures only.",
}
NOT_RUN = "not run where it is missing, for want of time; `motionenv bench leaderboard --agents` with its name adds it."


def _played(network, env) -> Learned:
    return Learned(env, network)


def _same(agent, _):
    return agent


def results(
    folder: Path, tasks: list[str], agents: list[str], share: float, episodes: int, seeds: int, again: bool = False
) -> None:
    """Score `agents` on `tasks`, and write each result to `folder`; those that lie there only if `again`."""
    for task in tasks:
        for name in agents:
            file = folder / f"{task.removeprefix('motionenv/')} {name}.json"
            if name in FIXED and ("Full" in task or not any(f"/{family}" in task for family in FIXED[name][1])):
                continue
            if file.exists() and not again:
                continue
            runs, frames = [], max(1, round(share * (STEPS if "PPO" in name else FRAMES[_family(task)])))
            for seed in range(seeds if name in TRAINED else 1):
                make = FIXED[name][0] if name in FIXED else TRAINED[name](task, frames, seed)
                runs.append({split: score(task, make, episodes, split=split) for split in SPLITS})
            trained = {} if name in FIXED else {"frames": frames}
            file.write_text(json.dumps({"name": name, **trained, "runs": runs}), encoding="utf-8")
            print(f"{file.stem}: {cell(runs, 'eval')}", flush=True)


def _family(task: str) -> str:
    return next(family for family in FAMILIES if family in task)


def errors(runs: list[dict], split: str) -> np.ndarray:
    """Errors (seeds, episodes) [m] of runs on a `split`."""
    return np.array([run[split]["errors"] for run in runs])


def resampled(values: np.ndarray) -> np.ndarray:
    """Bootstrap means (samples,) of values (seeds, episodes): both are drawn, always the same ones."""
    rng, (seeds, episodes) = np.random.default_rng(0), values.shape
    drawn = rng.integers(episodes, size=(_RESAMPLED, 1, episodes)), rng.integers(seeds, size=(_RESAMPLED, seeds, 1))
    return values[drawn[1], drawn[0]].mean(axis=(1, 2))


def cell(runs: list[dict], split: str) -> str:
    """Mean error with its interval, in millimetres, and the mean of the normalised returns."""
    values = errors(runs, split)
    low, high = np.percentile(resampled(values), [2.5, 97.5])
    share = np.mean([run[split]["normalised_return"] for run in runs])
    return f"{1000 * values.mean():.0f} ({1000 * low:.0f}–{1000 * high:.0f}), {share:.2f}"


def table(folder: Path) -> str:
    """The leaderboard, of all results in `folder`."""
    found = {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in sorted(folder.glob("*.json"))}
    lines = [INTRODUCTION]
    for family in FAMILIES:
        tasks = [task for task in TASKS if f"/{family}" in task and "Full" not in task]
        names = [name.removeprefix("motionenv/") for task in tasks for name in (task, "ood")]
        lines.append(f"\n## {family}Tracking\n\n| error per joint [mm], normalised return | {' | '.join(names)} |")
        lines.append("|-|" + "-|" * len(names))
        for agent in (*FIXED, *TRAINED):
            row = [found.get(f"{task.removeprefix('motionenv/')} {agent}") for task in tasks]
            if any(row):
                cells = [cell(r["runs"], split) if r else "–" for r in row for split in SPLITS]
                runs = [(r.get("frames"), len(r["runs"]), errors(r["runs"], "eval").shape[1]) for r in row if r]
                frames = sorted({f"{frames:,}" for frames, _, _ in runs if frames})
                name = f"{agent}, {' or '.join(frames)} frames" if frames else agent
                seeds, episodes = min(seeds for _, seeds, _ in runs), min(episodes for _, _, episodes in runs)
                name += f", {seeds} seed{'s' * (seeds > 1)}" if frames and seeds != SEEDS else ""
                name += f", {episodes} episodes" if episodes < EPISODES else ""
                lines.append(f"| {name} | {' | '.join(cells)} |")
        lines += ["", *memory(found, tasks), *seeing(found, tasks), *missing(found, family, tasks)]
    return "\n".join(lines) + "\n"


def memory(found: dict, tasks: list[str]) -> list[str]:
    """What memory gains on `tasks`: errors of the memoryless network over the recurrent one's, on equal frames."""
    lines = []
    for task in (task.removeprefix("motionenv/") for task in tasks):
        pair = [f"{task} {kind} network" for kind in ("memoryless", "recurrent")]
        if all(name in found for name in pair) and len({found[name]["frames"] for name in pair}) == 1:
            without, with_ = (errors(found[name]["runs"], "eval") for name in pair)
            low, high = np.percentile(resampled(without) / resampled(with_), [2.5, 97.5])
            better = 100 * (with_.mean(axis=0) < without.mean(axis=0)).mean()
            gain = f"{without.mean() / with_.mean():.2f} ({low:.2f}–{high:.2f})"
            lines.append(f"- {task}: memory divides the error by {gain}, and helps in {better:.0f} % of episodes.")
    return lines


def seeing(found: dict, tasks: list[str]) -> list[str]:
    """What not seeing costs on `tasks`: errors of learned agents less those in the fully observable twins."""
    lines = []
    for task in tasks:
        for agent in TRAINED:
            names = [f"{name.removeprefix('motionenv/')} {agent}" for name in (task, str(TASKS[task].full))]
            if all(name in found for name in names):
                off, full = (1000 * errors(found[name]["runs"], "eval").mean() for name in names)
                lines.append(
                    f"- {task.removeprefix('motionenv/')}: not seeing costs the {agent} {off - full:.0f} mm; it is off "
                    f"by {full:.0f} mm in {str(TASKS[task].full).removeprefix('motionenv/')}."
                )
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

Made by `motionenv bench leaderboard`. Mean error per joint in millimetres over 64 episodes with fixed seeds, with its
95 % bootstrap interval, and the normalised return: 0 is the mean pose's in the same episodes, 1 the oracle's. After
each task, its split `ood`: smaller and faster people of another model, before another camera. Agents that learn did so
on split `train`, from as many frames as stand after their names, three times from different seeds; their intervals are
over episodes and seeds. Score your own agent with `motionenv evaluate AGENT --task ID`.

Networks learn by imitation, those with and without memory from the same number of frames. `-Full` tasks show the true
joints. Dashes, and agents that aren't there, have their reasons below each table. ActiveTracking, where what one does
changes what one sees, has [a table of its own](RESULTS.md#envsactive)."""


def main() -> None:
    """Score what is asked for, and write the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--tasks", default="", quick="Easy", help="only those whose id contains this")
    parser.add_argument("--agents", default="", help="only those whose name contains this")
    parser.add_argument("--share", type=float, default=1.0, quick=1e-6, help="of the frames, of each training")
    parser.add_argument("--seeds", type=int, default=SEEDS, quick=1, help="of each training")
    parser.add_argument("--episodes", type=int, default=EPISODES, quick=1)
    parser.add_argument("--again", action="store_true", help="also what has a result already")
    parser.add_argument("--results", type=Path, default=Path("leaderboard"), quick=scratch(), help="folder of results")
    parser.add_argument("--out", type=Path, default=HERE / "LEADERBOARD.md", quick=scratch() / "LEADERBOARD.md")
    asked = parser.parse_args()
    tasks = [task for task in TASKS if asked.tasks in task and any(f"/{family}" in task for family in FAMILIES)]
    agents = [name for name in (*FIXED, *TRAINED) if asked.agents in name]
    if not (tasks and agents):
        parser.error("no task or no agent has such a name: see LEADERBOARD.md")
    asked.results.mkdir(parents=True, exist_ok=True)
    results(asked.results, tasks, agents, asked.share, asked.episodes, asked.seeds, asked.again)
    asked.out.write_text(table(asked.results), encoding="utf-8")
    print(table(asked.results))


if __name__ == "__main__":
    main()
