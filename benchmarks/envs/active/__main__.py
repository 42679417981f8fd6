"""Policies in ActiveTracking: rewards on split "eval", and how much of them is planning, with 95 % intervals.

    motionenv bench envs.active [--episodes 208] [--difficulty Medium] [--learned ppo=ppo.pt]

All policies share the estimator (`beliefs`), episodes and seeds, so that differences between them are paired by episode
and come from looking. Their settings were chosen on split "train" (seed 0); networks come from `ppo`. `--strip FILE`
writes frames of the planner instead.
"""

from pathlib import Path

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments, scratch
from benchmarks.envs.active.policies import POLICIES
from motionenv.envs.agents import evaluate

LEVELS = "Easy", "Medium", "Hard"
ENVS = 52  # at once


def interval(values: np.ndarray) -> str:
    """Mean and 95 % interval of the mean."""
    half = 1.96 * values.std(ddof=1) / np.sqrt(len(values))
    return f"{values.mean():.3f} ({values.mean() - half:.3f} to {values.mean() + half:.3f})"


def table(makers: dict, episodes: int, difficulty: str, seed: int = 1) -> None:
    """Print a row for each policy: mean reward per estimate, error, and the difference from the greedy policy."""
    print(f"\n{difficulty}, {episodes} episodes of split eval\n")
    print("| policy | reward per estimate | error [m] | reward relative to greedy |\n|-|-|-|-|")
    greedy = None
    for name, make in makers.items():
        rewards, error = played(make, episodes, difficulty, seed)
        better = "–" if greedy is None else interval(rewards - greedy)
        greedy = rewards if name == "greedy" else greedy
        print(f"| {name} | {interval(rewards)} | {error:.2f} | {better} |", flush=True)


def played(make, episodes: int, difficulty: str, seed: int = 1) -> tuple[np.ndarray, float]:
    """Mean rewards (episodes,) of a policy, and its mean error [m]."""
    env = gymnasium.make_vec(f"motionenv/ActiveTracking-{difficulty}-v0", num_envs=min(ENVS, episodes), split="eval")
    scores = evaluate(env, make(env, seed=0), episodes, seed=seed)
    return scores.returns / scores.lengths, float(scores.errors.mean())


def strip(path: Path, rows: int, first: int = 60, seed: int = 3) -> None:
    """Write frames of the planner, two seconds apart, each row the square from above and the camera's view."""
    from PIL import Image

    env = gymnasium.make("motionenv/ActiveTracking-Medium-v1", render_mode="rgb_array", split="eval")
    planner = POLICIES["planner"](env)
    observation, _ = env.reset(seed=seed)
    planner.reset(observation)
    frames = []
    for time in range(first + 20 * rows):
        observation, *_ = env.step(planner.act(observation))
        if time >= first and time % 20 == 0:
            frames.append(env.render())
    Image.fromarray(np.concatenate([np.pad(f, ((0, 4), (0, 0), (0, 0))) for f in frames])).save(path)


def main() -> None:
    """Print the table, or write the picture."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=208, quick=2)
    parser.add_argument("--difficulty", choices=LEVELS, default="Medium")
    parser.add_argument("--policies", nargs="+", choices=tuple(POLICIES), default=list(POLICIES))
    parser.add_argument("--learned", nargs="*", default=[], metavar="NAME=FILE")
    parser.add_argument("--strip", type=Path, metavar="FILE", help="write a picture instead")
    arguments = parser.parse_args()
    if arguments.quick:
        strip(scratch() / "strip.png", 1, first=0)
    if arguments.strip:
        return strip(arguments.strip, 4)
    makers = {name: POLICIES[name] for name in ("greedy", *arguments.policies)}
    for pair in arguments.learned:
        from benchmarks.envs.active.ppo import policy

        name, path = pair.split("=")
        makers[name] = policy(path)
    return table(makers, arguments.episodes, arguments.difficulty)


if __name__ == "__main__":
    main()
