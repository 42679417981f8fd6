"""Agents in ActiveTracking: rewards, and what looking is worth, with 95 % intervals.

    motionenv bench envs.active [--episodes 256] [--levels Easy Medium Hard] [--learned ppo=ppo.pt]
    motionenv bench envs.active --split train --episodes 64 --levels Hard --change pillars=8 turn_seconds=12

All share the estimator (`motionenv.envs.active.Beliefs`), episodes and seeds, so that differences between them are
paired by episode and come from looking. Rewards are also given as shares of the range from the still camera to the
oracle, who knows where everybody is. `--change` tells what a level's settings do. Settings were chosen on split
"train", those of the sweep by `motionenv bench envs.active.open_loop`; networks come from `ppo`. "myopic" is the
planner with rollouts of 0.4 s, "index" has none and takes what is most worthwhile at once. `--strip FILE` writes frames
of the planner instead.
"""

from pathlib import Path

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments, scratch
from benchmarks.envs.active import LEVELS
from motionenv.envs.active import Greedy, Oracle, Planner, Still, Sweep
from motionenv.envs.agents import evaluate

ENVS = 64  # at once


class Myopic(Planner):
    """The planner with short rollouts."""

    seconds = 0.4


class Index(Planner):
    """The planner without rollouts."""

    seconds, breadth = 0.4, 1


#: By name; the first two are the ends of the range.
POLICIES = {
    "still": Still, "oracle": Oracle, "sweep": Sweep, "greedy": Greedy, "index": Index, "myopic": Myopic,
    "planner": Planner,
}  # fmt: skip


def interval(values: np.ndarray, digits: int = 3) -> str:
    """Mean and 95 % interval of the mean."""
    half, mean = 1.96 * values.std(ddof=1) / np.sqrt(len(values)), values.mean()
    return f"{mean:.{digits}f} ({mean - half:.{digits}f} to {mean + half:.{digits}f})"


def table(makers: dict, episodes: int, level: str, split: str, change: dict[str, float]) -> None:
    """Print a row for each policy: rewards, errors, shares of the range, and what the planner has more of it."""
    changed = "".join(f", {name}={value:g}" for name, value in change.items())
    print(f"\n{level}{changed}, {episodes} episodes of split {split}\n")
    print("| policy | reward per estimate [m] | error [m] | share of the range | planner's share more |\n|-|-|-|-|-|")
    found = {name: played(make, episodes, level, split, change) for name, make in makers.items()}
    low, high = (found[name][0].mean() for name in ("still", "oracle"))
    for name, (rewards, error) in found.items():
        share = (rewards - low) / (high - low)
        more = (found["planner"][0] - rewards) / (high - low)
        better = interval(more) if name not in ("oracle", "planner") else "–"
        print(f"| {name} | {interval(rewards)} | {error:.2f} | {share.mean():.3f} | {better} |", flush=True)


def played(make, episodes: int, level: str, split: str, change: dict[str, float]) -> tuple[np.ndarray, float]:
    """Mean rewards (episodes,) of a policy, and its mean error [m]."""
    name = f"motionenv/ActiveTracking-{level}-v1"
    env = gymnasium.make_vec(name, num_envs=min(ENVS, episodes), split=split, **change)
    scores = evaluate(env, make(env), episodes, seed=1)
    return scores.returns / scores.lengths, float(scores.errors.mean())


def strip(path: Path, rows: int, first: int = 200, seed: int = 3) -> None:
    """Write frames of the planner, two seconds apart, each row the square from above and the camera's view."""
    from PIL import Image

    env = gymnasium.make("motionenv/ActiveTracking-Medium-v1", render_mode="rgb_array", split="eval")
    planner = Planner(env)
    observation, _ = env.reset(seed=seed)
    planner.reset(observation)
    frames = []
    for time in range(first + 20 * rows):
        observation, *_ = env.step(planner.act(observation))
        if time >= first and time % 20 == 0:
            frames.append(env.render())
    Image.fromarray(np.concatenate([np.pad(f, ((0, 4), (0, 0), (0, 0))) for f in frames])).save(path)


def setting(said: str) -> tuple[str, float]:
    """Name and value of a setting such as pillars=8."""
    name, value = said.split("=")
    return name, float(value) if "." in value else int(value)


def main() -> None:
    """Print the tables, or write the picture."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=256, quick=2)
    parser.add_argument("--levels", nargs="+", choices=LEVELS, default=LEVELS)
    parser.add_argument("--split", choices=("train", "eval"), default="eval")
    parser.add_argument("--change", nargs="*", type=setting, default=[], metavar="NAME=VALUE", help="of the level")
    parser.add_argument("--policies", nargs="+", choices=tuple(POLICIES), default=list(POLICIES))
    parser.add_argument("--learned", nargs="*", default=[], metavar="NAME=FILE")
    parser.add_argument("--strip", type=Path, metavar="FILE", help="write a picture instead")
    arguments = parser.parse_args()
    if arguments.quick:
        strip(scratch() / "strip.png", 1, first=0)
    if arguments.strip:
        return strip(arguments.strip, 4)
    makers = {name: POLICIES[name] for name in POLICIES if name in ("still", "oracle", "planner", *arguments.policies)}
    for pair in arguments.learned:
        from benchmarks.envs.active.ppo import policy

        name, path = pair.split("=")
        makers[name] = policy(path)
    for level in arguments.levels:
        table(makers, arguments.episodes, level, arguments.split, dict(arguments.change))
    return None


if __name__ == "__main__":
    main()
