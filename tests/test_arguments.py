"""The arguments of a walk: one declaration, which all signatures show."""

import inspect
from typing import Unpack, get_type_hints

import pytest

import motionenv
from motionenv.arguments import ARGUMENTS, WALK_ARGUMENTS, Choice, WalkArguments, keyword_arguments
from motionenv.models.paths import WalkPath, walk_along


def test_what_functions_hand_on_has_the_types_of_the_request():
    declared = {name: argument.type for name, argument in ARGUMENTS.items() if name not in ("seconds", "fps", "speed")}
    assert get_type_hints(WalkArguments) == declared


def test_every_argument_is_described_with_its_unit_where_it_has_one():
    for name, argument in ARGUMENTS.items():
        assert argument.meaning.help.endswith("."), name
        assert argument.type in ((str,) if isinstance(argument.meaning, Choice) else (float, float | None)), name


@pytest.mark.parametrize(
    "function",
    [
        motionenv.synthesize,
        motionenv.GaitModel.synthesize,
        walk_along,
    ],
)
def test_signatures_show_the_arguments(function):
    shown = inspect.signature(function).parameters
    for name in WALK_ARGUMENTS:
        assert shown[name].default == ARGUMENTS[name].default
        assert shown[name].kind is inspect.Parameter.KEYWORD_ONLY
    assert not any(parameter.kind is parameter.VAR_KEYWORD for parameter in shown.values())


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ("hieght", r"synthesize\(\) got an unexpected keyword argument 'hieght': did you mean height\?"),
        ("pase", r"synthesize\(\) .* 'pase': did you mean phase\?"),
        ("deviation", r"synthesize\(\) .* 'deviation': did you mean deviations\?"),
        ("zzz", r"synthesize\(\) got an unexpected keyword argument 'zzz'$"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(wrong, says):
    with pytest.raises(TypeError, match=says):
        motionenv.synthesize("walk/fpca", 1, 30, **{wrong: 1.0})


def test_a_wrong_name_is_of_the_function_that_was_called():
    model = motionenv.load("walk/fpca")
    with pytest.raises(TypeError, match=r"walk_along\(\) .* did you mean variation\?"):
        walk_along(model, WalkPath.line(5), 1, 30, variaton=0.0)


def test_the_docstring_says_what_each_argument_may_be():
    @keyword_arguments(WalkArguments)
    def walk(**walk: Unpack[WalkArguments]) -> None:
        """A walk.

        Args:
            walk: how.
        """

    assert "\n    height: Body height [m]; by default the walker's own. From 0.5 to 2.5.\n" in inspect.cleandoc(
        walk.__doc__
    )
