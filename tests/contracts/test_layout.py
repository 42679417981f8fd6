"""How the tree is laid out: folders that can be read at a glance, and private names that stay in their folder."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("motionenv", "service", "benchmarks", "renders", "tests")
MOST = 14
#: Folders that may show more, each for a reason.
MORE = {
    "motionenv/models": 17,  # a folder for each family of models, and one file for each thing that they share
    "benchmarks": 20,  # a folder for each family of claims, and single ones beside them
    "motionenv": 17,  # the steps of the flow, side by side
    "renders": 16,  # every picture of the README, and what makes them
    "renders/fixtures": 16,  # eight, each a picture and its truth
    "motionenv/mocap/marker_sets/sets": 20,  # one table per marker set
    "tests": 22,  # mirrors motionenv, and adds contracts, renders, benchmarks and the service
    "tests/cli": 16,  # mirrors cli, and adds what commands say
    "tests/envs": 16,  # mirrors envs, and adds what tests share and other libraries
    "service": 16,  # a folder for each layer, and what starts and joins them
    "tests/service/jobs": 20,  # mirrors jobs, and adds what happens to jobs and what tests share
    "tests/service": 22,  # mirrors service, and adds the page, hostile clients and what tests share
    "tests/models/eigenwalkers": 15,  # mirrors eigenwalkers, and adds walks made by hand
    "tests/models": 19,  # mirrors models, and adds a model that a package of somebody else brings
}
HIDDEN = {"node_modules", "dist"}  # what npm makes
PRIVATE_TO_ALL = "motionenv._core"  # private to motionenv, whose parts all build on it


def folders() -> list:
    """Every folder of the project, the top ones included."""
    tops = [ROOT / name for name in FOLDERS]
    found = [p for top in tops for p in (top, *top.rglob("*")) if p.is_dir() and holds_files(p)]
    return [p for p in found if not any(part.startswith((".", "__")) or part in HIDDEN for part in p.parts)]


def holds_files(folder: Path) -> bool:
    """Whether there is more in it than bytecode of modules that have moved."""
    return any(p.is_file() and p.parent.name != "__pycache__" for p in folder.rglob("*"))


def entries(folder: Path) -> list[str]:
    """What a reader sees of a folder: neither dunder files nor what a tool leaves there."""
    names = sorted(p.name for p in folder.iterdir() if p.is_file() or holds_files(p))
    return [name for name in names if not name.startswith((".", "__")) and name not in {"py.typed", *HIDDEN}]


@pytest.mark.parametrize("folder", [pytest.param(p, id=p.relative_to(ROOT).as_posix()) for p in folders()])
def test_a_folder_shows_about_a_dozen_entries(folder):
    seen = entries(folder)
    assert len(seen) <= MORE.get(folder.relative_to(ROOT).as_posix(), MOST), seen


def is_private(part: str) -> bool:
    return part.startswith("_") and not part.startswith("__")


def imported_names(path: Path) -> Iterator[str]:
    """Dotted names of everything that a file imports; `from a import b` is `a.b`."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def holders(name: str) -> list[str]:
    """The packages that hold a private part of a dotted name: of `a.b.c._x`, with a module `c`, `a.b`."""
    parts = name.split(".")
    owners = [parts[:i] for i, part in enumerate(parts) if is_private(part)]
    return [".".join(owner if ROOT.joinpath(*owner).is_dir() else owner[:-1]) for owner in owners]


def package_of(path: Path) -> str:
    """The package whose private names a file may use: its own, and for a test the one that it mirrors."""
    own = path.relative_to(ROOT).parent.parts
    if own[0] != "tests":
        return ".".join(own)
    mirrored = own[1:] if own[1:2] == ("service",) else ("motionenv", *own[1:])
    return ".".join(mirrored)


def trespasses(name: str, package: str) -> bool:
    """Whether a file of `package` imports a `name` that is private to another folder."""
    if name.startswith(f"{PRIVATE_TO_ALL}.") and package.split(".")[0] == "motionenv":
        name = name.replace("._core", ".core", 1)
    return any(not f"{package}.".startswith(f"{holder}.") for holder in holders(name))


def files() -> list:
    paths = [p for name in FOLDERS for p in sorted((ROOT / name).rglob("*.py")) if not HIDDEN & set(p.parts)]
    return [pytest.param(p, id=p.relative_to(ROOT).as_posix()) for p in paths]


@pytest.mark.parametrize("path", files())
def test_private_names_are_imported_in_their_own_folder_only(path):
    package = package_of(path)
    ours = [n for n in imported_names(path) if n.split(".")[0] in {"motionenv", "service", "benchmarks", "renders"}]
    assert not [name for name in ours if trespasses(name, package)]


@pytest.mark.parametrize(
    ("name", "package", "wrong"),
    [
        ("motionenv.body.kinematics._hinge", "motionenv.body", False),
        ("motionenv.body.kinematics._hinge", "motionenv.render.raycast", True),
        ("motionenv.models.fpca._gap_kernels.fill", "motionenv.models.fpca", False),
        ("motionenv.models.fpca._gap_kernels.fill", "motionenv.models", True),
        ("motionenv.render._x", "motionenv.render.raycast", False),
        ("motionenv._core.files.atomic_write", "motionenv.render.video", False),
        ("motionenv._core.files._umask", "motionenv.render.video", True),
        ("motionenv._core.files.atomic_write", "service.jobs", True),
        ("motionenv.__version__", "service", False),
    ],
)
def test_the_rule_itself(name, package, wrong):
    assert trespasses(name, package) == wrong


def public_modules() -> list:
    """Modules without an underscore, and where their tests belong."""
    found = [p for top in ("motionenv", "service") for p in sorted((ROOT / top).rglob("*.py"))]
    public = [p for p in found if not p.name.startswith("_") and "web" not in p.parts]
    return [pytest.param(p, id=p.relative_to(ROOT).as_posix()) for p in public]


@pytest.mark.parametrize("module", public_modules())
def test_a_public_module_has_a_test_module_of_its_name(module):
    inner = module.relative_to(ROOT)
    inner = inner.relative_to("motionenv") if inner.parts[0] == "motionenv" else inner
    assert (ROOT / "tests" / inner.parent / f"test_{inner.name}").is_file()
