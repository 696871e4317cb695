"""Networks that give noise, for images of every size: a decoder gives finite people, or nobody."""

from itertools import product

import numpy as np
import pytest
from spot_networks import planes_spec

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.decoders import DECODERS, choose_decoder
from pop_core.keypoints.fusion import fuse
from pop_core.keypoints.network import NetworkSpec, PeopleDecoder, TensorSpec, TopDownDecoder


def image_spec(size, kind, *outputs):
    return NetworkSpec(
        (TensorSpec('image', (1, *size, 3), kind),),
        tuple(TensorSpec(f'out{i}', shape, 'float32') for i, shape in enumerate(outputs)))


SPECS = {
    'personlab': image_spec(
        (481, 641), 'uint8', (1, 31, 41, 17), (1, 31, 41, 34), (1, 31, 41, 64)),
    'openpose': planes_spec((1, 78, 46, 62)),
    'single_person_heatmap': image_spec((368, 368), 'float32', (1, 92, 92, 16)),
    'rtmo': planes_spec((1, 40, 5), (1, 40, 17, 3)),
    'yolo_pose': planes_spec((1, 56, 40)),
    'movenet_multipose': image_spec((256, 256), 'int32', (1, 6, 56)),
    'rtmpose': planes_spec((1, 17, 384), (1, 17, 512), size=(256, 192)),
    'yolox': planes_spec((1, 8400, 85)),
    'yolo_boxes': planes_spec((1, 84, 8400)),
    'rtmdet': planes_spec((1, 100, 5), (1, 100)),
    'yolox_mmdeploy': planes_spec((1, 100, 5), (1, 100)),
}


def noise(shape, scale, rng):
    values = rng.normal(0, scale, shape)
    dice = rng.random(shape)
    for bad, limit in ((np.nan, 0.03), (np.inf, 0.02), (-np.inf, 0.01)):
        values[dice < limit] = bad
    return values.astype(np.float32)


def test_every_decoder_is_tried():
    assert SPECS.keys() == DECODERS.keys()


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('size', [(1, 1), (1, 4000), (2160, 3840)])
@pytest.mark.parametrize('name', SPECS)
def test_noise_gives_finite_people_or_nobody(name, size):
    rng = np.random.default_rng(len(name))
    spec, image = SPECS[name], np.zeros((*size, 3), np.uint8)
    decoder = choose_decoder(spec, name, 'net.onnx')
    for scale in (0.5, 1e30):
        outputs = [noise(output.shape, scale, rng) for output in spec.outputs]
        boxes = [PersonBox(np.array([0.0, 0.0, size[1], size[0]]), 1.0)]
        if isinstance(decoder, PeopleDecoder):
            people = decoder.detect(image, lambda _, given=outputs: given)
        elif isinstance(decoder, TopDownDecoder):
            people = decoder.detect_in(image, boxes, lambda _, given=outputs: given)
        else:
            found = decoder.find_boxes(image, lambda _, given=outputs: given)
            assert all(np.isfinite(box.box_px).all() and box.score <= 1 for box in found)
            continue
        for person in [*people, *fuse([people[:20], people[:20]])]:
            seen = person.scores > 0
            assert np.isfinite(person.box_px).all()
            assert np.isfinite(person.keypoints_px[seen]).all()
            assert np.isnan(person.keypoints_px[~seen]).all()
            assert person.scores.max() <= 1.0


def free(spec):
    """The same network with free rows and columns of its maps."""
    outputs = tuple(
        TensorSpec(o.name, (o.shape[0], *(None if n > 17 and n not in (26, 34, 52, 64, 78) else n
                                          for n in o.shape[1:])), o.dtype) for o in spec.outputs)
    return NetworkSpec(spec.inputs, outputs)


@pytest.mark.parametrize(('name', 'grid'), [
    *product(['personlab', 'openpose', 'single_person_heatmap'], [(0, 0), (1, 1), (1, 40)]),
    ('personlab', 'mixed'), ('openpose', 'mixed'),
])
def test_maps_without_a_common_grid_are_refused(name, grid):
    # Kernels look up one map by the cells of another: beyond its end lies other memory.
    spec = SPECS[name]
    if name == 'openpose':
        spec = planes_spec((1, 26, 46, 62), (1, 52, 46, 62))
    decoder = choose_decoder(free(spec), name, 'net.onnx')
    maps = []
    for i, output in enumerate(spec.outputs):
        rows, columns = (30 + 5 * i, 40) if grid == 'mixed' else grid
        first = name == 'openpose'  # channels first
        channels = output.shape[1 if first else 3]
        shape = (channels, rows, columns) if first else (rows, columns, channels)
        maps.append(np.ones((1, *shape), np.float32))
    with pytest.raises(NetworkShapeError, match='expected maps of one grid'):
        decoder.detect(np.zeros((48, 64, 3), np.uint8), lambda _: maps)
