from pathlib import Path

from benchmarks.tracking_metrics import GATE_M
from benchmarks.tracking_records import FEWEST_VISIBLE
from pop_core.synthesis.sequence_keypoints import FRESH_SHARE, LASTING_S
from pop_core.synthesis.sequence_names import ABOUT

PAGE = (Path(__file__).resolve().parents[2] / 'docs' / 'tracking.md').read_text(encoding='utf-8')


def test_the_page_describes_every_kind_of_recording():
    for kind, about in ABOUT.items():
        assert f'| `{kind.value}` | {about} |' in PAGE


def test_the_page_states_the_constants_in_force():
    text = ' '.join(PAGE.split())
    assert f'{100 * (1 - FRESH_SHARE):.0f} % of their variance' in text
    assert f'time constant of {LASTING_S} s' in text
    assert f'within {GATE_M} m' in text
    assert f'fewer than {FEWEST_VISIBLE} of the 15' in text
