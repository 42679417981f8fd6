"""Every public function, class and method says what each parameter is, and has types for those and what it returns."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator

import motionenv
from motionenv import envs

#: Typer shows the help of each option beside its name; tests/cli/test_cli.py sees that none lacks one.
OPTIONS_HAVE_HELP = "motionenv.cli"
OPTIONAL = {"torch"}  # what a module of an extra that isn't installed fails to import

#: A parameter as an entry of a section, such as `x (n, 2) [m]: ...` or `a, b: ...`, or named in code in the prose.
ENTRY = re.compile(r"^\s*(\*{0,2}\w+(?:, \*{0,2}\w+)*)(?: [(\[].*?[)\]])*:", re.MULTILINE)
CODE = re.compile(r"`([^`]*)`")


def modules() -> Iterator:
    """Every module whose dotted name has no part that starts with an underscore."""
    yield motionenv
    for info in pkgutil.walk_packages(motionenv.__path__, "motionenv."):
        if not any(part.startswith("_") for part in info.name.split(".")):
            try:
                yield importlib.import_module(info.name)
            except ModuleNotFoundError as error:
                if error.name not in OPTIONAL:
                    raise


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


def documentation(thing) -> str:
    """The docstring; for a method that overrides one and has none, that of the method it overrides.

    That of an environment refers to others for the arguments that it has in common with them.
    """
    text = inspect.getdoc(thing) or ""
    if inspect.isclass(thing) and thing.__name__ in envs.__all__:
        others = [name for name in CODE.findall(text) if name in envs.__all__ and name != thing.__name__]
        text += "".join(documentation(getattr(envs, name)) for name in others)
    return text


def parameters(thing) -> set[str]:
    if thing.__module__.startswith(OPTIONS_HAVE_HELP) or (inspect.isclass(thing) and "__init__" not in vars(thing)):
        return set()
    if getattr(thing, "_is_protocol", False):
        return set()  # nobody constructs a protocol
    named = inspect.signature(inspect.unwrap(thing)).parameters.values()
    return {p.name for p in named if not p.name.startswith("_")} - {"self", "cls"}


def named(docstring: str) -> set[str]:
    """Names that a docstring explains."""
    return {name for text in ENTRY.findall(docstring) + CODE.findall(docstring) for name in re.findall(r"\w+", text)}


def unannotated(function: Callable) -> list[str]:
    """Parameters of a function without a type, and "return" if it doesn't say what it returns."""
    given = [p for p in inspect.signature(function).parameters.values() if p.name not in ("self", "cls")]
    missing = [p.name for p in given if p.annotation is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    return missing + ["return"] * ("return" not in inspect.get_annotations(function))


def test_packages_list_their_public_names():
    packages = [module for module in modules() if hasattr(module, "__path__")]
    assert len(packages) > 20
    assert not [package for package in packages if not getattr(package, "__all__", ())]
    assert not [(p.__name__, name) for p in packages for name in p.__all__ if not hasattr(p, name)]


def test_docstrings_name_every_parameter():
    found = {name: parameters(thing) - named(documentation(thing)) for name, thing in exported().items()}
    assert len(found) > 500
    assert not {name: missing for name, missing in found.items() if missing}
    assert not [name for name, thing in exported().items() if not documentation(thing)]


def test_types_are_annotated():
    functions = {name: thing for name, thing in defined().items() if inspect.isfunction(thing)}
    assert not {name: missing for name, thing in functions.items() if (missing := unannotated(thing))}


def test_types_of_constructors_are_annotated():
    classes = {name: thing for name, thing in defined().items() if "__init__" in vars(thing)}
    real = {name: thing.__init__ for name, thing in classes.items() if not getattr(thing, "_is_protocol", False)}
    assert not {name: missing for name, init in real.items() if (missing := set(unannotated(init)) - {"return"})}


def test_a_parameter_counts_as_named_only_where_it_is_explained():
    assert named("Scale the points.\n\nArgs:\n    x (n, 2) [m]: where.\n    a, b: `c.d` [s].") == {"Args", *"xabcd"}
    assert "speed" not in named("Walks at a speed: slowly.")
