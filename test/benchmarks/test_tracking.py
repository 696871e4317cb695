import numpy as np
import pytest
from rich.console import Console

from benchmarks.accuracy_methods import GivenDetections
from benchmarks.tracking import configs, parse
from benchmarks.tracking_methods import Sighting, follow
from benchmarks.tracking_pictures import since_seen_chart
from benchmarks.tracking_summary import by_kind, comparison, kind_table, summarise, with_rows
from pop_core.body.default_body import default_body
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_names import SequenceKind

SHIFT_M = 0.03
SIGMA_M = 0.05


class Shifted:
    """Knows the truth and says it a little beside, under a number that changes once."""

    def __init__(self, people, shift_m):
        self.people, self.shift_m, self.frame = people, shift_m, 0

    def __call__(self, frame):  # noqa: ARG002 - the protocol's shape
        people = self.people[self.frame]
        self.frame += 1
        covariance = np.tile(np.eye(3) * SIGMA_M**2, (24, 1, 1))
        number = 0 if self.frame < 4 else 1
        return [Sighting(number, p.joints + [self.shift_m, 0, 0], covariance) for p in people]


@pytest.fixture(scope='module')
def followed():
    config = SequenceConfig(SequenceKind.STILL, 6, 4.0, colour=False)
    frames = list(film_sequence(default_body(), 0, config))
    people = [frame.scene.people for frame in frames]
    methods = {'per frame': Shifted(people, SHIFT_M), 'tracked': Shifted(people, 0.0)}
    detector, steps = GivenDetections(), []
    truth, tracks = follow(frames, 4.0, methods, detector, lambda: steps.append(1))
    assert len(steps) == 6
    assert len(detector.detect(frames[0].scene.frame)) == 1
    return with_rows('still', truth, tracks)


@pytest.fixture(scope='module')
def summaries(followed):
    return {name: summarise([followed], name) for name in followed.tracks}


def test_errors_are_those_put_in(summaries):
    shifted, exact = summaries['per frame'], summaries['tracked']
    for part in ('visible_m', 'occluded_m'):
        assert shifted[part]['mean'] == pytest.approx(SHIFT_M)
        assert exact[part]['mean'] == 0.0
    assert shifted['visible_m']['n'] + shifted['occluded_m']['n'] == 6 * 14


def test_a_joint_never_seen_is_told_from_one_seen_before(summaries):
    groups = summaries['per frame']['since_seen_m']
    # Nobody moves: what is hidden in the first frame is never seen.
    assert groups['never seen yet']['n'] == summaries['per frame']['occluded_m']['n'] > 0
    assert groups['seen now']['n'] == summaries['per frame']['visible_m']['n']
    assert sum(group['n'] for group in groups.values()) == 6 * 14


def test_coverage_steadiness_and_numbers_follow_from_the_tables(summaries):
    shifted = summaries['per frame']
    assert shifted['coverage_hidden'] == {'68': 1.0, '95': 1.0}  # 3 cm at 5 cm of sigma
    assert shifted['static_std_m']['visible'] == pytest.approx(0.0, abs=1e-12)
    assert shifted['acceleration_error_m_s2'] == pytest.approx(0.0, abs=1e-9)
    assert (shifted['switches'], shifted['misses'], shifted['extra']) == (1, 0, 0)
    assert shifted['frames'] == 6


def test_time_since_seen_grows_until_a_joint_is_seen_again(followed):
    truth = followed.truth
    assert ((truth.unseen_s == 0.0) == (truth.state == 0)).all()


def test_the_tables_show_methods_side_by_side(followed, summaries):
    console = Console(width=130, record=True, file=open('/dev/null', 'w'))  # noqa: SIM115,PTH123
    console.print(comparison(summaries))
    console.print(kind_table({name: by_kind([followed], name) for name in summaries}))
    text = console.export_text()
    assert '30.0 mm' in text
    assert '30 / 0' in text
    assert '-100 %' in text


def test_the_chart_has_a_bar_per_method_where_there_are_joints(summaries):
    chart = since_seen_chart(summaries)
    assert chart.shape == (440, 960, 3)
    assert len(np.unique(chart.reshape(-1, 3), axis=0)) > 4


def test_settings_of_the_tracker_begin_with_its_name():
    pipeline, tracking = configs(['tracking.detect_every=2', 'max_people=3'])
    assert (pipeline.max_people, tracking.detect_every) == (3, 2)


def test_only_known_kinds_are_filmed(capsys):
    assert parse([]).kinds == [kind.value for kind in SequenceKind]
    with pytest.raises(SystemExit):
        parse(['--kinds', 'dancing'])
    assert 'dancing' in capsys.readouterr().err
