import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from benchmarks import accuracy, accuracy_cache
from benchmarks.__main__ import main, runnable
from benchmarks.accuracy_methods import GivenDetections, Guess, place_mean_body
from benchmarks.accuracy_paper import paper_subset, paper_table
from benchmarks.accuracy_pictures import curves_picture, scene_picture
from benchmarks.accuracy_records import CURVE_M, match, observed_points, person_record
from benchmarks.accuracy_summary import (
    FAILURE_M,
    coverage_lines,
    group_lines,
    shape_lines,
    summarise,
    table,
)
from pop_core.body.default_body import default_body
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import rest_parameters, shared_points
from pop_core.config import PipelineConfig
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.retrieve import RetrievalConfig
from pop_core.synthesis.scenes import synthesise_scene


@pytest.fixture(scope='module')
def model():
    return default_body()


@pytest.fixture(scope='module')
def scene(model):
    return synthesise_scene(model, 10)


def truth_guess(person):
    covariance = np.tile(np.eye(3) * 1e-4, (24, 1, 1))
    return Guess(person.parameters, person.mask, covariance)


class MeanBodyOnTruth:
    """The simplest estimator: the mean T-pose on the true points of each person."""

    def __init__(self, model, scene):
        self.model, self.scene = model, scene

    def __call__(self, frame):  # noqa: ARG002 - the protocol's shape
        known = np.ones(15, dtype=bool)
        guesses = [
            Guess(place_mean_body(self.model, p.shared_points, known)) for p in self.scene.people]
        return guesses, {'all': 2.0}


def test_the_truth_itself_scores_no_error(model, scene):
    record = person_record(model, scene, scene.people[0], truth_guess(scene.people[0]))
    for key in ('err_beta', 'err_J', 'err_pose', 'err_visible', 'mpjpe_root', 'tpose', 'pve'):
        assert record[key] == pytest.approx(0.0, abs=1e-9)
    assert record['iou'] == 1.0
    assert record['p2p_surface'] == pytest.approx(record['p2p_surface_truth'])
    assert record['p2p_above_truth'] == pytest.approx(0.0, abs=1e-9)


def test_a_shifted_body_errs_by_the_shift_in_every_joint(model, scene):
    person = scene.people[0]
    shifted = person.parameters.replaced(transl=person.parameters.transl + [0.0, 0.03, 0.04])
    record = person_record(model, scene, person, Guess(shifted))
    assert record['err_J'] == pytest.approx(0.05)
    assert record['err_visible'] == pytest.approx(0.05)
    assert record['mpjpe_root'] == pytest.approx(0.0, abs=1e-9)
    assert 'iou' not in record


def test_the_oracle_takes_the_best_hypothesis(model, scene):
    person = scene.people[0]
    wrong = person.parameters.replaced(transl=person.parameters.transl + [0.2, 0.0, 0.0])
    record = person_record(model, scene, person, Guess(wrong, runners_up=(person.parameters,)))
    assert record['err_pose'] == pytest.approx(0.2)
    assert record['oracle_pose'] == pytest.approx(0.0, abs=1e-9)


def test_observed_points_lie_on_the_clothed_person(scene):
    for person in scene.people:
        points = observed_points(scene, person)
        uv = np.rint(scene.frame.camera.project(points)).astype(int)
        assert person.mask[uv[:, 1], uv[:, 0]].all()
        assert len(points) > 100


def test_people_are_matched_one_to_one_and_not_across_the_room(model, scene):
    guesses = [truth_guess(person) for person in scene.people][::-1]
    n = len(guesses)
    assert n > 1
    assert match(model, guesses, scene.people) == {k: n - 1 - k for k in range(n)}
    far = guesses[0].parameters.replaced(transl=guesses[0].parameters.transl + [5.0, 0, 0])
    assert match(model, [Guess(far)], scene.people) == {}
    assert match(model, [], scene.people) == {}


