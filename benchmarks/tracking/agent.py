"""Errors of `TrackingAgent` in WalkerTracking, N = 1,000, without being given anything but camera and pictures.

    motionenv bench tracking.agent [--episodes 60] [--split eval] [--processes 2] [--only NAME]

The agent is as the library makes it: it doesn't know the body, nor the first pose where "automatic" is said. Depth is
the distance between the estimated and the true pelvis along the camera's axis; frames/s are CPU time of one thread and
include the searches for the start. "Kept" are episodes whose error over the last ten estimates is below 300 mm. Beside
it stands Kalman, a silhouette's centre and height with the mean pose. Settings were chosen on split "train"
with seeds from 0; these are split "eval" and seeds from 5,000. Intervals are 95 %, by episodes.
"""

import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from benchmarks.tracking.tables import cell, mean, share
from motionenv.envs.agents import Kalman, TrackingAgent, truth_start
from motionenv.tracking import Start

N, FIRST_SEED, KEPT = 1000, 5000, 0.3


def too_near(env, slot: int) -> Start:
    """The true first pose, 15 % closer to the camera: it fits the pictures by half, so nobody is lost."""
    truth = env.truth()
    pose, centre = truth["pose"].copy(), truth["camera"].centre[:2]
    pose[:2] = centre + 0.85 * (pose[:2] - centre)
    return Start.at(pose)


CASES = {
    "default, automatic start": ({}, None),
    "mask, automatic start": ({"observation": "mask"}, None),
    "anywhere, automatic start": ({"start": "anywhere"}, None),
    "default, given start": ({}, truth_start),
    "mask, given start": ({"observation": "mask"}, truth_start),
    "mask, given start 15 % too near": ({"observation": "mask"}, too_near),
    "2 occluders and a passer-by, given start": ({"occluders": 2, "distractors": 1}, truth_start),
}


def play(asked: tuple[str, str, int, int, bool, int]) -> tuple[np.ndarray, np.ndarray, float]:
    """Errors and depth errors (episodes, frames) [m] of a part of the episodes, and the agent's seconds per frame."""
    name, split, first, count, blob, n = asked
    arguments, start = CASES[name]
    env = gymnasium.make("motionenv/WalkerTracking-v1", split=split, actions="metric", **arguments)
    agent = Kalman(env) if blob else TrackingAgent(env, n=n, start=start, seed=first, threads=1)
    errors, depths, seconds = [], [], 0.0
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
            depths[-1].append(truth["camera"].R[2] @ (action[:3] - truth["pose"][:3]))
            observation, _, _, over, info = env.step(action)
            errors[-1].append(info["error"])
    return np.array(errors), np.array(depths), seconds / np.size(errors)


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--episodes", type=int, default=60, quick=1)
    parser.add_argument("--split", choices=("train", "eval"), default="eval")
    parser.add_argument("--processes", type=int, default=2, quick=1)
    parser.add_argument("--only", choices=CASES, action="append")
    asked = parser.parse_args()
    print("| task | agent | error [mm] | median [mm] | last 30 frames [mm] | depth [mm] | kept | frames/s |")
    print("|-|-|-|-|-|-|-|-|")
    seeds = np.array_split(FIRST_SEED + np.arange(asked.episodes), asked.processes)
    with ProcessPoolExecutor(asked.processes, multiprocessing.get_context("spawn")) as pool:
        for name in asked.only or CASES:
            for blob in (True, False):
                parts = [(name, asked.split, int(some[0]), len(some), blob, 20 if asked.quick else N) for some in seeds]
                played = list(pool.map(play, parts))
                errors, depths = (np.concatenate([part[i] for part in played]) for i in (0, 1))
                each = 1e3 * errors.mean(axis=1)
                cells = [cell(mean(each), "{:.0f}"), f"{np.median(each):.0f}"]
                cells += [cell(mean(1e3 * errors[:, -30:].mean(axis=1)), "{:.0f}")]
                cells += [cell(mean(1e3 * np.abs(depths).mean(axis=1)), "{:.0f}")]
                cells += [cell(share(errors[:, -10:].mean(axis=1) < KEPT), "{:.0%}")]
                rate = 1 / np.mean([part[2] for part in played])
                agent = "Kalman" if blob else "TrackingAgent"
                print(f"| {name} | {agent} |", " | ".join(cells), f"| {rate:.0f} |", flush=True)


if __name__ == "__main__":
    main()
