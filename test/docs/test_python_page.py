"""The program that docs/python.md shows, run block by block."""

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from support.smpl_files import slow_skinning

from pop_core import errors
from pop_core.body import smpl_import
from pop_core.body.default_body import default_body
from pop_core.body.joints import COCO_17_NAMES, PARENTS, SHARED_INDEX
from pop_core.estimate import BodyEstimate
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.depth_consistency import DEPTH_LIMIT_M
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import save_library
from pop_core.tracking.tracker import SHORTEST_GAP_NS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / 'docs' / 'python.md').read_text(encoding='utf-8')
BLOCKS = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
ROWS = re.findall(r'^\| (.+?) \|', PAGE, re.MULTILINE)


def smpl_arrays() -> dict[str, np.ndarray]:
    """The default body as if it were published as SMPL is."""
    body = default_body()
    tree = np.stack([np.array(PARENTS), np.arange(24)]).astype(np.uint32)
    return {
        'v_template': body.v_template, 'shapedirs': body.shapedirs, 'f': body.f,
        'weights': body.weights, 'J_regressor': body.J_regressor, 'kintree_table': tree,
        'posedirs': np.zeros((len(body.v_template), 3, 207))}


class Tensor(np.ndarray):
    """As much of a torch tensor as the page asks for."""

    def detach(self) -> 'Tensor':
        return self

    def numpy(self) -> np.ndarray:
        return np.asarray(self)


def stand_in_torch() -> ModuleType:
    torch = ModuleType('torch')
    torch.float32 = np.float32
    torch.tensor = lambda values, dtype: np.array(values, dtype).view(Tensor)
    return torch


def stand_in_smplx() -> ModuleType:
    """The forward function of smplx's SMPL layer, joint by joint, without translation."""
    def create(path: str, model_type: str) -> object:
        with np.load(path) as archive:
            arrays = dict(archive)

        def layer(betas: Tensor, global_orient: Tensor, body_pose: Tensor) -> object:
            assert (betas.shape, global_orient.shape, body_pose.shape) == (
                (1, 10), (1, 3), (1, 69))
            rotvecs = np.vstack([global_orient, body_pose.reshape(23, 3)]).astype(np.float64)
            posed = slow_skinning(arrays, np.asarray(rotvecs), np.asarray(betas[0]))
            return SimpleNamespace(vertices=posed[None].view(Tensor))
        return layer

    smplx = ModuleType('smplx')
    smplx.create = create
    return smplx


def truth_of(space: dict[str, object]) -> object:
    """A network that sees the people of the page's scene where they are."""
    def my_network(rgb: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        people = []
        for person in space['scene'].people:
            seen = space['scene'].frame.camera.project(person.shared_points)
            px, scores = np.zeros((17, 2)), np.zeros(17)
            for row, name in enumerate(COCO_17_NAMES):
                joint = SHARED_INDEX.get('head' if name == 'nose' else name)
                if joint is not None and person.shared_state[joint] == 0:
                    px[row], scores[row] = seen[joint], 0.9
            people.append((px, scores))
        return people
    return my_network


@pytest.fixture(scope='module')
def space(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """What the program of the page has defined when it ends."""
    folder = tmp_path_factory.mktemp('page')
    np.savez(folder / 'SMPL_NEUTRAL.npz', **smpl_arrays())
    save_library(default_library().subset(np.arange(0, 150_000, 50)), folder / 'poses.poplib')
    space: dict[str, object] = {'folder': folder}
    space['my_network'] = truth_of(space)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setitem(sys.modules, 'torch', stand_in_torch())
        patch.setitem(sys.modules, 'smplx', stand_in_smplx())
        # The coarse mesh of the same body is known, and takes seconds to find under type checks.
        body = default_body()
        patch.setattr(smpl_import, 'decimate', lambda *_: (body.fit_vertices, body.fit_faces))
        for number, block in enumerate(BLOCKS):
            exec(compile(block, f'docs/python.md, block {number}', 'exec'), space)
    return space


def test_the_program_finds_the_people_of_its_scene(space: dict[str, object]) -> None:
    found, people = space['result'].bodies, space['scene'].people
    assert len(found) == len(people) == 3
    for body in found:
        off = [np.linalg.norm(body.joints - p.joints, axis=1).mean() for p in people]
        assert min(off) < 0.1


def test_the_formula_for_smplx_holds(space: dict[str, object]) -> None:
    # Offsets of some betas, each stored as float16: 2^-11 of a few centimetres.
    assert space['off_m'].max() < 1e-3
    assert space['p'].scale != 1.0


def test_the_files_of_a_result_are_all_described(space: dict[str, object]) -> None:
    folder = space['folder']
    assert (folder / 'picture.png').is_file()
    said = set(re.findall(r'`(\w+)`', PAGE))
    parameters = ('transl', 'global_orient', 'body_pose', 'betas', 'scale')
    others = {f'runners_up_{name}' for name in parameters}
    assert set(space['saved']) - others <= said
    assert set(space['summary']) | set(space['summary']['people'][0]) <= said


def test_the_tables_have_every_field_energy_and_error() -> None:
    cells = set(re.findall(r'`(\w+)`', ' '.join(ROWS)))
    assert {field.name for field in fields(BodyEstimate)} <= cells
    raised = {name for name, kind in vars(errors).items()
              if isinstance(kind, type) and kind.__base__ is errors.PopError}
    assert raised <= cells


def test_the_table_has_the_energies_of_a_fit(space: dict[str, object]) -> None:
    assert {cell.strip('`') for cell in ROWS if cell.startswith('`E_')} == set(
        space['body'].energies)


def test_the_page_states_the_constants_in_force() -> None:
    assert f'exp(−excess / {SINGLE_FRAME.rival_cost})' in PAGE  # noqa: RUF001 - a minus sign
    assert f'each at most {DEPTH_LIMIT_M} m' in PAGE
    assert f'less than {SHORTEST_GAP_NS * 1e-6:.0f} ms after' in PAGE


def test_what_the_page_imports_needs_no_ros() -> None:
    named = sorted(set(re.findall(r'^from (pop_[\w.]+) import', PAGE, re.MULTILINE)))
    blocked = "import sys; sys.modules.update(dict.fromkeys(('rclpy', 'sensor_msgs', 'rosbags')))"
    script = f'{blocked}; import {", ".join(named)}'
    subprocess.run([sys.executable, '-c', script], check=True, cwd=ROOT)
