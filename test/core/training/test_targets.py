"""What the network is taught: the truth of cells, whichever way a batch is varied."""

import numpy as np
import pytest
from support.depth_maps import truth_maps

from pop_core.keypoints.depth_votes import read_votes
from pop_core.training.shards import pack

torch = pytest.importorskip('torch')

from pop_core.body.joints import SHARED_MIRROR  # noqa: E402 - torch first
from pop_core.keypoints.body_parts import CLASS_MIRROR  # noqa: E402
from pop_core.training.augmentation import cropped, mirrored, scaled, varied  # noqa: E402
from pop_core.training.scene_pool import ScenePool, hidden_share  # noqa: E402
from pop_core.training.targets import make_targets  # noqa: E402


@pytest.fixture(scope='module')
def batch(small_scenes):
    pool = ScenePool(len(small_scenes), torch.device('cpu'))
    pool.add(pack(small_scenes))
    return pool.at(range(len(small_scenes)))


def test_targets_are_those_of_the_slow_twin(batch, small_scenes):
    targets = make_targets(batch)
    start = 0
    for row, scene in enumerate(small_scenes):
        parts, votes, _, visible = truth_maps(scene)
        person = parts[1:].max(axis=0) > 0
        np.testing.assert_array_equal(targets.person[row].numpy(), person)
        np.testing.assert_array_equal(
            targets.part[row].numpy()[person], parts.argmax(axis=0)[person])
        end = start + person.sum()
        front = targets.known[start:end].numpy()
        slow = votes.reshape(15, 3, *person.shape)[:, :, person].transpose(2, 0, 1)
        np.testing.assert_allclose(
            targets.votes[start:end].numpy()[front], slow[front], atol=2e-3)  # millimetres kept
        sight = visible[:, person].T > 0
        np.testing.assert_array_equal(targets.visible[start:end].numpy()[front], sight[front])
        start = end
    assert start > 300


def test_votes_are_read_as_they_are_taught(batch, small_scenes):
    targets = make_targets(batch)
    first = int(torch.nonzero(targets.person.any(dim=(1, 2)))[0])
    before = int(targets.person[:first].sum())
    row, column = np.nonzero(targets.person[first].numpy())
    mine = slice(before, before + len(row))
    maps = np.zeros((45, *targets.person.shape[1:]), dtype=np.float32)
    maps[:, row, column] = targets.votes[mine].reshape(len(row), 45).T
    depth_m = batch.depth_m[first].numpy()
    filled = np.where(depth_m > 0, depth_m, np.inf)
    h, w = filled.shape
    nearest = filled.reshape(h // 4, 4, w // 4, 4).min(axis=(1, 3))[row, column]
    points = read_votes(maps, row, column, nearest, small_scenes[first].camera)
    owner = (targets.who[mine] % 6).numpy()
    truth = batch.points[first].numpy()[owner]
    known = targets.known[mine].numpy()
    np.testing.assert_allclose(points[known], truth[known], atol=5e-3)


def test_a_mirror_of_a_mirror_is_the_scene(batch):
    again = mirrored(mirrored(batch))
    for name in ('depth_m', 'labels', 'points', 'visible', 'lens'):
        torch.testing.assert_close(getattr(again, name), getattr(batch, name))


def test_a_mirrored_batch_has_mirrored_targets(batch):
    targets, other = make_targets(batch), make_targets(mirrored(batch))
    torch.testing.assert_close(other.person, targets.person.flip(2))
    swapped = torch.as_tensor(CLASS_MIRROR)[targets.part.flip(2)]
    person = other.person
    # Of equally near pixels of a cell the first counts, and a mirror changes which is first.
    assert (other.part[person] == swapped[person]).float().mean() > 0.97
    index = torch.full(person.shape, -1)
    index[targets.person] = torch.arange(len(targets.who))
    row = index.flip(2)[person]
    same = other.who == targets.who[row]
    expected = targets.votes[row][:, torch.as_tensor(SHARED_MIRROR)] * torch.tensor([-1.0, 1, 1])
    known = other.known & same[:, None]
    torch.testing.assert_close(other.votes[known], expected[known], atol=1e-4, rtol=1e-4)


def test_a_scaled_world_looks_the_same_with_longer_votes(batch):
    targets, other = make_targets(batch), make_targets(scaled(batch, torch.full((12,), 1.1)))
    torch.testing.assert_close(other.person, targets.person)
    known = targets.known & other.known
    torch.testing.assert_close(
        other.votes[known], targets.votes[known] * 1.1, atol=1e-4, rtol=1e-4)


def test_a_crop_by_whole_cells_keeps_the_votes(batch):
    targets, other = make_targets(batch), make_targets(cropped(batch, 8, 4, (96, 64)))
    inside = targets.person[:, 1:17, 2:26]
    torch.testing.assert_close(other.person, inside)
    index = torch.full(targets.person.shape, -1)
    index[targets.person] = torch.arange(len(targets.who))
    torch.testing.assert_close(
        other.votes, targets.votes[index[:, 1:17, 2:26][inside]], atol=1e-5, rtol=1e-5)


def test_variations_are_decided_by_their_generator(batch):
    first, second = (
        varied(batch, (96, 64), torch.Generator().manual_seed(4)) for _ in range(2))
    torch.testing.assert_close(first.depth_m, second.depth_m)
    assert first.depth_m.shape == (12, 64, 96)
    assert (first.depth_m >= 0).all()


def test_a_full_pool_forgets_the_oldest(small_scenes):
    pool = ScenePool(8, torch.device('cpu'))
    pool.add(pack(small_scenes[:6]))
    pool.add(pack(small_scenes[6:12]))
    kept = pool.at([0, 3, 6])
    wanted = pack([small_scenes[8], small_scenes[11], small_scenes[6]])
    np.testing.assert_array_equal(
        np.rint(kept.depth_m.numpy() * 1e3), wanted.depth_mm.clip(0, 32767))


def test_the_curriculum_begins_with_people_in_plain_view(small_scenes):
    shard = pack(small_scenes)
    pool = ScenePool(12, torch.device('cpu'))
    pool.add(shard)
    share = hidden_share(shard)
    limit = float(share.median())
    allowed = torch.from_numpy(shard.lens)[share <= limit]
    generator = torch.Generator().manual_seed(0)
    for _ in range(10):
        drawn = pool.draw(len(allowed), generator, limit)
        assert all((lens == allowed).all(dim=1).any() for lens in drawn.lens)
    assert share.max() > limit
