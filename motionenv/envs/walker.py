"""motionenv/WalkerTracking-v0: the pose of a walking person in pictures."""

from typing import Any

from motionenv.envs.pictures import PictureTracking, PictureTrackingVector, picture_world
from motionenv.envs.views import WalkingView
from motionenv.envs.world import PictureWorld


def walker_world(n: int, *, motion: str = "walk/fpca", **arguments: Any) -> PictureWorld:
    """`n` walkers, each before a camera of his own.

    Args:
        n: how many.
        motion: whence motion comes.
        arguments: see `picture_world`.

    Raises:
        MotionError: an impossible argument; names it.
    """
    return picture_world(
        n, lambda source, camera: (source, WalkingView(camera, source.fps)), motion=motion, scored={}, **arguments
    )


class WalkerTracking(PictureTracking):
    """Tracking the pose of a walking person in pictures.

    ## Description
    Somebody walks; each step shows the agent the next picture, and the agent says in which pose the person is. Body,
    clothes, gait and, if asked for, view, surroundings, noise and light differ from episode to episode.

    Positions are in metres: x is the direction of walking, y left of it, z up, the ground at z = 0. With a fixed camera
    the origin is in the middle of the walker's path, which is in the middle of the picture; the camera stands 1.1 m
    high, level, as near as shows the whole path, 3.5 m at least. A camera that follows travels beside the walker, and
    the origin with it: it is the point of the ground that the camera is aimed at. So where on earth the walker is,
    which nobody could see, isn't asked.

    ## Action Space
    An estimate for the frame that was observed last, in the form of `estimate`:

    - "pose": `Box((25,), float32)`, the pose vector of `motionenv.types.POSE`: positions within ±100 m, angles within
      ±4π rad. It is put on the true body, so that the size of the body isn't asked.
    - "joints": `Box(-100, 100, (15, 3), float32)`, positions [m] in the order of `motionenv.types.MARKERS`.
    - "belief": `Box((n_belief, 26), float32)`, poses, each followed by its log weight within ±100, up to a constant.

    ## Observation Space
    In the form of `observation`: "rgb" `Box(0, 255, (size, size, 3), uint8)`; "mask" `Box(0, 255, (size, size, 1),
    uint8)`, 255 where the body is seen; "depth" `Box(0, 20, (size, size, 1), float32)` [m] along the camera's axis, 20
    where nothing is nearer. A sequence of these gives a `Dict` of them.

    ## Rewards
    Minus the mean distance [m] between the estimated and true positions of the 15 joints; for a belief minus its energy
    score over all joints (`motionenv.metrics.energy_score`), a proper score, divided by √15, which makes it as large as
    a distance per joint. `info["error"]` is the mean distance; for a belief that of its mean.

    ## Starting State
    Walker, time in the walk, body height, colours, view and surroundings are drawn at random.

    ## Episode End
    Truncated after `horizon` estimates. Terminated, if `lost_after` is given, when that many metres of error have been
    exceeded ten times on end; then `info["lost"]` is true.

    ## Arguments
    - `motion="walk/fpca"`: whence motion comes: a model ("walk/fpca", "walk/eigenwalkers", "mixed/tree", or the file of
      one), a file of motion, or a folder of capture files (.amc, .bvh, .c3d, .trc, .npz). `file_fps` and `unit` are for
      files that don't say.
    - `motion_seed=None`: with a number, every episode shows the motion of `motionenv.synthesize(motion,
      (horizon + 1) / fps, fps, seed=motion_seed)` from its first frame on, in both splits: the walk that the service,
      the page and `motionenv synth` give for that seed. `speed` and `height` are then one number, given twice.
    - `split="train"`: or "eval": other walkers; of a folder other people, about one in four, by a hash of their label.
      A single file is one person, the same in both.
    - `size=64`: side of the pictures, 36 to 256 pixels.
    - `observation="rgb"`: "rgb", "mask", "depth", or several of them.
    - `camera="side"`: "side", "front", a view angle in degrees, "random" (any view angle; observations don't say which,
      the camera of `observation_model` does), or "follow" (travels along, from the side). A camera that stands still
      shows the whole way, so with a `horizon` of more than some seconds the walker gets small, and beyond 20 m "depth"
      doesn't show anybody: take "follow" then.
    - `background="plain"`: or "clutter"; `distractors=0` other people and things that pass by; `occluders=0` things in
      the way; `noise=0` standard deviation in grey levels of 255; `brightness=0` share by which the light changes.
      Noise and light are those of "rgb"; "mask" and "depth" are exact.
    - `fps=30`, `horizon=90`: frames per second, and estimates in an episode.
    - `speed=None`, `height=None`: (low, high) of walking speed [m/s] and body height [m]; None is the model's own
      speeds, and heights of 1.5 to 1.95 m, or the captured people's own.
    - `clothes=True`: colours differ from episode to episode.
    - `estimate="pose"`, `n_belief=64`: see Action Space.
    - `lost_after=None`: see Episode End.
    - `render_mode=None`: "rgb_array", the frame that was estimated last with the estimate over it, at least 256 pixels
      wide; or "human", the same in a window.

    `truth()` gives "pose" (25,), "joints" (15, 3), "camera" and "skeleton" for the frame observed last, and
    `observation_model` scores hypotheses against that frame without knowing the truth. If only "rgb" is observed, it
    learns the background from the frames in which it is asked for: ask in each.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/WalkerTracking-v0", num_envs=64)` draws all pictures of a step together; it takes
    `autoreset_mode` ("NextStep", "SameStep", "Disabled") and `threads` too.

    ## Version History
    - v0: initial version.

    Args:
        render_mode: None, "rgb_array" or "human".
        lost_after: error [m] beyond which the track counts as lost; None for never.
        arguments: see Arguments.
    """

    make_world = staticmethod(walker_world)


class WalkerTrackingVector(PictureTrackingVector):
    """`num_envs` times `WalkerTracking`, drawn together: see `PictureTrackingVector`."""

    make_world = staticmethod(walker_world)
