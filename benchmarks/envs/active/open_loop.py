"""Search for the best open-loop policy of ActiveTracking, on split "train": what `Sweep` does.

    motionenv bench envs.active.open_loop [--candidates 60] [--rounds 3] [--best 4]

Candidates look around in a `Pattern`: at a constant rate, or in steps with a stop after each, all the way around or
back and forth, with one tilt or two that alternate by step or by round, with any zoom. The first are two by hand and
others at random; each round then draws more about the best ones (the cross-entropy method). A candidate's score is its
mean reward over all levels; the best ones are scored again on more episodes.
"""

from typing import NamedTuple

import gymnasium
import numpy as np

import motionenv.envs  # noqa: F401 (registers the environments)
from benchmarks import Arguments
from benchmarks.envs.active import LEVELS
from motionenv.envs.active import Sweep
from motionenv.envs.agents import evaluate

LOW = np.array([np.log(0.03), np.log(0.1), -0.7, -0.7, -0.5, -1.0, 2.0, -0.6])  # of the parameters of `pattern`
HIGH = np.array([np.log(1.5), np.log(1.2), -0.2, -0.2, 0.5, 0.6, 20.0, 0.6])
#: Two candidates by hand: steps of most of a view with a stop after each, and a constant rate.
BY_HAND = np.array([[np.log(0.6), np.log(0.5), -0.33, -0.5, 0.5, -1.0, 8.0, 0.0]] * 2)
BY_HAND[1, :2] = np.log(0.04), np.log(0.1)


class Pattern(NamedTuple):
    """Where to look when.

    Attributes:
        step, seconds: the view turns by so many radians every so many seconds.
        tilts: two tilts [rad], in turn.
        rounds: whether the tilt changes with each turn around, instead of each step.
        back: number of steps after which the direction is reversed; 0 is never.
        zoom: from 0 to 1.
    """

    step: float
    seconds: float
    tilts: tuple[float, float]
    rounds: bool
    back: int
    zoom: float


class Patterned(Sweep):
    """Looks around in a `pattern`."""

    def __init__(self, env, pattern: Pattern):
        super().__init__(env)
        self.pattern = pattern

    def aims(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """As `Sweep.aims`."""
        p = self.pattern
        count = np.floor(self._age / (self.scene.fps * p.seconds) + 1e-9)
        steps = np.abs((count + p.back) % (2 * p.back) - p.back) if p.back else count
        turns = np.floor(count * abs(p.step) / (2 * np.pi)) if p.rounds else count
        tilts = np.array(p.tilts)[(turns % 2).astype(int)]
        return np.stack([self._first + steps * p.step, tilts, np.full(len(tilts), p.zoom)], axis=-1)


def pattern(x: np.ndarray) -> Pattern:
    """From parameters (8,): log step, log seconds, two tilts, whether rounds, whether and when back, zoom."""
    back = int(x[6]) if x[5] > 0 else 0
    tilts = float(x[2]), float(x[3])
    return Pattern(float(np.exp(x[0])), float(np.exp(x[1])), tilts, bool(x[4] > 0), back, float(max(x[7], 0)))


def score(x: np.ndarray, episodes: int, seed: int) -> list[float]:
    """Mean reward per estimate on each level."""
    rewards = []
    for level in LEVELS:
        env = gymnasium.make_vec(f"motionenv/ActiveTracking-{level}-v1", num_envs=episodes, split="train")
        scores = evaluate(env, Patterned(env, pattern(x)), episodes, seed=seed)
        rewards.append(float((scores.returns / scores.lengths).mean()))
    return rewards


def search(candidates: int, rounds: int, episodes: int, rng: np.random.Generator) -> np.ndarray:
    """Parameters (n, 8) of all that was tried, from the best to the worst."""
    tried = np.concatenate([BY_HAND, rng.uniform(LOW, HIGH, (candidates - len(BY_HAND), len(LOW)))])
    values = np.array([np.mean(score(x, episodes, seed=0)) for x in tried])
    for _ in range(rounds):
        elite = tried[np.argsort(-values)[: max(candidates // 8, 2)]]
        about = elite[rng.integers(len(elite), size=candidates // 3)]
        more = np.clip(about + 0.7 * elite.std(axis=0) * rng.standard_normal(about.shape), LOW, HIGH)
        tried = np.concatenate([tried, more])
        values = np.concatenate([values, [np.mean(score(x, episodes, seed=0)) for x in more]])
        print(f"best of {len(tried)}: {values.max():.3f}, {pattern(tried[values.argmax()])}", flush=True)
    return tried[np.argsort(-values)]


def main() -> None:
    """Search, and print the best patterns."""
    parser = Arguments(__doc__)
    parser.add_argument("--candidates", type=int, default=60, quick=3)
    parser.add_argument("--rounds", type=int, default=3, quick=1)
    parser.add_argument("--episodes", type=int, default=8, quick=1, help="of each level")
    parser.add_argument("--best", type=int, default=4, quick=1, help="scored again, on four times as many episodes")
    asked = parser.parse_args()
    print(f"| {' | '.join(LEVELS)} | pattern |\n|{'-|' * (len(LEVELS) + 1)}")
    for x in search(asked.candidates, asked.rounds, asked.episodes, np.random.default_rng(0))[: asked.best]:
        rewards = score(x, 4 * asked.episodes, seed=1000)
        print(f"| {' | '.join(f'{reward:.3f}' for reward in rewards)} | {pattern(x)} |", flush=True)


if __name__ == "__main__":
    main()
