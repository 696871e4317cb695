"""Prints the messages of other packages for the people of PEOPLE, as they arrive, as JSON."""

import json

import numpy as np
from support.estimates import CAMERA, estimate
from support.plain_messages import received

from pop_core.body.default_body import default_body
from pop_core.rgbd import RgbdFrame
from pop_ros import interop_hri
from pop_ros.interop import HRI_MISFIT, INTEROP_TYPES, MISFITS, interop_message
from pop_ros.interop_person import PersonReader
from pop_ros.message_packages import message_module
from pop_ros.to_messages import make_header

STAMP_NS = 1_700_000_000_987_654_321
FRAME_ID = 'optical'
# By seed: one in the middle, one whom the border cuts, one beside the image.
PEOPLE = {3: (0.0, 0.1, 2.8), 4: (1.3, 0.1, 2.5), 5: (9.0, 0.1, 2.5)}


def main() -> None:
    model, header = default_body(), make_header(STAMP_NS, FRAME_ID)
    people = [PersonReader(model).read(seed, estimate(model, seed, at_m), CAMERA)
              for seed, at_m in PEOPLE.items()]
    rgb = np.random.default_rng(0).integers(0, 256, (CAMERA.height, CAMERA.width, 3), np.uint8)
    frame = RgbdFrame(rgb, np.ones(rgb.shape[:2], np.float32), CAMERA, STAMP_NS)
    hri = message_module('hri_msgs')
    found = {name: received(interop_message(name, people, header)) for name in INTEROP_TYPES}
    found['ids'] = received(interop_hri.ids_message(['a', 'b'], header, hri))
    found['skeletons'] = [
        received(interop_hri.skeleton_message(p, header, hri)) for p in people]
    found['regions'] = [received(interop_hri.region_message(p, header, hri)) for p in people]
    found['pictures'] = [
        received(interop_hri.cropped_message(p, frame, header)) for p in people]
    found['misfits'] = [*MISFITS.values(), HRI_MISFIT]
    print(json.dumps(found))  # noqa: T201 - what the test reads


if __name__ == '__main__':
    main()
