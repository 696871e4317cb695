"""Nothing is left to be compiled once a pipeline is there."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
# In a program of its own: kernels that another test has used would be taken for warmed up.
PROGRAM = """
import sys
from numba.core.dispatcher import Dispatcher
from pop_core.body.default_body import default_body
from pop_core.keypoints.fusion import FusedDetector
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import synthesise_scene
from pop_ros.sources import make_detector, make_pipeline

class Told:
    def detect(self, frame):
        return self.people

def compiled():
    return {
        (name, key, kinds) for name, module in list(sys.modules.items())
        if name.startswith('pop_core.') and name.endswith('_kernels')
        for key, kernel in vars(module).items() if isinstance(kernel, Dispatcher)
        for kinds in map(str, kernel.signatures)}

scenes = [synthesise_scene(default_body(), seed, SceneConfig()) for seed in (10000, 10001, 10004)]
told = Told()
pipeline = make_pipeline(FusedDetector([make_detector('depth'), told]))
before = compiled()
assert before
for scene in scenes:
    told.people = [person for person in scene.detections() if person is not None]
    pipeline.process(scene.frame)
print(sorted(compiled() - before))
"""


def test_no_frame_waits_for_a_kernel() -> None:
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == '[]\n'
