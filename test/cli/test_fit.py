"""`pop fit` as its users call it, in this process; a real pipeline on a small frame."""

import json
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from cli.conftest import write_frame
from support.estimates import CAMERA, estimate
from typer.testing import CliRunner

from pop_core.body.default_body import default_body
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyParameters
from pop_core.body.model_digest import model_digest
from pop_core.body.skinning import vertices
from pop_core.errors import PopError
from pop_core.estimate import FrameResult, Track, TrackState
from pop_core.retrieval.retrieve import RetrievalConfig
from pop_ros.cli import build_app
from pop_ros.result_folder import person_arrays, result_json, status_sentence
from pop_ros.warm_up import PLACE

ARRAYS = {
    'joints': ((24, 3), 'f'), 'global_orient': ((3,), 'f'), 'body_pose': ((23, 3), 'f'),
    'transl': ((3,), 'f'), 'betas': ((10,), 'f'), 'scale': ((), 'f'), 'score': ((), 'f'),
    'joint_state': ((24,), 'i'), 'joint_covariance': ((24, 3, 3), 'f'), 'mask': ((120, 160), 'b'),
    'joint_rotations': ((24, 3, 3), 'f'),
}
RUNNERS_UP = {
    'transl': ((3,), 'f'), 'global_orient': ((3,), 'f'), 'body_pose': ((23, 3), 'f'),
    'betas': ((10,), 'f'), 'scale': ((), 'f'), 'excess_cost': ((), 'f'), 'finished': ((), 'b'),
}


def fit(*arguments):
    return CliRunner().invoke(build_app('fit'), ['fit', *map(str, arguments)])


@pytest.fixture(scope='module')
def fitted(tmp_path_factory, scene):
    root = tmp_path_factory.mktemp('fit')
    frame, person = scene
    write_frame(root / 'set' / 'one', frame, [person])
    write_frame(root / 'set' / 'deep' / 'nobody', frame, [])
    result = fit(root / 'set', '--out', root / 'out')
    assert result.exit_code == 0, (result.output, result.exception)
    return root / 'out'


def test_every_frame_gets_a_folder_of_its_relative_path(fitted):
    files = sorted(p.relative_to(fitted).as_posix() for p in fitted.rglob('*') if p.is_file())
    assert files == [
        'deep/nobody/overlay.png', 'deep/nobody/result.json',
        'one/overlay.png', 'one/person_0.npz', 'one/result.json']


def test_a_person_file_holds_the_promised_arrays(fitted):
    person = np.load(fitted / 'one' / 'person_0.npz', allow_pickle=False)
    model = default_body()
    v, f = len(model.v_template), len(model.f)
    meshes = {
        'vertices': ((v, 3), 'f'), 'tpose_vertices': ((v, 3), 'f'), 'faces': ((f, 3), 'i')}
    k = RetrievalConfig().candidates - 1
    others = {f'runners_up_{n}': ((k, *shape), kind) for n, (shape, kind) in RUNNERS_UP.items()}
    expected = {**ARRAYS, **meshes, **others}
    assert {k: (person[k].shape, person[k].dtype.kind) for k in person.files} == expected
    assert all(np.isfinite(person[k]).all() for k in person.files)
    assert set(np.unique(person['joint_state'])) <= set(range(5))


def test_parameters_of_a_person_file_give_its_mesh_and_joints(fitted):
    person = np.load(fitted / 'one' / 'person_0.npz')
    model = default_body()
    parameters = BodyParameters(
        person['transl'], person['global_orient'], person['body_pose'], person['betas'],
        float(person['scale']))
    # float32 in the file: a tenth of a micrometre at a few metres
    np.testing.assert_allclose(vertices(model, parameters), person['vertices'], atol=1e-6)
    np.testing.assert_allclose(joints(model, parameters), person['joints'], atol=1e-9)
    upright = parameters.replaced(
        transl=np.zeros(3), global_orient=np.zeros(3), body_pose=np.zeros((23, 3)))
    np.testing.assert_allclose(vertices(model, upright), person['tpose_vertices'], atol=1e-6)


def test_the_fitted_person_stands_where_the_true_one_does(fitted):
    person = np.load(fitted / 'one' / 'person_0.npz')
    # global_orient turns about the pelvis, so the pelvis itself stays where transl puts it
    truth = default_body().joint_template[0] + PLACE
    assert np.linalg.norm(person['joints'][0] - truth) < 0.05


def test_result_json_says_what_was_found(fitted):
    one = json.loads((fitted / 'one' / 'result.json').read_text())
    assert one['status'] == '1 person fitted'
    assert [p['file'] for p in one['people']] == ['person_0.npz']
    assert 'E_depth' in one['people'][0]['energies']
    excess = [other['excess_cost'] for other in one['people'][0]['runners_up']]
    assert len(excess) == RetrievalConfig().candidates - 1
    assert excess == sorted(excess)
    assert one['body'] == {'name': 'default', 'digest': model_digest(default_body())}
    assert one['camera']['width'] == 160
    assert one['times_ms']['fit'] > 0
    nobody = json.loads((fitted / 'deep' / 'nobody' / 'result.json').read_text())
    assert nobody['status'] == 'nobody found'
    assert nobody['people'] == []


