"""Prints the messages of other packages for the people of PEOPLE, as they arrive, as JSON."""

import json
from dataclasses import replace

import numpy as np
from support.estimates import CAMERA, estimate
from support.plain_messages import received

from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel
from pop_core.estimate import BodyEstimate, Track, TrackState
from pop_core.rgbd import RgbdFrame
from pop_ros import interop_hri
from pop_ros.interop import HRI_MISFIT, INTEROP_TYPES, MISFITS, interop_message
from pop_ros.interop_person import PersonReader
from pop_ros.message_packages import message_module
from pop_ros.pop_messages import bodies_message
from pop_ros.to_messages import make_header

STAMP_NS = 1_700_000_000_987_654_321
FRAME_ID = 'optical'
# By seed: one in the middle, one whom the border cuts, one beside the image.
PEOPLE = {3: (0.0, 0.1, 2.8), 4: (1.3, 0.1, 2.5), 5: (9.0, 0.1, 2.5)}
STATES = (TrackState.PREDICTED, TrackState.LOST)  # of all but the first


def bodies(model: BodyModel) -> list[BodyEstimate]:
    """Return the people; all but the first are tracked, the last one as lost."""
    found = [estimate(model, seed, at_m) for seed, at_m in PEOPLE.items()]
    tracks = [None, *(Track(seed, state, 4.5, 0.5 * state, np.full(24, 0.25 * state))
                      for seed, state in zip(list(PEOPLE)[1:], STATES, strict=True))]
    return [replace(body, track=track) for body, track in zip(found, tracks, strict=True)]


def main() -> None:
    model, header = default_body(), make_header(STAMP_NS, FRAME_ID)
    people = [PersonReader(model).read(seed, body, CAMERA)
              for seed, body in zip(PEOPLE, bodies(model), strict=True)]
    rgb = np.random.default_rng(0).integers(0, 256, (CAMERA.height, CAMERA.width, 3), np.uint8)
    frame = RgbdFrame(rgb, np.ones(rgb.shape[:2], np.float32), CAMERA, STAMP_NS)
    hri = message_module('hri_msgs')
    found = {name: received(interop_message(name, people, header)) for name in INTEROP_TYPES}
    found['bodies'] = received(bodies_message(bodies(model), list(PEOPLE), header))
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
