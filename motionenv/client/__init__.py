"""Client of a service that `motionenv serve` runs: motions, films and models.

    >>> with motionenv.Client("http://127.0.0.1:8000") as client:  # doctest: +SKIP
    ...     motion = client.synthesize("walk/fpca", seconds=4, fps=30, seed=1, speed=1.3)
    ...     client.save("walk.mp4", "walk/fpca", seconds=4, fps=30, seed=1, speed=1.3)

The same seed gives the same motion, to the last bit, as `motionenv.synthesize`.
"""

from motionenv.client.client import Client, Picture, Walk

__all__ = ["Client", "Picture", "Walk"]
