import sys

import pytest

from motionenv.data import generate, ray_executor
from motionenv.errors import MotionError
from tests.data.walks import EVERYTHING, digests


@pytest.mark.integration
def test_ray_makes_the_same_files(tmp_path):
    pytest.importorskip("ray")
    generate(EVERYTHING, tmp_path / "here", workers=1)
    with ray_executor(num_cpus=2) as executor:
        made = generate(EVERYTHING, tmp_path / "ray", executor=executor)
    assert made.complete
    assert not made.failed
    assert digests(tmp_path / "here") == digests(tmp_path / "ray")


def test_without_ray_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MotionError, match=r"pip install 'motionenv\[ray\]'"), ray_executor():
        pass
