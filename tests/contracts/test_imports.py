"""Rules of imports, read from the source: stages, the places of libraries, private names, and no circles of models."""

import ast
import importlib
import re
import sys
import tomllib
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = {"arguments", "errors", "types", "_core"}
#: The order of the flow: a part imports itself and what comes before it.
RANK = {
    **dict.fromkeys(CORE, 0),
    "body": 1,
    "mocap": 2,
    "cycles": 2,
    "gait": 3,
    "models": 4,
    "render": 5,
    "likelihoods": 6,
    "lifting": 7,
    "tracking": 8,
    "metrics": 9,
    "envs": 10,
    "data": 11,
    "": 12,  # motionenv/__init__.py: the public names
    "cli": 13,
    "__main__": 14,
}
STAGES = set(RANK) - {"errors", "types"}
HOME = {
    "numpy": set(RANK),
    "scipy": set(RANK),
    "numba": STAGES,
    "threadpoolctl": {"lifting"},
    "pygltflib": {"mocap"},
    "platformdirs": {"_core", "models"},
    "pooch": {"mocap"},
    "rtmlib": {"mocap"},
    "ai_edge_litert": {"mocap"},
    "onnxruntime": {"mocap"},
    "requests": {"mocap"},
    "trimesh": {"body", "render"},
    "pyrender": {"render"},
    "OpenGL": {"render"},
    "pyglet": {"render"},
    "av": {"render"},
    "PIL": {"_core", "render", "data"},
    "matplotlib": {"_core", "lifting", "models"},
    "sklearn": {"_core"},
    "gymnasium": {"envs"},
    "orjson": {"data"},
    "pyarrow": {"data"},
    "pydantic": {"data"},
    "typer": {"cli"},
    "rich": {"cli"},
}

#: Distributions not called like the module that they bring; pyrender asks for the OpenGL and pyglet that it needs.
DISTRIBUTION = {
    "ai_edge_litert": "ai-edge-litert",
    "axe_playwright_python": "axe-playwright-python",
    "PIL": "pillow",
    "OpenGL": "pyrender",
    "pyglet": "pyrender",
    "psycopg_pool": "psycopg",
    "yaml": "pyyaml",
    "mimeparse": "python-mimeparse",
    "python_multipart": "python-multipart",
    "prometheus_client": "prometheus-client",
    "pydantic_settings": "pydantic-settings",
    "sklearn": "scikit-learn",
    "stable_baselines3": "stable-baselines3",
}

FOLDERS = ("motionenv", "service", "benchmarks", "renders", "tests")
HIDDEN = {"node_modules", "dist"}  # what npm makes
PRIVATE_TO_ALL = "motionenv._core"  # private to motionenv, whose parts all build on it


def part_of(module: str) -> str:
    """`motionenv.body.skeleton` → `body`; `motionenv` itself → the empty name."""
    return [*module.split("."), ""][1]


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported_names(path: Path) -> Iterator[str]:
    """Dotted names of everything that a file imports, at any depth; `from a import b` is `a.b`."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import; name the module in full"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def complaint(importer: str, imported: str) -> str | None:
    """What is wrong with a module in part `importer` naming `imported`, or None."""
    top = imported.split(".")[0]
    if top == "service":
        return "nothing imports service"
    if imported == "motionenv.__version__":  # model files say which version wrote them
        return None
    if top == "motionenv":
        part = part_of(imported)
        part = part if part in RANK else ""
        allowed = part == importer or RANK[part] < RANK[importer] or {part, importer} <= CORE
        return None if allowed else f"{part or 'the public names'} comes later than {importer}"
    if top in sys.stdlib_module_names:
        return None
    return None if importer in HOME.get(top, ()) else f"{top} belongs in {sorted(HOME.get(top, ())) or 'no part yet'}"


def test_every_part_imports_only_what_it_may():
    importers = {path: part_of(module_of(path)) for path in sorted((ROOT / "motionenv").rglob("*.py"))}
    assert len(importers) > 200
    assert set(importers.values()) <= set(RANK), "give each part its place in RANK"
    named = [(path, importer, name) for path, importer in importers.items() for name in imported_names(path)]
    assert not {(path, name): why for path, importer, name in named if (why := complaint(importer, name))}


def test_the_service_imports_only_public_names():
    """Names in `__all__` of `motionenv` and its packages, and the records and names of `motionenv.types`."""
    private = []
    for node in (node for p in (ROOT / "service").rglob("*.py") for node in ast.walk(ast.parse(p.read_text("utf-8")))):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "motionenv":
            public = importlib.import_module(node.module)
            listed = getattr(public, "__all__", ()) if node.module != "motionenv.types" else dir(public)
            private += [f"{node.module}.{a.name}" for a in node.names if a.name not in (*listed, "__version__")]
        elif isinstance(node, ast.Import):
            private += [a.name for a in node.names if a.name.startswith("motionenv.")]
    assert not private


def declared(*extras: str) -> set[str]:
    """Names of the distributions that pyproject.toml asks for: to build, plain, or in `extras`."""
    file = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = file["project"]
    lines = (
        file["build-system"]["requires"]
        + project["dependencies"]
        + [line for extra in extras for line in project["optional-dependencies"][extra]]
    )
    return {re.match(r"[\w-]+", line)[0] for line in lines}


@pytest.mark.parametrize(
    ("folder", "extras"),
    [
        ("motionenv", ("agents", "data", "detect", "plots", "rtmpose", "sklearn")),
        ("service", ()),
        ("tests", ("test", "agents", "data", "detect", "integrations")),
        ("benchmarks", ("test", "bench")),
    ],
)
def test_every_library_that_is_imported_is_declared(folder, extras):
    paths = list((ROOT / folder).rglob("*.py"))
    tops = {name.split(".")[0] for path in paths for name in imported_names(path)} - {path.stem for path in paths}
    used = {DISTRIBUTION.get(top, top) for top in tops - sys.stdlib_module_names}
    assert used <= declared(*extras) | {"motionenv", "service", "benchmarks", "renders", folder}


@pytest.mark.parametrize(
    ("importer", "imported", "fine"),
    [
        ("models", "motionenv.cycles.snr", True),
        ("cycles", "motionenv.models", False),
        ("cycles", "motionenv.mocap", False),
        ("types", "motionenv.errors", True),
        ("types", "motionenv.body", False),
        ("body", "motionenv.load", False),
        ("cli", "motionenv.load", True),
        ("types", "numba", False),
        ("render", "numba", True),
        ("models", "pyrender", False),
        ("cli", "service", False),
        ("body", "tomllib", True),
        ("body", "pandas", False),
    ],
)
def test_the_rule_itself(importer, imported, fine):
    assert (complaint(importer, imported) is None) == fine


def is_private(part: str) -> bool:
    return part.startswith("_") and not part.startswith("__")


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
def test_the_rule_of_private_names_itself(name, package, wrong):
    assert trespasses(name, package) == wrong


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
    paths = {module_of(path): path for path in (ROOT / "motionenv" / "models").rglob("*.py")}
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
