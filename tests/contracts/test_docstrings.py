"""Every public function, class and method says what each parameter is, and has types for those and what it returns."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator

import pytest

import motionenv

#: Typer shows the help of each option beside its name; tests/cli/test_cli.py sees that none lacks one.
OPTIONS_HAVE_HELP = "motionenv.cli"


def modules() -> Iterator:
    """Every module whose dotted name has no part that starts with an underscore."""
    yield motionenv
    for info in pkgutil.walk_packages(motionenv.__path__, "motionenv."):
        if not any(part.startswith("_") for part in info.name.split(".")):
            yield importlib.import_module(info.name)


def ours(thing) -> bool:
    return (inspect.isfunction(thing) or inspect.isclass(thing)) and thing.__module__.startswith("motionenv")


def exported() -> dict[str, object]:
    """Functions and classes that some `__all__` lists, with the public methods of the classes, by qualified name."""
    listed = (getattr(module, name) for module in modules() for name in getattr(module, "__all__", ()))
    unwrapped = (getattr(thing, "py_func", thing) for thing in listed)  # what numba compiled
    return with_methods({f"{thing.__module__}.{thing.__name__}": thing for thing in unwrapped if ours(thing)})


def defined() -> dict[str, object]:
    """The same for everything whose name has no underscore in front, listed or not."""
    return with_methods(
        {
            f"{module.__name__}.{name}": thing
            for module in modules()
            for name, thing in vars(module).items()
            if not name.startswith("_") and ours(thing) and thing.__module__ == module.__name__
        }
    )


def with_methods(found: dict[str, object]) -> dict[str, object]:
    inner = (methods(name, thing) for name, thing in found.items() if inspect.isclass(thing))
    return {**found, **dict(pair for pairs in inner for pair in pairs)}


def methods(name: str, cls: type) -> Iterator[tuple[str, object]]:
    """(qualified name, function) of the public methods and properties that `cls` itself defines."""
    for key, value in vars(cls).items():
        value = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        value = getattr(value, "func", value)  # functools.cached_property
        if not key.startswith("_") and inspect.isfunction(value):
            yield f"{name}.{key}", value


def cases(found: dict[str, object]) -> list:
    return [pytest.param(thing, id=name) for name, thing in sorted(found.items())]


def documentation(thing) -> str:
    """The docstring; for a method that overrides one and has none, that of the method it overrides."""
    return inspect.getdoc(thing) or ""


def parameters(thing) -> set[str]:
    if thing.__module__.startswith(OPTIONS_HAVE_HELP) or (inspect.isclass(thing) and "__init__" not in vars(thing)):
        return set()
    if getattr(thing, "_is_protocol", False):
        return set()  # nobody constructs a protocol
    named = inspect.signature(inspect.unwrap(thing)).parameters.values()
    return {p.name for p in named if not p.name.startswith("_")} - {"self", "cls"}


@pytest.mark.parametrize("package", [m for m in modules() if hasattr(m, "__path__")], ids=lambda m: m.__name__)
def test_a_package_lists_its_public_names(package):
    assert package.__all__
    assert all(hasattr(package, name) for name in package.__all__)


@pytest.mark.parametrize("thing", cases(exported()))
def test_docstring_names_every_parameter(thing):
    text = documentation(thing)
    assert text
    assert parameters(thing) <= set(re.findall(r"\w+", text))


FUNCTIONS = {name: thing for name, thing in defined().items() if inspect.isfunction(thing)}


@pytest.mark.parametrize("thing", cases(FUNCTIONS))
def test_types_are_annotated(thing):
    named = [p for p in inspect.signature(thing).parameters.values() if p.name not in ("self", "cls")]
    missing = [p.name for p in named if p.annotation is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    assert not missing, f"say what {', '.join(missing)} may be"
    assert "return" in inspect.get_annotations(thing), "say what it returns: -> ..."


@pytest.mark.parametrize(
    "thing",
    cases(
        {
            n: t
            for n, t in defined().items()
            if inspect.isclass(t) and "__init__" in vars(t) and not getattr(t, "_is_protocol", False)
        }
    ),
)
def test_types_of_constructors_are_annotated(thing):
    given = list(inspect.signature(thing.__init__).parameters.values())[1:]
    missing = [p.name for p in given if p.annotation is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    assert not missing, f"say what {', '.join(missing)} may be"
