import re
from pathlib import Path

import numpy as np

from pop_core.keypoints.decoders import DECODERS
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_ros.network_registry import load_registry
from pop_ros.warm_up import small_scene

PAGE = (Path(__file__).resolve().parents[2] / 'docs' / 'keypoints.md').read_text(encoding='utf-8')


def test_the_table_has_every_decoder_and_no_other():
    cells = [line.split('|')[1] for line in PAGE.splitlines() if line.startswith('| `')]
    assert sorted(re.findall(r'`(\w+)`', ' '.join(cells))) == sorted(DECODERS)


def test_networks_that_the_page_fetches_are_published():
    named = set(re.findall(r'pop models fetch ([a-z][\w-]+)', PAGE))
    assert named
    assert named <= {entry.name for entry in load_registry()}


def test_the_source_in_five_lines_is_a_source():
    (block,) = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
    rng = np.random.default_rng(0)

    def my_network(rgb):
        people = [(rng.uniform(0, 100, (17, 2)), rng.uniform(0.1, 1, 17)) for _ in range(2)]
        only_ears = np.where(np.isin(np.arange(17), (3, 4)), 0.9, 0.0)
        return [*people, (people[0][0], only_ears)]

    space = {'my_network': my_network}
    exec(block.split('result =')[0], space)
    detector = space['MyDetector']()
    assert isinstance(detector, KeypointDetector)
    from pop_core.body.default_body import default_body
    people = detector.detect(small_scene(default_body())[0])
    assert [type(person) for person in people] == [Detection] * 2
