"""The network learns, goes on where it stopped, and means the same as ONNX."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pop_core.keypoints.onnx_session import load_network as load_onnx
from pop_core.training.shards import ShardError, pack, save_shard

torch = pytest.importorskip('torch')

from pop_core.keypoints.depth_network import (  # noqa: E402 - torch first
    EMBEDDED,
    DepthNetwork,
    close_path,
)
from pop_core.training.export import (  # noqa: E402
    ExportError,
    export_onnx,
    largest_difference,
)
from pop_core.training.losses import losses  # noqa: E402
from pop_core.training.muon import orthogonal  # noqa: E402
from pop_core.training.network import (  # noqa: E402
    DepthMaps,
    DepthNet,
    NetworkConfig,
    relief_channels,
)
from pop_core.training.run import RunConfig, train, validate  # noqa: E402
from pop_core.training.scene_pool import ScenePool  # noqa: E402
from pop_core.training.scene_stream import SceneStream  # noqa: E402
from pop_core.training.scene_writer import SceneKind, write_shards  # noqa: E402
from pop_core.training.targets import make_targets  # noqa: E402
from pop_core.training.trainer import (  # noqa: E402
    CheckpointError,
    TrainConfig,
    Trainer,
    load_network,
)
from pop_core.training.validation import MapScores  # noqa: E402

ROOT = Path(__file__).parents[3]
TINY = NetworkConfig(
    widths=(4, 8, 8, 12, 12), blocks=(1, 1, 1, 1), pyramid=16, focal_px=80.0)
SIZE = (96, 64)


@pytest.fixture(scope='module')
def batch(small_scenes):
    pool = ScenePool(len(small_scenes), torch.device('cpu'))
    pool.add(pack(small_scenes))
    drawn = pool.at(range(8))
    rows, columns = slice(8, 72), slice(8, 104)
    return type(drawn)(
        drawn.depth_m[:, rows, columns], drawn.labels[:, rows, columns], drawn.points,
        drawn.visible, drawn.lens - torch.tensor([0.0, 0.0, 8.0, 8.0]))


def trainer(**changes):
    torch.manual_seed(0)
    return Trainer(torch.device('cpu'), TINY, TrainConfig(warm_up=1, rate=5e-3, **changes))


def true_maps(targets, log_sigma=-3.0):
    """Return maps that say exactly the targets."""
    n, h, w = targets.part.shape
    parts = torch.nn.functional.one_hot(targets.part, 16).permute(0, 3, 1, 2) * 20.0
    votes, visible = torch.zeros(n, h, w, 45), torch.zeros(n, h, w, 15)
    votes[targets.person] = targets.votes.reshape(-1, 45)
    visible[targets.person] = targets.visible * 40.0 - 20.0
    sigma = torch.full((n, 15, h, w), log_sigma)
    return DepthMaps(parts, votes.permute(0, 3, 1, 2), sigma, visible.permute(0, 3, 1, 2))


def test_the_truth_is_the_least_of_losses(batch):
    targets = make_targets(batch)
    best = losses(true_maps(targets), targets)
    assert float(best['parts']) < 1e-3
    assert float(best['visible']) < 1e-3
    assert float(best['dice']) < 1e-2
    worse = true_maps(targets)._replace(votes=true_maps(targets).votes + 0.02)
    assert float(losses(worse, targets)['votes']) > float(best['votes'])


def test_a_sigma_that_fits_the_error_costs_least(batch):
    targets = make_targets(batch)
    cost = {}
    for sigma in (0.01, 0.05, 0.25):
        maps = true_maps(targets, float(np.log(sigma)))
        wrong = maps._replace(votes=maps.votes + 0.05)
        cost[sigma] = float(losses(wrong, targets)['votes'])
    assert min(cost, key=cost.get) == 0.05


def test_perfect_maps_score_full_marks(batch):
    targets = make_targets(batch)
    scores = MapScores()
    scores.add(true_maps(targets), targets)
    figures = scores.figures()
    assert figures['pck_visible'] == figures['pck_hidden'] == 1.0
    assert figures['person_iou'] == figures['sight'] == 1.0


@pytest.mark.parametrize('shape', [(8, 20), (20, 8), (6, 12)], ids=str)
def test_the_steps_of_matrices_turn_and_do_not_stretch(shape):
    torch.manual_seed(3)
    matrix = torch.randn(shape)
    singular = torch.linalg.svdvals(orthogonal(matrix))
    assert 0.6 < singular.min() < singular.max() < 1.3  # what the quintic's iterates keep to
    u, _, vt = torch.linalg.svd(matrix, full_matrices=False)
    assert ((u @ vt) * orthogonal(matrix)).sum() > 0.75 * min(shape)


def test_training_lowers_every_loss(batch):
    learner = trainer()
    first = learner.step(batch)
    for _ in range(25):
        last = learner.step(batch)
    assert float(last['parts']) < 0.8 * float(first['parts'])
    assert float(last['votes']) < float(first['votes']) - 0.2


def test_a_run_that_went_on_is_a_run_that_never_stopped(batch, tmp_path):
    whole, parted = trainer(), trainer()
    for _ in range(4):
        whole.step(batch)
    for _ in range(2):
        parted.step(batch)
    parted.save(tmp_path / 'checkpoint.pt')
    resumed = Trainer(torch.device('cpu'), TINY, parted.config)
    resumed.load(tmp_path / 'checkpoint.pt')
    for _ in range(2):
        resumed.step(batch)
    assert (resumed.steps, resumed.images) == (whole.steps, whole.images)
    for name, value in whole.averaged.state_dict().items():
        torch.testing.assert_close(resumed.averaged.state_dict()[name], value)


def test_a_training_of_another_look_is_not_gone_on_with(batch, tmp_path):
    learner = trainer()
    learner.step(batch)
    learner.save(tmp_path / 'checkpoint.pt')
    learner.save_weights(tmp_path / 'weights.pt')
    close = Trainer(torch.device('cpu'), replace(TINY, shown_at_m=2.0))
    with pytest.raises(CheckpointError, match=r'expected a training of .*shown_at_m=2\.0'):
        close.load(tmp_path / 'checkpoint.pt')
    close.load(tmp_path / 'weights.pt')
    assert (close.images, close.history) == (0, [])
    learned = learner.averaged.state_dict()
    for name, value in close.averaged.state_dict().items():
        torch.testing.assert_close(value, learned[name], atol=1e-2, rtol=1e-2)


def test_weights_in_half_precision_are_small_and_say_nearly_the_same(batch, tmp_path):
    learner = trainer()
    learner.step(batch)
    learner.save_weights(tmp_path / 'weights.pt')
    with torch.no_grad():
        whole = learner.averaged(batch.depth_m[:, None])
        half = load_network(tmp_path / 'weights.pt')(batch.depth_m[:, None])
    torch.testing.assert_close(half.parts, whole.parts, atol=0.05, rtol=0.05)
    full = Trainer(torch.device('cpu'))
    full.save_weights(tmp_path / 'full.pt')
    assert (tmp_path / 'full.pt').stat().st_size < 8e6


@pytest.mark.parametrize('name', ['small', 'close'])
def test_the_shipped_networks_are_their_weights(name):
    """What is trained on from the committed weights is what users run."""
    weights = ROOT / f'pop_core/training/depth_net_{name}.pt'
    shipped = EMBEDDED if name == 'small' else close_path(EMBEDDED)
    assert largest_difference(load_network(weights), shipped) < 1e-3


def test_a_file_that_says_something_else_is_found_out(tmp_path):
    torch.manual_seed(1)
    network, other = DepthNet(TINY).eval(), DepthNet(TINY).eval()
    export_onnx(network, tmp_path / 'net.onnx')
    assert largest_difference(network, tmp_path / 'net.onnx') < 1e-3
    assert largest_difference(other, tmp_path / 'net.onnx') > 1e-2
    with torch.no_grad():
        next(network.parameters())[:] = np.nan
    with pytest.raises(ExportError, match='found them nan apart'):
        export_onnx(network, tmp_path / 'nan.onnx')
    assert not (tmp_path / 'nan.onnx').exists()


@pytest.mark.parametrize('size', [(64, 96), (160, 192)], ids=str)
def test_onnx_says_what_torch_says(size, tmp_path, batch):
    learner = trainer()
    for _ in range(3):
        learner.step(batch)
    network = learner.averaged.eval()
    export_onnx(network, tmp_path / 'net.onnx', 'a test')
    depth_m = torch.rand(1, 1, *size) * 4.0 * (torch.rand(1, 1, *size) > 0.1)
    with torch.no_grad():
        expected = network(depth_m)
    session = load_onnx(tmp_path / 'net.onnx')
    for found, wanted in zip(session.run(depth_m.numpy()), expected, strict=True):
        np.testing.assert_allclose(found, wanted.numpy(), atol=1e-3)
    assert session.facts['focal_px'] == '80.0'
    loaded = DepthNetwork(session)
    assert (loaded.focal_px, loaded.is_close) == (80.0, False)


def test_a_network_of_near_looks_says_where_people_are_to_be_shown(tmp_path):
    network = DepthNet(replace(TINY, shown_at_m=1.75))
    export_onnx(network, tmp_path / 'net.onnx')
    loaded = DepthNetwork(load_onnx(tmp_path / 'net.onnx'))
    assert loaded.is_close
    assert loaded.enlarged(3.5) == 2.0


def test_relief_is_the_same_near_and_far():
    steps = torch.zeros(1, 1, 64, 64)
    steps[..., 32:] = 0.05
    near, far = relief_channels(steps + 1.5), relief_channels(steps + 3.5)
    torch.testing.assert_close(near[:, 2:], far[:, 2:], atol=1e-4, rtol=0)
    assert near[:, 2].abs().max() > 0.2


def test_what_was_not_measured_is_zero_in_every_channel(batch):
    channels = relief_channels(batch.depth_m[:, None])
    missing = (batch.depth_m == 0)[:, None].expand_as(channels)
    assert (channels[missing] == 0).all()


def test_a_run_writes_checkpoint_history_and_curves(small_scenes, tmp_path):
    save_shard(pack(small_scenes), tmp_path / 'scenes' / 'a.npz')
    said = []
    run = RunConfig(
        tmp_path / 'run', 0.02, size=SIZE, scenes=tmp_path / 'scenes',
        validation=tmp_path / 'scenes', cooldown=0.5)
    for _ in range(2):
        train(trainer(batch=4), run, said.append)
    assert any('going on after' in line for line in said)
    assert {'checkpoint.pt', 'history.json', 'curves.png'} <= {
        path.name for path in (tmp_path / 'run').iterdir()}
    assert set(validate(trainer(), run)) == {
        'pck_visible', 'pck_hidden', 'part_iou', 'person_iou', 'sight'}


def test_workers_draw_scenes_meanwhile(tmp_path):
    said = []
    run = RunConfig(tmp_path / 'run', 0.01, size=SIZE, workers=1, capacity=1100)
    train(trainer(batch=2), run, said.append)
    assert (tmp_path / 'run' / 'checkpoint.pt').exists()


def test_a_damaged_checkpoint_is_told(tmp_path):
    (tmp_path / 'a.pt').write_bytes(b'nothing')
    with pytest.raises(CheckpointError, match='expected a checkpoint'):
        load_network(tmp_path / 'a.pt')


def test_weights_of_another_size_are_told(tmp_path):
    trainer().save(tmp_path / 'a.pt')
    trainer().save_weights(tmp_path / 'w.pt')
    other = Trainer(torch.device('cpu'))
    with pytest.raises(CheckpointError, match='expected a training of'):
        other.load(tmp_path / 'a.pt')
    with pytest.raises(CheckpointError, match='expected weights of a network'):
        other.load(tmp_path / 'w.pt')


@pytest.mark.parametrize('config', [
    {'layers': 3}, {'widths': 'many'}, {'widths': [10**9] * 5, 'blocks': [1] * 4},
    {'widths': [4] * 5, 'blocks': [10**9] * 4}, {'blocks': [10**9, -10**9, 1, 1]},
    {'widths': [4] * 10**5, 'blocks': [0] * (10**5 - 1)}, [1, 2]])
def test_a_checkpoint_that_states_no_size_of_its_weights_is_told(tmp_path, config):
    trainer().save_weights(tmp_path / 'w.pt')
    state = torch.load(tmp_path / 'w.pt', weights_only=True)
    torch.save(state | {'network_config': config}, tmp_path / 'w.pt')
    with pytest.raises(CheckpointError, match='expected weights of a depth network'):
        load_network(tmp_path / 'w.pt')
    with pytest.raises(CheckpointError, match='expected weights of a depth network'):
        trainer().load(tmp_path / 'w.pt')


@pytest.mark.parametrize('missing', ['images', 'history', 'averaged'])
def test_a_checkpoint_that_lacks_something_is_told(tmp_path, missing):
    trainer().save_weights(tmp_path / 'w.pt')
    state = torch.load(tmp_path / 'w.pt', weights_only=True)
    del state[missing]
    torch.save(state, tmp_path / 'w.pt')
    with pytest.raises(CheckpointError, match='expected a checkpoint of the depth network'):
        trainer().load(tmp_path / 'w.pt')


def test_a_checkpoint_with_other_optimisers_is_told(tmp_path):
    trainer().save(tmp_path / 'a.pt')
    state = torch.load(tmp_path / 'a.pt', weights_only=True)
    torch.save(state | {'optimisers': {'momentum': {}}}, tmp_path / 'a.pt')
    with pytest.raises(CheckpointError, match='expected weights of a network'):
        trainer().load(tmp_path / 'a.pt')


def test_scenes_of_another_size_in_the_way_are_told(small_scenes, tmp_path):
    save_shard(pack(small_scenes[:2]), tmp_path / '0001_00000.npz')
    with pytest.raises(ShardError, match='scenes of 208x176, found 112x80'):
        list(write_shards(tmp_path, 512, seed=1, kind=SceneKind((192, 160), 160.0)))


def test_scenes_smaller_than_the_networks_input_are_told(small_scenes, tmp_path):
    save_shard(pack(small_scenes[:2]), tmp_path / 'scenes' / 'a.npz')
    run = RunConfig(tmp_path / 'run', 0.01, size=(192, 160), scenes=tmp_path / 'scenes')
    with pytest.raises(ShardError, match='scenes of 208x176, found 112x80'):
        train(trainer(), run, lambda _: None)


def take_many(stream):
    for _ in range(20):
        stream.take(timeout_s=3.0)


def test_processes_that_end_are_told(tmp_path):
    kind = SceneKind(SIZE, 80.0, mocap=tmp_path / 'no_motions.npz')
    stream = SceneStream(1, 0, kind)
    with stream, pytest.raises(ShardError, match='1 ended'):
        take_many(stream)
