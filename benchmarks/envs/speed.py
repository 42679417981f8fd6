"""Steps per second of the environments and of MuJoCo's Humanoid-v5 with pixels; profile of a step; memory.

    motionenv bench envs.speed [--mujoco PYTHON]

MuJoCo needs a newer PyOpenGL than pyrender allows, so it needs a separate Python:

    python3 -m venv .mujoco && .mujoco/bin/pip install 'gymnasium[mujoco]'
    motionenv bench envs.speed --mujoco .mujoco/bin/python

Environments come from `gymnasium.make` and `make_vec`. Rates include resets but not the sampling of actions, and are
the best of a few rounds for ours and peers, after the walkers of the process were synthesised.
"""

import multiprocessing
import os
import resource
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gymnasium
from gymnasium.utils import performance

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments, headline

WALKER, MARKERS, ARM = (f"motionenv/{name}Tracking-v1" for name in ("Walker", "Marker", "Arm"))
EVERYTHING = {"background": "clutter", "distractors": 2, "occluders": 1, "noise": 5.0, "brightness": 0.2}
MASKS = {"size": 128, "observation": "mask"}
PEERS = {
    "made": "default",
    "plain": "plain: no shadows, reflections, antialiasing",
    "async": "plain, two processes",
}


def single(name: str, **settings) -> tuple[gymnasium.Env, Callable[[], None]]:
    """An environment, and a function that steps it once."""
    env = gymnasium.make(name, **settings)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(16)]
    known(env, 1)

    def step() -> None:
        actions.append(actions.pop(0))
        if any(env.step(actions[0])[2:4]):
            env.reset()

    return env, step


def vector(name: str, n: int, **settings) -> tuple[gymnasium.vector.VectorEnv, Callable[[], None]]:
    """A native vector environment, and a function that steps it once."""
    envs = gymnasium.make_vec(name, num_envs=n, vectorization_mode="vector_entry_point", **settings)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(4)]
    known(envs, n)

    def step() -> None:
        actions.append(actions.pop(0))
        envs.step(actions[0])

    return envs, step


