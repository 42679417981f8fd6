"""PyTorch's loaders take `Walkers` as they are, and as an iterable in the few lines of docs/data-sets.md."""

import numpy as np
import pytest

from motionenv.data import Walkers
from tests.contracts.markdown import ROOT, blocks
from tests.data.walks import SINGLE

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
SMALL = SINGLE.replace(output={"fields": ["joints", "rgb"]})


def test_the_documented_loader_gives_every_sample_once():
    walkers = Walkers(SMALL)
    (shown,) = blocks(ROOT / "docs/data-sets.md", "py")
    names: dict = {"walkers": walkers, "__name__": "shown"}
    exec(shown.replace("batch=64", "batch=5"), names)
    loader = names["DataLoader"](
        names["Clips"](), batch_size=None, num_workers=2, multiprocessing_context="fork"
    )  # a spawned worker couldn't import what `exec` made
    batches = list(loader)
    order = np.concatenate([batch["index"] for batch in batches])
    assert sorted(order.tolist()) == list(range(50))
    joints = np.concatenate([batch["joints"] for batch in batches])
    assert np.array_equal(joints[np.argsort(order)], [sample["joints"] for sample in walkers])


def test_map_style_is_the_same():
    batches = list(torch.utils.data.DataLoader(Walkers(SMALL), batch_size=25))
    assert np.array_equal(np.concatenate([b["rgb"] for b in batches]), [sample["rgb"] for sample in Walkers(SMALL)])
