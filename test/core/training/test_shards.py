"""Packed training scenes come back as they were."""

import numpy as np
import pytest

from pop_core.keypoints.body_parts import CLASS_MIRROR, CLASS_OF_LABEL, LABEL_OF_CLASS
from pop_core.training.shards import (
    OWNER_SHIFT,
    ShardError,
    load_shard,
    pack,
    save_shard,
    shard_paths,
)


def test_a_saved_shard_is_loaded_unchanged(small_scenes, tmp_path):
    shard = pack(small_scenes)
    save_shard(shard, tmp_path / 'a.npz')
    loaded = load_shard(shard_paths(tmp_path)[0])
    for name in ('depth_mm', 'labels', 'points', 'visible', 'lens'):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(shard, name))


def test_labels_tell_part_and_person_apart(small_scenes):
    shard = pack(small_scenes)
    for row, scene in enumerate(small_scenes):
        labels = shard.labels[row]
        np.testing.assert_array_equal((labels >> OWNER_SHIFT).astype(int) - 1, scene.owner)
        np.testing.assert_array_equal(labels & 15, CLASS_OF_LABEL[scene.part_labels])


def test_depth_is_kept_to_the_millimetre(small_scenes):
    shard = pack(small_scenes)
    depth_m = np.nan_to_num(np.stack([scene.depth_m for scene in small_scenes]))
    np.testing.assert_allclose(shard.depth_mm / 1e3, depth_m, atol=6e-4)


def test_classes_and_labels_are_inverse_on_the_parts_that_stand_for_others():
    np.testing.assert_array_equal(CLASS_OF_LABEL[LABEL_OF_CLASS], np.arange(16))
    np.testing.assert_array_equal(CLASS_MIRROR[CLASS_MIRROR], np.arange(16))


def no_archive(path, _shard):
    path.write_bytes(b'no zip')


def cut_short(path, shard):
    save_shard(shard, path)
    path.write_bytes(path.read_bytes()[:-200])


def one_array(path, shard):
    with path.open('wb') as file:
        np.save(file, shard.lens)


def flat_depth(path, shard):
    np.savez(path, **(vars_of(shard) | {'depth_mm': shard.depth_mm[0]}))


def fewer_labels(path, shard):
    np.savez(path, **(vars_of(shard) | {'labels': shard.labels[:-1]}))


def vars_of(shard):
    return {name: getattr(shard, name) for name in type(shard).__slots__}


@pytest.mark.parametrize('damage', [no_archive, cut_short, one_array, flat_depth, fewer_labels])
def test_a_damaged_shard_is_told(small_scenes, tmp_path, damage):
    damage(tmp_path / 'a.npz', pack(small_scenes[:2]))
    with pytest.raises(ShardError, match=r'a\.npz: expected packed training scenes'):
        load_shard(tmp_path / 'a.npz')


def test_a_folder_without_scenes_says_how_to_make_some(tmp_path):
    with pytest.raises(ShardError, match=r'pop_core\.training scenes'):
        shard_paths(tmp_path)