def test_the_mean_body_is_placed_by_the_rigid_motion_of_its_points(model):
    R = from_rotvec(np.array([2.9, 0.3, -0.4]))
    rest = rest_parameters()
    points = attached_positions(shared_points(model), model, rest) @ R.T + [0.1, 0.2, 2.5]
    known = np.arange(15) % 3 != 0
    placed = place_mean_body(model, points[known], known)
    assert np.allclose(attached_positions(shared_points(model), model, placed), points)
    assert placed.global_orient == pytest.approx(to_rotvec(R))


def test_a_frame_is_measured_with_any_method(model, scene):
    detector = GivenDetections()
    entry = accuracy.scene_entry(
        model, scene, {accuracy.MAIN: MeanBodyOnTruth(model, scene)}, detector)
    assert len(detector.detect(scene.frame)) + entry['unseen'] == len(scene.people)
    records = entry['methods'][accuracy.MAIN]['people']
    assert all(r['err_beta'] == pytest.approx(1.0) for r in records if not r['child'])
    assert all(r['err_pose'] > 0.05 for r in records)
    report = accuracy.summary_of([json.loads(json.dumps(entry))], [accuracy.MAIN])
    assert report['median_times_ms'] == {'all': 2.0}
    console = Console(width=130, record=True, file=open('/dev/null', 'w'))  # noqa: SIM115,PTH123
    accuracy.print_report(report, console)
    text = console.export_text()
    assert '115.7 mm' in text
    assert 'own frames' in text


def record_of(err_pose, found=True, squared=1.0):
    if not found:
        return {'found': False, 'bare': False}
    return {'found': True, 'bare': True, 'err_pose': err_pose, 'tpose': 0.01, 'stature': 0.02,
            'state': [0] * 24, 'mahalanobis2': [squared] * 24}


def test_people_not_found_are_failures_but_have_no_error():
    records = [record_of(0.02), record_of(0.04), record_of(FAILURE_M * 2), record_of(0, False)]
    summary = summarise(records)
    assert summary['failure_rate'] == 0.5
    assert summary['found'] == 3
    assert summary['metrics']['err_pose']['median'] == pytest.approx(0.04)
    assert summary['metrics']['tpose_bare']['n'] == 3


def test_coverage_counts_joints_inside_their_ellipsoids():
    summary = summarise([record_of(0.02, squared=1.0), record_of(0.02, squared=5.0),
                         record_of(0.02, squared=50.0), record_of(0.02, squared=0.1)])
    assert summary['coverage']['visible'] == {'68': 0.5, '95': 0.75, 'n': 96}
    assert 'visible: 50 % in the 68 % ellipsoid' in coverage_lines(summary)[0]


def test_the_papers_table_takes_the_most_hidden_person_of_eighteen_frames():
    people = [{'found': True, 'hidden_share': 0.2, 'err_pose': 0.5},
              {'found': True, 'hidden_share': 0.5, 'err_pose': 0.1},
              {'found': False, 'hidden_share': 0.9}]
    subset = paper_subset([{'methods': {'pop': {'people': people}}}] * 25, 'pop')
    assert [record['err_pose'] for record in subset] == [0.1] * 18
    console = Console(width=130, record=True, file=open('/dev/null', 'w'))  # noqa: SIM115,PTH123
    console.print(paper_table(subset))
    text = console.export_text()
    assert '0.1515' in text
    assert '0.1000' in text


def test_groups_tell_which_poses_fail():
    common = {'sensor': 'stereo', 'child': False, 'found': True}
    records = [
        common | {'kind': 'lying', 'err_pose': 0.3}, common | {'kind': 'lying', 'err_pose': 0.1},
        common | {'kind': 'standing', 'err_pose': 0.02}]
    assert 'lying 200 mm, 1 of 2 failed; standing 20 mm, 0 of 1 failed' in group_lines(records)[0]


