"""Pages that are made of what is elsewhere: results, environments, licences, the walker."""

import base64
import re
import shutil
from pathlib import Path

import gymnasium
import licences
import numpy as np

import motionenv
import motionenv.envs  # registers the environments
from motionenv.models import cycle
from service.formats.cycles import encoded
from service.formats.parameters import MEDIA_TYPE, packed

DOCS = Path(__file__).parent
MADE = DOCS / "made"
BENCHMARKS = DOCS.parent / "benchmarks"
#: Pictures of the environments, and what they show.
PICTURES = {
    "WalkerTracking": ("renders/environments/walker.png", "Frames of WalkerTracking: plain, following, and cluttered"),
    "MarkerTracking": (
        "renders/environments/markers.png", "Five frames of MarkerTracking: the markers that are seen, and the truth",
    ),
    "ArmTracking": (
        "renders/environments/arm.png", "Five frames of ArmTracking with the true pose drawn over them",
    ),
    "ActiveTracking": (
        "benchmarks/envs/active/planner.png", "The plaza from above and the camera's view, four moments",
    ),
}  # fmt: skip
LOOKS = {"body": "body", "stick": "stick figure", "points": "point lights"}
_SEND = """## Send a result

Train on `train`, choose on `train`, and score once:

```bash
motionenv evaluate module:factory --task {task} --episodes 64 --out results.json
motionenv evaluate module:factory --task {task} --split ood --episodes 64 --out ood.json
```

`factory(env)` makes your agent for a vector environment. The files hold settings, seeds, versions and the error of
every episode: send both, with what it takes to train the agent again, as a pull request.
"""


def make_pages() -> None:
    """Write them to `made`, where Sphinx finds them."""
    MADE.mkdir(exist_ok=True)
    results()
    licence_list()
    environments()
    walker()


def results() -> None:
    """results.md and leaderboard.md: those of the benchmarks, with pictures and links that lead there from here."""
    for name in ("results", "leaderboard"):
        text = (BENCHMARKS / f"{name.upper()}.md").read_text(encoding="utf-8")
        text = re.sub(r"(?<=!)(\[[^\]]*\]\()(?!http)", r"\1../../benchmarks/", text)
        text = text.replace("](RESULTS.md", "](results.md").replace("](LEADERBOARD.md", "](leaderboard.md")
        (MADE / f"{name}.md").write_text(text, encoding="utf-8")


def licence_list() -> None:
    """licences.md: the page of that name, and the list of what is installed here."""
    text = (DOCS / "licences.md").read_text(encoding="utf-8").replace("](../LICENSE)", "]")
    (MADE / "licences.md").write_text(f"{text}\n{licences.table()}\n", encoding="utf-8")


def environments() -> None:
    """A page for each family: facts, the docstring in Gymnasium's form, named tasks, results, how to send one."""
    folder = MADE / "environments"
    folder.mkdir(exist_ok=True)
    names = {}
    for name, spec in gymnasium.registry.items():
        found = re.fullmatch(r"motionenv/(\w+?)(?:-(Easy|Medium|Hard))?-v\d+", name)
        if found:
            names.setdefault(found[1], {})[found[2]] = spec
    for family, specs in names.items():
        (folder / f"{family}.md").write_text(_environment(family, specs), encoding="utf-8")


def _environment(family: str, specs: dict) -> str:
    with gymnasium.make(specs[None].id) as env:
        facts = {
            "Action space": env.action_space, "Observation space": env.observation_space,
            "Estimates per episode": env.spec.max_episode_steps,
        }  # fmt: skip
    rows = "".join(f"| {what} | `{_one_line(is_)}` |\n" for what, is_ in facts.items())
    tasks = "".join(
        f"| `{spec.id}` | {', '.join(f'`{k}={v!r}`' for k, v in spec.kwargs.items())} |\n"
        for level, spec in specs.items()
        if level
    )
    parts = [f"# {family}\n"]
    if family in PICTURES:
        parts.append("![{1}](../../../{0})\n".format(*PICTURES[family]))
    parts += [
        f"| made by | `gymnasium.make({specs[None].id!r})` |\n|-|-|\n{rows}",
        f"```{{eval-rst}}\n.. autoclass:: motionenv.envs.{family}\n   :no-members:\n   :no-index:\n```\n",
        f"## Named tasks\n\n| id | fixes |\n|-|-|\n{tasks}",
        f"## Results\n\n{_results(family)}",
        _SEND.format(task=specs["Easy"].id),
    ]
    return "\n".join(parts)


def _one_line(space: object) -> str:
    return re.sub(r"\s+", " ", str(space)).replace("|", "\\|")


def _results(family: str) -> str:
    """The table of the leaderboard, or where it is."""
    board = (BENCHMARKS / "LEADERBOARD.md").read_text(encoding="utf-8")
    found = re.search(rf"^## {family}\n\n(.*?)(?=^## |\Z)", board, re.DOTALL | re.MULTILINE)
    if not found:
        return "Its table is in the [results](/made/results.md#envsactive).\n"
    table = found[1].strip().replace(f"{family}-", "")
    how = "Mean error per joint [mm], made by `motionenv bench leaderboard`."
    return f"{how} [All families, and how to read it](/made/leaderboard.md).\n\n{table}\n"


def walker() -> None:
    """walker.html: the stage of the service's page with a walker whose stride is in it, for any page of the site."""
    embed = DOCS / "_static" / "made"
    embed.mkdir(exist_ok=True)
    (bundle,) = (DOCS.parent / "service" / "web" / "dist" / "assets").glob("main-*.js")
    shutil.copy(bundle, embed / "page.js")
    parameters = packed(*motionenv.models.parameters("walk/fpca"))
    average = np.zeros(len(motionenv.load("walk/fpca").components()))
    stride = encoded(cycle("walk/fpca", speed=1.3, height=1.75), np.nan, average, "walk/fpca", MEDIA_TYPE)
    looks = "".join(f"<option value={value}>{name}</option>" for value, name in LOOKS.items())
    (MADE / "walker.html").write_text(
        f"<div class=walker data-parameters='{base64.b64encode(parameters).decode()}'"
        f" data-stride='{base64.b64encode(stride).decode()}'>"
        "<canvas role=img aria-label='A walker in three dimensions: drag to turn it'></canvas>"
        "<div><label>Turn <input type=range min=-180 max=180 value=45></label>"
        f"<label>Look <select>{looks}</select></label><button type=button>Pause</button></div></div>"
        "<script src='_static/made/page.js' defer></script>",
        encoding="utf-8",
    )
