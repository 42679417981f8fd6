import inspect

import pytest

from motionenv.data import FORMATS
from motionenv.data.formats import format_of
from motionenv.data.formats.base import Format
from motionenv.errors import MotionError


@pytest.mark.parametrize("name", FORMATS)
def test_formats_have_the_methods_of_the_protocol(name):
    made = format_of(name)
    assert made.name == name
    for method in ("check", "write", "finish"):
        wanted, found = (inspect.signature(getattr(of, method)).parameters for of in (Format, type(made)))
        assert list(found) == list(wanted)


def test_unknown_formats():
    with pytest.raises(MotionError, match="format must be one of webdataset, coco.*, got 'csv'"):
        format_of("csv")