def test_shape_errors_are_told_by_who_they_are_of():
    common = {'found': True, 'child': False, 'kind': 'standing', 'sensor': '', 'tpose': 0.01}
    records = [
        common | {'bare': False, 'stature': 0.03, 'too_tall': 0.03},
        common | {'bare': False, 'stature': 0.01, 'too_tall': -0.01},
        common | {'bare': True, 'stature': 0.02, 'too_tall': -0.02},
        {'found': False, 'bare': True, 'child': True, 'kind': 'lying', 'sensor': ''}]
    of_bare, of_child, *_ = shape_lines(records)
    assert of_bare.endswith('False 10 mm, 20 mm (+10), 2; True 10 mm, 20 mm (-20), 1')
    assert 'True' not in of_child  # nobody found has no shape


def test_the_table_shows_every_method():
    summaries = {'pop': summarise([record_of(0.02)]), 'mean body': summarise([record_of(0.3)])}
    console = Console(width=130, record=True, file=open('/dev/null', 'w'))  # noqa: SIM115,PTH123
    console.print(table(summaries, 'pop'))
    text = console.export_text()
    assert '20.0 mm' in text
    assert '300.0 mm' in text
    assert '151.5 mm' in text


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path):
    path = tmp_path / 'run.jsonl'
    accuracy_cache.FrameCache(path).add({'seed': 4, 'value': 1})
    with path.open('a') as file:
        file.write('{"seed": 5, "val')
    again = accuracy_cache.FrameCache(path)
    assert list(again.done) == [4]
    again.add({'seed': 6})
    assert sorted(accuracy_cache.FrameCache(path).done) == [4, 6]


def test_other_settings_have_another_key():
    first = accuracy_cache.run_key([repr(PipelineConfig())])
    assert first == accuracy_cache.run_key([repr(PipelineConfig())])
    changed = replace(PipelineConfig(), max_people=2)
    assert first != accuracy_cache.run_key([repr(changed)])


@pytest.mark.parametrize('arguments', [
    ['--set', 'fitting.nonsense=1'], ['--set', 'retrieval.candidates=many'],
    ['--frames', '1', '--keypoints', 'nobody.onnx']])
def test_wrong_arguments_are_told_in_a_line(arguments, capsys):
    assert main(['accuracy', *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith('benchmarks accuracy: ')
    assert 'expected' in said


def test_no_scenes_at_all_are_refused():
    with pytest.raises(SystemExit, match='2'):
        main(['accuracy', '--frames', '0'])


def test_fewer_hypotheses_are_fitted_on_in_the_same_shares():
    assert accuracy.of_k(RetrievalConfig().candidates) == {
        'retrieval.candidates': 6, 'fitting.surface_hypotheses': 6, 'fitting.final_hypotheses': 3}
    assert accuracy.of_k(1) == {
        'retrieval.candidates': 1, 'fitting.surface_hypotheses': 1, 'fitting.final_hypotheses': 1}
    assert accuracy.of_k(12)['fitting.final_hypotheses'] == 6


def test_every_ablation_names_settings_that_exist():
    for changes in accuracy.ABLATIONS.values():
        assert accuracy.apply_settings(PipelineConfig(), changes) != PipelineConfig()


def test_pictures_show_curves_and_errors(model, scene):
    people = [person_record(model, scene, p, truth_guess(p)) for p in scene.people]
    assert len(people[0]['curve']) == len(CURVE_M)
    assert curves_picture(people).shape == (480, 640, 3)
    person = scene.people[0]
    behind = person.parameters.replaced(transl=person.parameters.transl + [0.0, 0.0, 0.3])
    white, black = (
        scene_picture(model, scene, [guess])[:, 2 * scene.frame.camera.width:][person.mask].mean()
        for guess in (truth_guess(person), Guess(behind)))
    assert white > black + 50


def test_benchmarks_are_found_by_name(capsys):
    assert 'accuracy' in runnable()
    assert 'metrics' not in runnable()
    assert main(['no_such']) == 2
    assert 'expected one of' in capsys.readouterr().err