def test_a_person_who_is_followed_is_named():
    model = default_body()
    track = Track(7, TrackState.PREDICTED, 3.0, 0.5, np.full(24, 0.5))
    body = replace(estimate(model), track=track)
    arrays = person_arrays(body, model)
    assert (arrays['track_id'], arrays['track_state']) == (7, TrackState.PREDICTED)
    assert arrays['joint_unseen_s'].shape == (24,)
    content = result_json(FrameResult((body,), (), {}), model, CAMERA)
    assert content['people'][0]['track'] == {'id': 7, 'state': 'predicted'}
    assert 'track' not in result_json(
        FrameResult((estimate(model),), (), {}), model, CAMERA)['people'][0]


def test_the_overlay_shows_four_panels(fitted):
    picture = cv2.imread(str(fitted / 'one' / 'overlay.png'))
    assert picture.shape[0] > 2 * 120
    assert picture.shape[1] > 2 * 160


def test_bad_inputs_get_one_line_each_and_the_good_one_is_done(tmp_path, scene):
    good = write_frame(tmp_path / 'good', scene[0], [])
    cut = write_frame(tmp_path / 'cut', scene[0], [])
    content = (cut / 'depth.png').read_bytes()
    (cut / 'depth.png').write_bytes(content[: len(content) // 2])
    json_cut = write_frame(tmp_path / 'json_cut', scene[0], [])
    (json_cut / 'keypoints.json').write_text('{"people": [')
    unsourced = write_frame(tmp_path / 'unsourced', scene[0], None)
    result = fit(
        tmp_path / 'missing', cut, json_cut, unsourced, good, '--out', tmp_path / 'out',
        '--keypoints', 'json')
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 4
    for line, name in zip(lines, ['missing', 'cut', 'json_cut', 'unsourced'], strict=True):
        assert name in line
        assert 'expected' in line
        assert 'found' in line
    assert [p.name for p in (tmp_path / 'out').iterdir()] == ['good']


def test_results_of_an_earlier_run_do_not_stay(tmp_path, scene):
    frame = write_frame(tmp_path / 'frame', scene[0], [])
    stale = tmp_path / 'out' / 'frame' / 'person_7.npz'
    stale.parent.mkdir(parents=True)
    stale.touch()
    assert fit(frame, '--out', tmp_path / 'out').exit_code == 0
    assert not stale.exists()


def test_two_inputs_of_one_name_do_not_overwrite_each_other(tmp_path, scene):
    a, b = (write_frame(tmp_path / k / 'frame', scene[0], []) for k in 'ab')
    result = fit(a, b, '--out', tmp_path / 'out')
    assert result.exit_code == 2
    assert 'expected a name of its own' in result.stderr


def test_an_output_that_is_a_file_is_a_bad_input_not_a_crash(tmp_path, scene):
    frame = write_frame(tmp_path / 'frame', scene[0], [])
    (tmp_path / 'out').touch()
    result = fit(frame, '--out', tmp_path / 'out')
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (['--keypoints', 'nothing.onnx'], 'nothing.onnx, which is not there'),
        (['--set', 'max_people'], 'expected NAME=VALUE'),
        (['--set', 'max_people=many'], 'max_people: expected int'),
        (['--set', 'max_people=0'], 'max_people: expected 1 to'),
        (['--set', 'no.such=1'], 'unknown name'),
    ],
    ids=['network', 'flag', 'type', 'range', 'name'],
)
def test_a_bad_option_is_refused_by_name(tmp_path, scene, arguments, sentence):
    frame = write_frame(tmp_path / 'frame', scene[0], [])
    result = fit(frame, '--out', tmp_path / 'out', *arguments)
    assert isinstance(result.exception, PopError)
    assert sentence in str(result.exception)


def test_a_refused_option_ends_in_one_line_and_code_2(tmp_path):
    command = [sys.executable, '-m', 'pop_ros.cli', 'fit', tmp_path, '--out', tmp_path / 'out']
    result = subprocess.run(
        [*command, '--set', 'no.such=1'], capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert len(result.stderr.strip().splitlines()) == 1


def test_pop_fit_loads_no_ros():
    script = (
        'import sys; from pop_ros.cli import build_app; build_app("fit"); '
        'import pop_ros.sources, pop_ros.result_folder, pop_core.pipeline; '
        'sys.exit("rclpy" in sys.modules)')
    assert subprocess.run([sys.executable, '-c', script], check=False).returncode == 0


def test_a_status_names_every_reason_once():
    from pop_core.estimate import EstimateStatus, FrameResult
    statuses = (EstimateStatus.TOO_FAR, EstimateStatus.TOO_FAR, EstimateStatus.NO_SKELETON)
    sentence = status_sentence(FrameResult((), statuses, {}))
    assert sentence == (
        'nobody found; 2 not fitted: beyond max_range_m; '
        '1 not fitted: ' + EstimateStatus.NO_SKELETON.value)
