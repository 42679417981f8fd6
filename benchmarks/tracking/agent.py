"""Errors of `TrackingAgent` in WalkerTracking, N = 1,000, and what each of them comes from.

    motionenv bench tracking.agent [--episodes 60] [--split eval] [--first 5000] [--only NAME]

The agent is as the library makes it: it is given the camera and the pictures, but neither the first pose nor the body,
unless a row says so. Other rows change the task, to tell what its difficulties cost: larger pictures, exact masks
instead of colours, nobody who passes by, nothing that hides anybody. Split "ood" has the people and the camera of the
named tasks' "ood". Depth is the distance between the estimate and the truth along the camera's axis; frames/s are CPU
time of one thread and include the searches for the start. "Kept" are episodes whose error over the last ten estimates
is below 300 mm. Beside it stand the mean pose, and Kalman, a silhouette's centre and height with the mean pose.
Settings were chosen on split "train" with seeds from 0 and from 1,000; by default, these are split "eval" and seeds
from 5,000. Intervals are 95 %, by episodes.
"""

import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from benchmarks.tracking.tables import cell, mean, share
from motionenv.body.limbs import resized
from motionenv.envs.agents import Kalman, MeanPose, TrackingAgent, truth_start
from motionenv.envs.agents.particle_filter import adults_prior
from motionenv.envs.tasks import SPLITS, TASKS
from motionenv.tracking import FPCAPrior, Start

N, FIRST_SEED, KEPT = 1000, 5000, 0.3
PARTS = {"0–3": slice(4), "4–11": slice(4, 12), "12–35": slice(12, 36), "36 on": slice(36, None)}  # frames


def too_near(env, slot: int) -> Start:
    """The true first pose, 15 % closer to the camera: it fits the pictures by half, so nobody is lost."""
    truth = env.truth()
    pose, centre = truth["pose"].copy(), truth["camera"].centre[:2]
    pose[:2] = centre + 0.85 * (pose[:2] - centre)
    return Start.at(pose)


def known_body(env, slot: int) -> FPCAPrior:
    """Walkers with the true body."""
    return FPCAPrior(skeleton=env.truth()["skeleton"], fps=env.world.fps)


def known_height(env, slot: int) -> FPCAPrior:
    """Walkers of the true height, with mean proportions and build."""
    usual = adults_prior(env.world.fps).skeleton
    return FPCAPrior(skeleton=resized(usual, env.truth()["skeleton"].height), fps=env.world.fps)


class Case(NamedTuple):
    """A row: arguments of the environment and, where they are given, the first pose and the body."""

    settings: dict[str, Any]
    start: Callable | None = None
    prior: Callable | None = None


MEDIUM, HARD = (TASKS[f"motionenv/WalkerTracking-{level}"].settings for level in ("Medium-v1", "Hard-v2"))
UNSEEN = TASKS["motionenv/WalkerTracking-Medium-v1"].ood  # people and camera of every task's "ood"
CASES = {
    "default, automatic start": Case({}),
    "… height given": Case({}, None, known_height),
    "… body given": Case({}, None, known_body),
    "… pictures of 128²": Case({"size": 128}),
    "mask, automatic start": Case({"observation": "mask"}),
    "anywhere, automatic start": Case({"start": "anywhere"}),
    "default, given start": Case({}, truth_start),
    "mask, given start": Case({"observation": "mask"}, truth_start),
    "mask, given start 15 % too near": Case({"observation": "mask"}, too_near),
    "2 occluders and a passer-by": Case({"occluders": 2, "distractors": 1}),
    "2 occluders and a passer-by, given start": Case({"occluders": 2, "distractors": 1}, truth_start),
    "2 occluders, given start": Case({"occluders": 2}, truth_start),
    "a passer-by, given start": Case({"distractors": 1}, truth_start),
    "2 occluders and a passer-by, given start and body": Case(
        {"occluders": 2, "distractors": 1}, truth_start, known_body
    ),
    "2 occluders and a passer-by, given start, mask": Case(
        {"occluders": 2, "distractors": 1, "observation": "mask"}, truth_start
    ),
    "Medium": Case(MEDIUM),
    "Medium, nothing hides": Case({**MEDIUM, "occluders": 0}),
    "Medium, given start": Case(MEDIUM, truth_start),
    "Medium, height given": Case(MEDIUM, None, known_height),
    "Medium, body given": Case(MEDIUM, None, known_body),
    "Medium, pictures of 128²": Case({**MEDIUM, "size": 128}),
    "Hard": Case(HARD),
    "Hard, exact masks": Case({**HARD, "observation": "mask"}),
    "Hard, nobody passes": Case({**HARD, "distractors": 0}),
    "Hard, nothing hides": Case({**HARD, "occluders": 0}),
    "Hard, neither": Case({**HARD, "distractors": 0, "occluders": 0}),
}


