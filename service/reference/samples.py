"""How each operation is called: from a shell, and from Python."""

import json
import shlex
from typing import Any, NamedTuple

_FILE = "-F files=@walk.c3d"


class Sample(NamedTuple):
    """A call of an operation.

    Attributes:
        python: with a `client` of the library; None where it has no method, as no program needs one.
        body: of the request, as JSON.
        arguments: further ones of curl.
    """

    python: str | None = None
    body: dict[str, Any] | None = None
    arguments: str = ""


#: By operation, in an order in which they can be called one after the other.
SAMPLES: dict[str, Sample] = {
    "check_alive": Sample(),
    "check_ready": Sample(),
    "get_metrics": Sample(),
    "describe_body": Sample(),
    "list_models": Sample("client.models()"),
    "get_model": Sample('client.model("walk/fpca")'),
    "get_parameters": Sample(None, arguments="-o parameters.bin"),
    "synthesize_walk": Sample(
        'walk = client.synthesize("walk/fpca", seconds=4, fps=30, seed=7, speed=1.3)\n'
        'motionenv.write(walk, "walk.c3d")',
        {"model": "walk/fpca", "seconds": 4, "fps": 30, "seed": 7, "speed": 1.3},
        "-H 'Accept: application/x-c3d' -o walk.c3d",
    ),
    "sample_poses": Sample(
        'client.tree_samples("walk", n=3, seed=1)', {"start": "walk", "n": 3, "seed": 1}, "-o next.json"
    ),
    "synthesize_activity": Sample(
        'client.tree_synthesize(10, "walk", seed=1)', {"start": "walk", "seconds": 10, "seed": 1}, "-o motion.json"
    ),
    "lift_points": Sample("client.lift(points)", arguments="--json @points.json -o lifted.json"),
    "analyse_gait": Sample(
        'client.gait("walk/fpca", seed=7, speed=1.3)["parameters"]',
        {"model": "walk/fpca", "seed": 7, "speed": 1.3},
        "-o gait.json",
    ),
    "make_stimuli": Sample(
        'client.stimuli({"people": [{}], "displays": [{"inverted": True}], "seconds": 1}, "stimuli.zip")',
        {"people": [{}], "displays": [{"inverted": True}], "seconds": 1},
        "-H 'Accept: application/zip' -o stimuli.zip",
    ),
    "fit_model": Sample(
        'client.fit("my-walk", ["walk.c3d"]).wait()', arguments=f"{_FILE} -F kind=fpca -F name=my-walk"
    ),
    "get_model_file": Sample('client.save_model("fitted/my-walk", "my-walk.npz")', arguments="-o my-walk.npz"),
    "upload_model": Sample(
        'client.upload_model("copied", "my-walk.npz").wait()', arguments="-F files=@my-walk.npz -F name=copied"
    ),
    "inspect_captures": Sample('client.inspect(["walk.c3d"]).wait().result()', arguments=_FILE),
    "list_points": Sample('client.points(["walk.c3d"]).wait().result()', arguments=_FILE),
    "convert_capture": Sample(
        'client.convert(["walk.c3d"], ".bvh").wait().save("walk.bvh")', arguments=f"{_FILE} -F format=model/x-bvh"
    ),
    "report_gait": Sample('client.report(["walk.c3d"]).wait().save("report.html")', arguments=_FILE),
    "render_walk": Sample(
        'job = client.render("walk/fpca", seconds=2, fps=25, seed=7)',
        {"model": "walk/fpca", "seconds": 2, "fps": 25, "seed": 7},
    ),
    "list_jobs": Sample("client.jobs()"),
    "get_job": Sample("job.wait(lambda job: print(job.progress))"),
    "get_result": Sample('job.save("walk.mp4")', arguments="-o walk.mp4"),
    "cancel_job": Sample('client.render("walk/fpca", seconds=60, fps=25, seed=7).cancel()'),
    "remove_job": Sample("job.remove()"),
    "remove_model": Sample('client.remove_model("fitted/my-walk")'),
}
#: What stands for parameters of paths.
PLACES = {"group": "walk", "name": "fpca", "job": "JOB"}
_OWN = {"remove_model": {"name": "my-walk"}, "get_model_file": {"name": "my-walk"}}


def path_of(operation: str, path: str) -> str:
    """`path` with something in place of its parameters."""
    return path.format(**PLACES | _OWN.get(operation, {}))


def curl(operation: str, method: str, path: str, origin: str, *, key: bool) -> str:
    """The line for a shell. `origin` is the service's address; with `key`, it sends the one in MOTIONENV_KEY."""
    sample = SAMPLES[operation]
    parts = ["curl -s", f"{origin}{path_of(operation, path)}"]
    if method not in ("get", "post"):
        parts.append(f"-X {method.upper()}")
    if method == "post" and sample.body is None and not sample.arguments:
        parts.append("-X POST")
    if key:
        parts.append('-H "Authorization: Bearer $MOTIONENV_KEY"')
    if sample.body is not None:
        parts.append(f"--json {shlex.quote(json.dumps(sample.body))}")
    return " ".join(part for part in [*parts, sample.arguments] if part)
