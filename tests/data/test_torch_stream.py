import numpy as np
import pytest

from motionenv.data import Walkers
from tests.data.walks import SINGLE

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
SMALL = SINGLE.replace(output={"fields": ["joints", "rgb"]})


@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_loaders_with_workers_give_every_sample_once(context):
    from torch.utils.data import DataLoader

    walkers = Walkers(SMALL)
    loader = DataLoader(walkers.torch(batch=5), batch_size=None, num_workers=2, multiprocessing_context=context)
    batches = list(loader)
    order = np.concatenate([batch["index"] for batch in batches])
    assert sorted(order.tolist()) == list(range(50))
    joints = np.concatenate([batch["joints"] for batch in batches])
    assert np.array_equal(joints[np.argsort(order)], [sample["joints"] for sample in walkers])


def test_map_style_is_the_same():
    from torch.utils.data import DataLoader

    batches = list(DataLoader(Walkers(SMALL), batch_size=25))
    assert np.array_equal(np.concatenate([b["rgb"] for b in batches]), [sample["rgb"] for sample in Walkers(SMALL)])


def rank_of_two(rank: int, file: str, found) -> None:
    torch.distributed.init_process_group("gloo", init_method=f"file://{file}", rank=rank, world_size=2)
    found.put((rank, [int(sample["index"]) for sample in Walkers(SMALL).torch()]))
    torch.distributed.destroy_process_group()


def test_ranks_share(tmp_path):
    context = torch.multiprocessing.get_context("spawn")
    found = context.Queue()
    ranks = [context.Process(target=rank_of_two, args=(rank, str(tmp_path / "meet"), found)) for rank in range(2)]
    for process in ranks:
        process.start()
    shares = dict(found.get(timeout=120) for _ in ranks)
    for process in ranks:
        process.join()
    assert shares == {0: list(range(25)), 1: list(range(25, 50))}


def test_a_stored_state_is_taken_up():
    stream = Walkers(SMALL).torch()
    assert stream.state_dict() == {}
    steps = iter(stream)
    for _ in range(7):
        next(steps)
    later = Walkers(SMALL).torch()
    later.load_state_dict(stream.state_dict())
    assert [int(sample["index"]) for sample in later] == list(range(7, 50))
