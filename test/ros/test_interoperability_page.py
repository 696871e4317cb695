"""What docs/interoperability.md says is so, and its receiver receives."""

import re
import subprocess
import sys
import threading
from pathlib import Path

from support import bodies_sender
from support.message_packages import environment_with
from support.node import ROOT

from pop_ros.interop import INTEROP

PAGE = (ROOT / 'docs' / 'interoperability.md').read_text(encoding='utf-8')


def test_every_output_for_other_packages_has_a_row_with_its_message() -> None:
    for name, interop in INTEROP.items():
        assert f'| `~/{name}` | `{interop.package}/{interop.kind}` |' in PAGE


def test_the_receiver_of_the_page_tells_of_each_person(tmp_path: Path) -> None:
    environment = environment_with('pop_msgs')
    script = tmp_path / 'receiver.py'
    script.write_text(re.search(r'```python\n(.*?)```', PAGE, re.DOTALL)[1], encoding='utf-8')
    sender = subprocess.Popen(
        [sys.executable, bodies_sender.__file__, 'same', '3', '8'], env=environment)
    receiver = subprocess.Popen(
        [sys.executable, str(script)], env=environment, stdout=subprocess.PIPE, text=True)
    giving_up = threading.Timer(30, receiver.kill)
    giving_up.start()
    try:
        lines = [receiver.stdout.readline() for _ in range(6)]
    finally:
        giving_up.cancel()
        for process in (receiver, sender):
            process.kill()
            process.wait()
    told = ''.join(lines)
    for number in (3, 8):
        assert re.search(rf'person {number}: \d\.\d\d m away, \d+% seen', told), told
    assert 'hidden: ' in told
