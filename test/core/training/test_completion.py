"""The completion network learns, goes on where it stopped, and means the same as ONNX."""

from pathlib import Path

import numpy as np
import pytest

from pop_core.body.joints import SHARED_MIRROR
from pop_core.training.completion.views import draw_views, pack

torch = pytest.importorskip('torch')

from pop_core.completion.joint_completion import EMBEDDED  # noqa: E402 - torch first
from pop_core.training.completion.export import (  # noqa: E402
    export_onnx,
    largest_difference,
)
from pop_core.training.completion.network import (  # noqa: E402
    Completion,
    completion_loss,
)
from pop_core.training.completion.trainer import (  # noqa: E402
    CompletionTrainer,
    train,
)
from pop_core.training.completion.validation import (  # noqa: E402
    error_table,
    errors,
    figures,
)
from pop_core.training.completion.view_pool import (  # noqa: E402
    ViewPool,
    load_pool,
    varied,
)
from pop_core.training.trainer import CheckpointError  # noqa: E402

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope='module')
def drawn(small_scenes):
    return list(draw_views(iter(small_scenes), np.random.default_rng(0)))


@pytest.fixture(scope='module')
def pool(drawn):
    return ViewPool([pack(drawn)])


def test_the_loss_is_least_at_the_truth_with_the_spread_of_errors():
    torch.manual_seed(0)
    truth = torch.zeros(4000, 15, 3)
    # Errors of the distribution that the loss believes in: radii as of gamma(3), sigma / 2.
    radius = torch.distributions.Gamma(3.0, 2.0 / 0.1).sample((4000, 15))
    ways = torch.nn.functional.normalize(torch.randn(4000, 15, 3), dim=2)
    losses = {sigma: float(completion_loss(
        Completion(ways * radius[..., None], torch.full((4000, 15), sigma).log()), truth))
        for sigma in (0.05, 0.1, 0.2)}
    assert min(losses, key=losses.get) == 0.1


def test_variants_show_the_same_people(pool):
    rows = torch.arange(len(pool))
    views = pool.at(rows)
    other = varied(views, torch.Generator().manual_seed(1))
    mirrored = torch.as_tensor(SHARED_MIRROR)
    shapes = [(views.places - views.places[:, :1]).norm(dim=2)]
    shapes.append(shapes[0][:, mirrored])
    found = (other.places - other.places[:, :1]).norm(dim=2)
    same = torch.stack([torch.isclose(found, shape, atol=1e-4).all(dim=1) for shape in shapes])
    assert same.any(dim=0).all()
    assert same.all(dim=0).sum() < len(rows)  # nobody is symmetrical
    assert bool(same[0].any())
    assert bool(same[1].any())
    flags = torch.where(same[0][:, None], views.keypoints[..., 3], views.keypoints[:, mirrored, 3])
    assert bool((other.keypoints[..., 3] <= flags).all())
    assert bool((other.keypoints[..., 3] < flags).any())  # some were taken away
    kept = other.keypoints[..., 3] > 0
    across, kept_side = views.keypoints[..., 0], same[0][:, None]
    across = torch.where(kept_side, across, -across[:, mirrored])
    assert torch.equal(other.keypoints[..., 0][kept], across[kept])
    assert not bool(other.keypoints[~kept].any())


def test_it_learns_goes_on_and_is_the_same_as_onnx(pool, tmp_path):
    torch.manual_seed(0)
    trainer = CompletionTrainer()
    views = pool.at(torch.arange(min(len(pool), 16)))
    losses = [trainer.step(views) for _ in range(25)]
    assert np.mean(losses[-5:]) < np.mean(losses[:3]) - 1.0
    trainer.save(tmp_path / 'net.pt')
    other = CompletionTrainer()
    other.load(tmp_path / 'net.pt')
    assert other.views == trainer.views
    assert figures(other.averaged, pool).startswith('visible')
    export_onnx(other.averaged, tmp_path / 'net.onnx', 'a test')
    assert largest_difference(other.averaged, tmp_path / 'net.onnx') < 1e-3


def test_a_run_writes_its_checkpoint(drawn, tmp_path):
    packed = pack(drawn)
    np.savez(tmp_path / 'views.npz', relief=packed.relief, keypoints=packed.keypoints,
             places=packed.places, state=packed.state)
    said = []
    trainer = CompletionTrainer()
    train(trainer, tmp_path, tmp_path, tmp_path / 'net.pt', 0.02, said.append)
    assert trainer.views > 0
    assert said[-1] == figures(trainer.averaged, load_pool(tmp_path))
    other = CompletionTrainer()
    other.load(tmp_path / 'net.pt')
    assert other.views == trainer.views


def test_people_are_counted_by_what_is_seen_of_them(pool):
    network = CompletionTrainer().averaged
    rows = [line.split() for line in error_table(network, pool)]
    assert sum(int(row[3]) for row in rows[1:]) == len(pool)
    seen = (pool.state == 0).sum(dim=1) >= 11
    off_mm = 1e3 * errors(network, pool)[seen][pool.state[seen] == 0]
    assert rows[-1][:3] == ['11', 'to', '15']
    assert rows[-1][4] == f'{off_mm.mean():.0f}/{off_mm.median():.0f}'


def test_a_damaged_checkpoint_is_named(tmp_path):
    path = tmp_path / 'net.pt'
    path.write_bytes(b'nothing')
    with pytest.raises(CheckpointError, match='expected a checkpoint of the completion network'):
        CompletionTrainer().load(path)


def test_the_embedded_network_is_its_checkpoint():
    trainer = CompletionTrainer()
    trainer.load(ROOT / 'pop_core' / 'training' / 'completion_net.pt')
    assert largest_difference(trainer.averaged, EMBEDDED) < 1e-3
