"""Ray Core tasks as an executor, for data sets that take more than one machine: `pip install 'motionenv[ray]'`."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from motionenv.errors import MotionError


class RayTasks(Executor):
    """Runs each call as a Ray task of one core; only its arguments and its result travel."""

    def __init__(self) -> None:
        import ray

        self._max_workers = max(1, int(ray.cluster_resources().get("CPU", 1)))
        self._call = ray.remote(num_cpus=1, max_retries=3)(_call)

    def submit(self, fn: Callable, /, *args, **kwargs) -> Future:
        """The future of `fn(*args, **kwargs)`."""
        return self._call.remote(fn, args, kwargs).future()


def _call(fn: Callable, args: tuple, kwargs: dict):
    return fn(*args, **kwargs)


@contextmanager
def ray_executor(address: str | None = None, **options) -> Iterator[Executor]:
    """An executor of Ray tasks, on a cluster or on this machine.

    Args:
        address: of the cluster's head, as `ray.init` takes it; None starts Ray on this machine, and ends it afterwards.
        options: of `ray.init`, such as `num_cpus`.

    Raises:
        MotionError: Ray isn't installed, or there is no cluster.

    Example:
        >>> with ray_executor("auto") as executor:  # doctest: +SKIP
        ...     generate(spec, "s3://bucket/walkers", executor=executor)
    """
    try:
        import ray
    except ImportError:
        raise MotionError("Ray isn't installed: pip install 'motionenv[ray]'") from None
    try:
        local: dict[str, Any] = {"include_dashboard": False} if address is None else {}
        ray.init(address=address, log_to_driver=False, **local, **options)
    except (ConnectionError, ValueError) as error:
        raise MotionError(f"there is no Ray cluster at {address!r}: {error}") from None
    try:
        yield RayTasks()
    finally:
        ray.shutdown()
