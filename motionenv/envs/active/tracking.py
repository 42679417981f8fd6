"""motionenv/ActiveTracking-v0: several people, tracked with a camera that the agent steers."""

from dataclasses import dataclass

from motionenv._core.validation import checked_whole
from motionenv.envs.active.world import ActiveArguments, ActiveWorld
from motionenv.envs.base import TrackingEnv, taking
from motionenv.envs.vector import TrackingVectorEnv, VectorArguments


class ActiveTracking(TrackingEnv):
    """Tracking several people with one camera that the agent steers.

    ## Description
    People walk about a round plaza, 13 m in radius, among pillars. They start anywhere, turn at random, and turn away
    from obstacles. A camera on a mast in the middle, 4.5 m high, pans, tilts and zooms with inertia. It sees at most a
    sixth of the plaza and nobody behind a pillar; zooming in makes its observations more precise. The agent states
    where everyone is, and steers the camera. Looking at one person means not looking at another, turning takes time,
    and people who are out of view walk on. Unlike in the other environments, actions change what is seen. A command
    pays off only some seconds later, so use a high discount (γ = 0.97 or more per frame at 10 frames per second).

    Positions are in metres, x and y on the ground, z up, the mast at x = y = 0.

    ## Action Space
    `Box(-1, 1, (3 + 3 people,), float32)`. The first three entries are commands to the motors of pan (positive from x
    to y), tilt (positive upwards) and zoom, as fractions of their highest rates. Three entries follow for each person
    on the roster: the believed x and y, in units of 15 m, and an entry s that encodes the standard deviation of either
    coordinate as 0.05 m · 200^((s + 1) / 2). `action` converts commands and, for each person, x, y and standard
    deviation [m] to an action; `estimate` converts back. The belief is about the last observed frame; the commands take
    effect until the next one.

    ## Observation Space
    `Dict`:

    - "points", `Box(-2, 2, (people, 15, 2), float32)`: a row per detection, from left to right, without identities.
      Each has the joints in the order of `motionenv.types.MARKERS`, measured to the right and down from the centre of
      the image, in units of half its width. Joints that aren't seen, and rows without a detection, are 0.
    - "seen", `MultiBinary((people, 15))`: which joints are seen. A person is detected only with at least 8 of the 15
      joints in view.
    - "colours", `Box(-1, 1, (people, 2), float32)`: cosine and sine of the observed hue of the clothes.
    - "camera", `Box(-4, 4, (6,), float32)`: pan and tilt [rad], zoom from 0 (60° wide) to 1 (13° wide), and their rates
      per second.
    - "roster", `Box(-3, 3, (people, 3), float32)`: each person's height [m], and cosine and sine of the true hue.
    - "pillars", `Box(-15, 15, (pillars, 3), float32)`: x, y and radius [m].
    - "time_left", `Box(0, 1, (1,), float32)`: from 1 at the start to 0 at the end.

    ## Rewards
    Minus the energy score [m] of the beliefs, averaged over people, minus `effort` times the mean square of the
    commands. The energy score is proper and lies between 0 and 35 m.

    ## Starting State
    People, paths, pillars and the camera's pan are random. Nothing is known about where people are.

    ## Episode End
    Truncated after `horizon` estimates; never terminated.

    ## Arguments
    - `people=4`, `pillars=8`: numbers of people and pillars, at most 8 and 24.
    - `noise=0.05`: standard deviation of the points' coordinates, in units of half the image's width.
    - `colour_noise=0.2`: standard deviation of hues [rad] in the widest view; zooming in reduces it to a fifth.
    - `dropout=0.1`: probability that a visible person isn't detected in a frame.
    - `turn_seconds=6`: mean time [s] between a person's random turns.
    - `effort=0.05`: cost of full commands on all three axes.
    - `fps=10`, `horizon=200`: frame rate, and number of estimates in an episode.
    - `split="train"`: or "eval", which has other walkers.
    - `render_mode=None`: "rgb_array", the plaza from above, with beliefs as rings of two standard deviations, beside
      the camera's view; or "human", the same in a window.

    `truth()` returns "positions" (people, 2), "joints" (people, 15, 3) and "camera" of the last observed frame.
    `info["error"]` is the mean distance [m] between believed and true positions.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/ActiveTracking-v0", num_envs=64)` steps all episodes in compiled loops. It also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled").

    ## Version History
    - v0: initial version.
    """

    world: ActiveWorld

    @taking(ActiveArguments)
    def __init__(self, arguments: ActiveArguments) -> None:
        super().__init__(arguments.world(1), render_mode=arguments.render_mode)
        self.arguments = arguments


@dataclass(frozen=True, kw_only=True)
class ActiveVectorArguments(ActiveArguments, VectorArguments):
    """Arguments of `ActiveTrackingVector`."""


class ActiveTrackingVector(TrackingVectorEnv):
    """`num_envs` copies of `ActiveTracking`, stepped together."""

    @taking(ActiveVectorArguments)
    def __init__(self, arguments: ActiveVectorArguments) -> None:
        world = arguments.world(checked_whole(arguments.num_envs, "num_envs", 1))
        super().__init__(world, render_mode=arguments.render_mode, autoreset_mode=arguments.autoreset_mode)
        self.arguments = arguments
