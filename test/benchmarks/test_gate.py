import json

import pytest

from benchmarks import gate
from benchmarks.gate import Metric, accuracy_metrics, comparison, is_worse


def metric(value, direction='lower', tolerance=0.01):
    return Metric('figure', value, 'm', direction, tolerance)


def test_a_figure_may_be_worse_by_its_tolerance_and_not_more():
    assert not is_worse(metric(0.109), metric(0.10))
    assert is_worse(metric(0.111), metric(0.10))
    assert not is_worse(metric(0.05), metric(0.10))


def test_of_figures_that_should_be_high_low_ones_are_worse():
    assert is_worse(metric(0.85), metric(0.90, 'higher'))
    assert not is_worse(metric(0.95), metric(0.90, 'higher'))


def test_the_gate_watches_figures_that_summaries_have():
    metrics = {key: {'mean': 0.1, 'median': 0.2} for key, *_ in gate.WATCHED}
    found = accuracy_metrics({'metrics': metrics, 'people': 20, 'failure_rate': 0.1})
    assert len({item.key for item in found}) == len(found) == len(gate.WATCHED) + 1


@pytest.mark.parametrize(('value', 'code'), [(0.1005, 0), (0.2, 1)])
def test_the_exit_code_tells_whether_something_became_worse(monkeypatch, tmp_path, value, code):
    monkeypatch.setattr(gate, 'measure', lambda: [metric(value)])
    path = tmp_path / 'baseline.json'
    path.write_text(json.dumps([{
        'key': 'figure', 'value': 0.1, 'unit': 'm', 'direction': 'lower', 'tolerance': 0.01}]))
    assert gate.run(['--baseline', str(path)]) == code


def test_an_updated_baseline_passes(monkeypatch, tmp_path):
    monkeypatch.setattr(gate, 'measure', lambda: [metric(0.3)])
    path = tmp_path / 'baseline.json'
    assert gate.run(['--update', '--baseline', str(path)]) == 0
    assert gate.run(['--baseline', str(path)]) == 0


def test_the_comparison_has_a_row_per_figure():
    assert comparison([metric(0.2)], {'figure': metric(0.1)}).row_count == 1