def play(asked: tuple[str, str, int, int, str, int, int]) -> tuple[np.ndarray, np.ndarray, float]:
    """Errors and depth errors (episodes, frames) [m] of a part of the episodes, and the agent's seconds per frame."""
    name, split, first, count, player, n, frames = asked
    case, chosen = CASES[name], {"split": "eval", **UNSEEN} if split == "ood" else {"split": split}
    settings = {**case.settings, **chosen, "horizon": frames - 1, "actions": "metric"}
    env = gymnasium.make("motionenv/WalkerTracking-v1", **settings)
    if player == "TrackingAgent":
        agent = TrackingAgent(env, case.prior, n, start=case.start, seed=first, threads=1)
    else:
        agent = (MeanPose if player == "MeanPose" else Kalman)(env)
    errors: list[list[float]] = []
    depths: list[list[float]] = []
    seconds = 0.0
    for seed in range(first, first + count):
        observation, _ = env.reset(seed=seed)
        agent.reset(observation)
        over = False
        errors.append([])
        depths.append([])
        while not over:
            began = time.process_time()
            action = agent.act(observation)
            seconds += time.process_time() - began
            truth = env.unwrapped.truth()
            off = action[:3] - truth["pose"][:3] if action.ndim == 1 else (action - truth["joints"]).mean(axis=0)
            depths[-1].append(truth["camera"].R[2] @ off)
            observation, _, _, over, info = env.step(action)
            errors[-1].append(info["error"])
    return np.array(errors), np.array(depths), seconds / np.size(errors)


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=60, quick=1)
    parser.add_argument("--split", choices=SPLITS, default="eval")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first episode")
    parser.add_argument("--frames", type=int, default=91, quick=40)
    parser.add_argument("--processes", type=int, default=2, quick=1)
    parser.add_argument("--only", choices=CASES, action="append")
    asked = parser.parse_args()
    print(f"| task | agent | error [mm] | median | frames {' | '.join(PARTS)} | depth [mm] | kept | frames/s |")
    print("|-|-|-|-|" + "-|" * len(PARTS) + "-|-|-|")
    seeds = np.array_split(asked.first + np.arange(asked.episodes), asked.processes)
    played_before: list[dict[str, Any]] = []
    with ProcessPoolExecutor(asked.processes, multiprocessing.get_context("spawn")) as pool:
        for name in asked.only or CASES:
            baselines = [] if CASES[name].settings in played_before else ["MeanPose", "Kalman"]
            played_before.append(CASES[name].settings)
            for agent in (*baselines, "TrackingAgent"):
                n = 20 if asked.quick else N
                parts = [(name, asked.split, int(some[0]), len(some), agent, n, asked.frames) for some in seeds]
                played = list(pool.map(play, parts))
                errors, depths = (1e3 * np.concatenate([part[i] for part in played]) for i in (0, 1))
                each = errors.mean(axis=1)
                cells = [cell(mean(each), "{:.0f}"), f"{np.median(each):.0f}"]
                cells += [f"{errors[:, part].mean():.0f}" for part in PARTS.values()]
                cells += [cell(mean(np.abs(depths).mean(axis=1)), "{:.0f}")]
                cells += [cell(share(errors[:, -10:].mean(axis=1) < 1e3 * KEPT), "{:.0%}")]
                rate = 1 / np.mean([part[2] for part in played])
                print(f"| {name} | {agent} |", " | ".join(cells), f"| {rate:.0f} |", flush=True)


if __name__ == "__main__":
    main()
