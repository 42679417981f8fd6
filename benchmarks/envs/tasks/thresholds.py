"""Reward thresholds of the named tasks: the return at a normalised return of 0.9 on split "train".

    motionenv bench envs.tasks.thresholds [--episodes 256]

Between the mean pose's mean return and the oracle's, over episodes of the fully observable twins, which draw nothing.
`motionenv/envs/tasks.toml` holds what this prints, rounded to two digits.
"""

import gymnasium

from benchmarks import Arguments
from motionenv.envs.agents import MeanPose, Oracle, evaluate
from motionenv.envs.tasks import TASKS, settings

SOLVED = 0.9


def threshold(task: str, episodes: int) -> float:
    """The return at which a `task` counts as solved."""
    bounds = []
    for make in (MeanPose, Oracle):
        env = gymnasium.make_vec(
            str(TASKS[task].full), num_envs=min(64, episodes), vectorization_mode="vector_entry_point",
            **settings(task, "train"),
        )  # fmt: skip
        bounds.append(evaluate(env, make(env), episodes, seed=0).returns.mean())
        env.close()
    worst, best = bounds
    return float(worst + SOLVED * (best - worst))


def main() -> None:
    """Print them."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=256, quick=2)
    asked = parser.parse_args()
    for task, made in TASKS.items():
        if made.full and made.full != task:
            print(f"{task}: {threshold(task, asked.episodes):.2g}", flush=True)


if __name__ == "__main__":
    main()
