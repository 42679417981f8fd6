"""Private names stay in their folder."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("motionenv", "service", "benchmarks", "renders", "tests")
HIDDEN = {"node_modules", "dist"}  # what npm makes
PRIVATE_TO_ALL = "motionenv._core"  # private to motionenv, whose parts all build on it


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


def test_private_names_are_imported_in_their_own_folder_only():
    paths = [p for name in FOLDERS for p in sorted((ROOT / name).rglob("*.py")) if not HIDDEN & set(p.parts)]
    assert len(paths) > 500
    ours = ("motionenv.", "service.", "benchmarks.", "renders.")
    named = [(path, name) for path in paths for name in imported_names(path) if name.startswith(ours)]
    assert not [(path, name) for path, name in named if trespasses(name, package_of(path))]


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
