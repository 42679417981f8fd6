"""Arrows among the gait models go one way: families know what serves them, and nothing that serves knows a family."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Families, and the families that each builds on.
FAMILIES = {"fpca": set(), "walking": {"fpca"}, "eigenwalkers": {"fpca"}, "motion_tree": set()}
#: Modules that know all families: what fits the shipped models.
ABOVE = {"motionenv.models.training"}


def imported(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Modules and names of all imports at any depth, except those for type checkers alone."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module, alias.name) for alias in node.names)
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield from imported(node)


def graph() -> dict[str, set[str]]:
    """The modules of `motionenv.models` that each of them imports."""
    paths = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in (ROOT / "motionenv" / "models").rglob("*.py")
    }
    found = {}
    for name, path in paths.items():
        pairs = imported(ast.parse(path.read_text(encoding="utf-8")))
        modules = {full if (full := f"{module}.{what}") in paths else module for module, what in pairs}
        found[name] = modules & set(paths)
    return found


def test_the_models_have_no_circle_and_only_families_know_families():
    arrows = graph()
    tuple(TopologicalSorter(arrows).static_order())  # raises a CycleError with the circle
    family = lambda module: next((part for part in module.split(".")[2:3] if part in FAMILIES), None)
    wrong = [
        f"{one} imports {other}"
        for one, others in arrows.items()
        for other in others
        if family(other) not in {None, family(one), *FAMILIES.get(family(one), ())} and one not in ABOVE
    ]
    assert not wrong
    assert any(family(other) == "fpca" for other in arrows["motionenv.models.walking.model"])  # it sees imports