def known(env: gymnasium.Env | gymnasium.vector.VectorEnv, n: int) -> float:
    """Begin 256 episodes, which synthesises all walkers and compiles kernels; return the seconds taken."""
    start = time.perf_counter()
    env.reset(seed=0)
    for _ in range(256 // n):
        env.reset()
    return time.perf_counter() - start


HEADLINE = "WalkerTracking, 64 at a time, 64² rgb"  # of README
#: Timed environments by name: the function that makes them, and the number of environments per step.
TIMED = {
    "WalkerTracking, 64² rgb": (partial(single, WALKER), 1),
    HEADLINE: (partial(vector, WALKER, 64), 64),
    "WalkerTracking, 64 at a time, 64² rgb, everything on": (partial(vector, WALKER, 64, **EVERYTHING), 64),
    "WalkerTracking, 64 at a time, 128² mask": (partial(vector, WALKER, 64, **MASKS), 64),
    "ArmTracking, 64² rgb": (partial(single, ARM), 1),
    "ArmTracking, 64 at a time, 64² rgb": (partial(vector, ARM, 64), 64),
    "MarkerTracking": (partial(single, MARKERS), 1),
    "MarkerTracking, 1,024 at a time": (partial(vector, MARKERS, 1024), 1024),
}


def per_second(step: Callable[[], None], seconds: float, rounds: int = 3) -> float:
    """Calls of `step` per second, the best of a few rounds."""
    step()
    best = 0.0
    for _ in range(rounds):
        n, start = 0, time.perf_counter()
        while time.perf_counter() - start < seconds:
            step()
            n += 1
        best = max(best, n / (time.perf_counter() - start))
    return best


def first_episodes() -> None:
    """Print the time that a new process takes to make an environment and to start its first episodes."""
    start = time.perf_counter()
    env = gymnasium.make(WALKER)
    made = time.perf_counter() - start
    first, then = known(env, 1), known(env, 1)
    print(
        f"WalkerTracking is constructed in {made:.2f} s; 256 episodes start in {first:.2f} s, "
        f"the next in {then:.2f} s.\n"
    )


def peer(python: str, size: int, how: str, seconds: float) -> float | None:
    """Steps per second of Humanoid-v5 with pixels; None, with a line, if it can't run."""
    script = Path(__file__).with_name("humanoid.py")
    done = subprocess.run(
        [python, script, str(size), how, str(seconds)],
        capture_output=True,
        text=True,
        env={**os.environ, "MUJOCO_GL": "egl"},
        check=False,
    )
    if done.returncode:
        print(f"skipped: Humanoid-v5 at {size}² ({how}): {done.stderr.strip().splitlines()[-1]}")
        return None
    return float(done.stdout.splitlines()[-1])


def ratio(ours: float, theirs: float | None) -> str:
    """Ratio of two rates; a dash without a peer."""
    return f"**{ours / theirs:,.0f}×**" if theirs else "–"


def speed(python: str, seconds: float) -> None:
    """Print steps per second and ratios."""
    peers = {(size, how): peer(python, size, how, seconds) for size in (64, 128) for how in PEERS}
    print("| steps per second, best of 3 | | × Humanoid-v5, default | × plain | × two plain |\n|-|-|-|-|-|")
    for (size, how), rate in peers.items():
        cells = " | ".join("1" if how == other else "" for other in PEERS)
        print(f"| Humanoid-v5, {size}² pixels, {PEERS[how]} | {f'{rate:,.0f}' if rate else '–'} | {cells} |")
    for name, (make, n) in TIMED.items():
        env, step = make()
        rate = n * per_second(step, seconds)
        env.close()
        size = 128 if "128" in name else 64
        cells = [ratio(rate, peers[size, how]) if "Marker" not in name else "" for how in PEERS]
        print(f"| {name} | {rate:,.0f} | {' | '.join(cells)} |", flush=True)
        if name == HEADLINE:
            plain = peers[64, "plain"]
            headline(frames=rate, **({"ratio": rate / plain} if plain else {}))


class Clock:
    """Measures the cumulative time spent in methods of objects."""

    def __init__(self):
        self.spent: Counter[str] = Counter()

    def watch(self, thing: object, method: str, name: str) -> None:
        """Time each call of `thing.method` under `name`."""
        call = getattr(thing, method)

        def timed(*args, **kwargs):
            start = time.perf_counter()
            try:
                return call(*args, **kwargs)
            finally:
                self.spent[name] += time.perf_counter() - start

        setattr(thing, method, timed)


def step_shares(make: Callable, seconds: float) -> dict[str, float]:
    """Shares of the time of a step of an environment with image observations."""
    env, step = make()
    step()
    clock, world = Clock(), env.unwrapped.world
    for method in ("begin", "observe", "judge", "advance"):
        clock.watch(world, method, method)
    clock.watch(world.stage._crowd, "render", "raycast")
    clock.watch(world.stage._scenery, "compose", "scenery")
    start = time.perf_counter()
    while time.perf_counter() - start < seconds:
        step()
    total, spent = time.perf_counter() - start, clock.spent
    env.close()
    shares = {
        "raycast (MultiBodyRaycaster.render)": spent["raycast"],
        "background, occluders, noise (Augmenter.compose)": spent["scenery"],
        "rest of the observation": spent["observe"] - spent["raycast"] - spent["scenery"],
        "scoring the estimate": spent["judge"],
        "next frame": spent["advance"],
        "new episodes": spent["begin"],
        "Gymnasium's wrappers, checks, infos": total - sum(spent[m] for m in ("begin", "observe", "judge", "advance")),
    }
    drawing = spent["raycast"] + spent["scenery"]
    shares |= {"everything outside the raycaster": total - spent["raycast"]}
    shares |= {"everything outside rendering": total - drawing}
    return {name: share / total for name, share in shares.items()}


def profile(seconds: float) -> None:
    """Print the profile of a step."""
    names = [name for name in TIMED if "Marker" not in name]
    shares = [step_shares(TIMED[name][0], seconds) for name in names]
    print(f"\n| share of a step | {' | '.join(names)} |\n|-|{'-|' * len(names)}")
    for part in shares[0]:
        print(f"| {part} | {' | '.join(f'{100 * s[part]:.1f} %' for s in shares)} |")


def gymnasiums(seconds: float) -> None:
    """Print the results of Gymnasium's own benchmarks, which sample an action before each step."""
    print("\n| gymnasium.utils.performance | benchmark_step | benchmark_init | benchmark_render |\n|-|-|-|-|")
    for name in (WALKER, ARM, MARKERS):
        make = partial(gymnasium.make, name, render_mode="rgb_array")
        env = make()
        rates = [performance.benchmark_step(env, seconds), performance.benchmark_init(make, seconds)]
        rates.append(performance.benchmark_render(env, seconds))
        env.close()
        print(f"| {name} | {' | '.join(f'{rate:,.0f}/s' for rate in rates)} |", flush=True)


def resident() -> float:
    """Current resident memory [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def over_time(make: Callable, steps: int) -> list[float]:
    """Resident memory [MB] after 1, 10, 50 and 100 % of `steps`."""
    _, step = make()
    found, marks = [], {steps // 100, steps // 10, steps // 2, steps}
    for i in range(1, steps + 1):
        step()
        if i in marks:
            found.append(resident())
    return found


def memory(share: float) -> None:
    """Print resident memory over many steps, each environment in a separate process."""
    print("\n| resident memory, MB | steps | after 1 % | 10 % | 50 % | 100 % |\n|-|-|-|-|-|-|")
    rows = (
        ("MarkerTracking, 4 at a time", partial(vector, MARKERS, 4), 1_000_000),
        ("WalkerTracking, 4 at a time, 36² rgb", partial(vector, WALKER, 4, size=36), 50_000),
        ("the same, everything on", partial(vector, WALKER, 4, size=36, **EVERYTHING), 20_000),
    )
    for name, make, steps in rows:
        steps = int(steps * share)
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            found = pool.apply(over_time, (make, steps))
        print(f"| {name} | {steps:,} | {' | '.join(f'{mb:.1f}' for mb in found)} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__)
    parser.add_argument("--mujoco", default=sys.executable, help="a Python that has gymnasium[mujoco]")
    asked = parser.parse_args()
    seconds = 0.02 if asked.quick else 1.5
    first_episodes()
    speed(asked.mujoco, seconds)
    profile(2 * seconds)
    gymnasiums(0.05 if asked.quick else 2)
    memory(0.005 if asked.quick else 1.0)


if __name__ == "__main__":
    main()
