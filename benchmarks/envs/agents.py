"""Errors of the reference agents in the environments: per joint, mean over episodes with a 95 % interval.

motionenv bench envs.agents [--episodes 64]
"""

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from motionenv.envs.agents import Kalman, MeanPose, Oracle, evaluate

AGENTS = (MeanPose, Kalman, Oracle)
CASES = {
    "MarkerTracking": {},
    "MarkerTracking, seen from the side": {"view": 0.0},
    "WalkerTracking": {},
    "WalkerTracking, mask": {"observation": "mask"},
    "WalkerTracking, mask, joints": {"observation": "mask", "estimate": "joints"},
    "WalkerTracking, mask, belief": {"observation": "mask", "estimate": "belief"},
    "WalkerTracking, mask, random view": {"observation": "mask", "camera": "random"},
    "WalkerTracking, mask, 2 occluders": {"observation": "mask", "occluders": 2},
    "WalkerTracking, following": {"camera": "follow"},
    "WalkerTracking, clutter and noise": {"background": "clutter", "noise": 4.0},
    "ArmTracking": {},
}


def cell(values: np.ndarray) -> str:
    """Mean ± half the 95 % interval, in millimetres."""
    return f"{1000 * values.mean():.0f} ± {1960 * values.std(ddof=1) / np.sqrt(len(values)):.0f}"


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=64, quick=2)
    asked = parser.parse_args()
    print("| environment |", *(f"{agent.__name__} [mm] |" for agent in AGENTS), "\n|-|-|-|-|")
    for name, arguments in CASES.items():
        cells = []
        for agent in AGENTS:
            if name.startswith("Arm") and agent is Kalman:
                cells.append("–")
                continue
            task, n = f"motionenv/{name.split(',')[0]}-v1", min(16, asked.episodes)
            env = gymnasium.make_vec(task, num_envs=n, split="eval", **arguments)
            cells.append(cell(evaluate(env, agent(env), asked.episodes, seed=0).errors))
            env.close()
        print(f"| {name} |", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    main()
