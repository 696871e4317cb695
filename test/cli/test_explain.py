"""`pop fit --explain`: pictures that explain a fit."""

import shutil
import sys
from pathlib import Path

import cv2
import pytest

from pop_core.body.default_body import default_body
from pop_core.synthesis.scene_files import save_scene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.cli import main


@pytest.fixture(scope='module')
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a synthetic frame with its truth, and of the same without."""
    root = tmp_path_factory.mktemp('explain')
    scene = synthesise_sequence(default_body(), 4, 3, rate_hz=4.0)[1]
    save_scene(scene, root / 'in' / 'with_truth')
    shutil.copytree(root / 'in' / 'with_truth', root / 'in' / 'without')
    (root / 'in' / 'without' / 'truth.npz').unlink()
    arguments = ['pop', 'fit', str(root / 'in'), '--out', str(root / 'out'), '--explain']
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, 'argv', arguments)
        with pytest.raises(SystemExit) as end:
            main()
    assert end.value.code == 0
    return root / 'out'


def test_energies_are_drawn_for_every_fit(results: Path) -> None:
    for name in ('with_truth', 'without'):
        picture = cv2.imread(str(results / name / 'energies_0.png'))
        assert picture is not None
        assert (picture < 60).all(axis=2).sum() > 500  # the winner's line


def test_errors_are_drawn_where_the_truth_is_known(results: Path) -> None:
    picture = cv2.imread(str(results / 'with_truth' / 'errors.png'))
    overlay = cv2.imread(str(results / 'with_truth' / 'overlay.png'))
    assert picture.shape[1] > overlay.shape[1] // 2
    assert not (results / 'without' / 'errors.png').exists()
