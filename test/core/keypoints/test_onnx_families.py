"""Every family of networks as an ONNX file that sees one known person before a depth camera."""

import numpy as np
import pytest
from keypoint_bodies import CAMERA, show
from openpose_maps import perfect_maps
from support.onnx_files import save_network

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.box_crop import crop_box
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.keypoint_sets import BODY_25, COCO_17, COCO_18, HALPE_26, MPII_16
from pop_core.keypoints.onnx_detector import (
    OnnxBoxDetector,
    OnnxKeypointDetector,
    OnnxTopDownDetector,
    load_source,
)
from pop_core.keypoints.openpose import BODY_25_FIELDS, COCO_18_FIELDS

BODY = show()
H, W = CAMERA.height, CAMERA.width
TRUTH = BODY.detection.keypoints_px
BOX = PersonBox(BODY.detection.box_px, 0.9)
COMPARED = [SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right')
            for name in ('shoulder', 'elbow', 'wrist', 'hip', 'knee', 'ankle')]


def keypoints_of(keypoints):
    """The person's keypoints of a set; what is no shared joint lies at the nose."""
    nose = TRUTH[SHARED_INDEX['head']]
    return np.array([TRUTH[SHARED_INDEX[name]] if name in SHARED_INDEX else nose
                     for name in keypoints.names])


COCO = keypoints_of(COCO_17)
SCORES = np.full(17, 0.9)
ROWS = np.column_stack([COCO, SCORES])


def padded(rows, count):
    return np.concatenate([rows, np.zeros((count - len(rows), rows.shape[1]))])[None]


def centred(box):
    return np.concatenate([0.5 * (box[:2] + box[2:]), box[2:] - box[:2]])


def rtmo():
    return {'dets': np.array([[[*BOX.box_px, 0.9]]]), 'keypoints': ROWS[None, None]}, 'planes'


def yolo_pose():
    row = np.concatenate([centred(BOX.box_px + 0.5), [0.9], (ROWS + [0.5, 0.5, 0]).ravel()])
    return {'output0': padded(row[None], 100).transpose(0, 2, 1)}, 'planes'


def yolo_pose_suppressed():
    row = np.concatenate([BOX.box_px + 0.5, [0.9, 0], (ROWS + [0.5, 0.5, 0]).ravel()])
    return {'output0': padded(row[None], 300)}, 'planes'


def movenet():
    yx = (COCO[:, ::-1] + 0.5) / [H, W]
    corners = (BOX.box_px[[1, 0, 3, 2]] + 0.5) / [H, W, H, W]
    row = np.concatenate([np.column_stack([yx, SCORES]).ravel(), corners, [0.9]])
    return {'output_0': padded(row[None], 6)}, 'int32'


def openpose(layout, keypoints, *, together):
    places = {name: (uv + 0.5) / 8 - 0.5 for name, uv in
              zip(keypoints.names, keypoints_of(keypoints), strict=True)}
    heat, fields = perfect_maps([places], layout, (H // 8, W // 8))
    if together:
        return {'net_output': np.concatenate([heat, fields])[None]}, 'planes'
    return {'heat': heat[None], 'pafs': fields[None]}, 'planes'


def heatmaps():
    v, u = np.mgrid[:H, :W]
    maps = [np.exp(-((u - x) ** 2 + (v - y) ** 2) / 18.0) for x, y in keypoints_of(MPII_16)]
    return {'heat': np.stack(maps, axis=-1)[None]}, 'nhwc'


PEOPLE = {
    'rtmo': rtmo, 'yolo_pose': yolo_pose, 'yolo_pose suppressed': yolo_pose_suppressed,
    'movenet_multipose': movenet, 'single_person_heatmap': heatmaps,
    'openpose BODY_25': lambda: openpose(BODY_25_FIELDS, BODY_25, together=True),
    'openpose COCO-18': lambda: openpose(COCO_18_FIELDS, COCO_18, together=False),
}
INPUTS = {'planes': ((1, 3, H, W), 'float32'), 'int32': ((1, H, W, 3), 'int32'),
          'nhwc': ((1, H, W, 3), 'float32')}


def saved(path, outputs, kind):
    arrays = {name: np.asarray(array, np.float32) for name, array in outputs.items()}
    return save_network(path, arrays, *INPUTS[kind])


def agrees(person, atol):
    np.testing.assert_allclose(person.keypoints_px[COMPARED], TRUTH[COMPARED], atol=atol)


@pytest.mark.parametrize('family', PEOPLE)
def test_the_person_that_a_network_sees_is_found_before_depth(family, tmp_path):
    source = load_source(saved(tmp_path / 'net.onnx', *PEOPLE[family]()))
    assert source.decoder.name == family.split()[0]
    assert f'read as {source.decoder.name}' in source.reason
    (person,) = source.detect(BODY.frame)
    # Peaks of neighbours bend each other by a share of a cell of 8 pixels.
    agrees(person, atol=2.5 if 'openpose' in family else 0.5)


@pytest.mark.parametrize('keypoints', [COCO_17, HALPE_26], ids=lambda k: k.name)
def test_the_person_in_a_box_is_found(keypoints, tmp_path):
    _, crop = crop_box(BODY.frame.rgb, BOX.box_px, 256, 192)
    placed = crop.placed
    uv = ((keypoints_of(keypoints) - [crop.left, crop.top] + 0.5)
          * [placed.factor_u, placed.factor_v] - 0.5 + [placed.left, placed.top])
    bins = np.rint(2 * uv).astype(int)
    columns, rows = np.zeros((1, len(bins), 384)), np.zeros((1, len(bins), 512))
    columns[0, np.arange(len(bins)), bins[:, 0]] = 0.9
    rows[0, np.arange(len(bins)), bins[:, 1]] = 0.9
    arrays = {'simcc_x': columns.astype(np.float32), 'simcc_y': rows.astype(np.float32)}
    source = load_source(save_network(tmp_path / 'n.onnx', arrays, (1, 3, 256, 192), 'float32'))
    assert isinstance(source, OnnxTopDownDetector)
    (person,) = source.detect_in(BODY.frame, [BOX])
    agrees(person, atol=1.0)  # bins of half a pixel, and two pixels of the image per pixel


def test_nobody_is_found_in_no_box(tmp_path):
    arrays = {'simcc_x': np.ones((1, 17, 384), np.float32),
              'simcc_y': np.ones((1, 17, 512), np.float32)}
    source = load_source(save_network(tmp_path / 'n.onnx', arrays, (1, 3, 256, 192), 'float32'))
    assert source.detect_in(BODY.frame, []) == []


def test_a_network_that_finds_boxes_gives_them(tmp_path):
    row = np.zeros(84)
    row[:5] = [*centred(BOX.box_px + 0.5), 0.9]
    outputs = {'output0': padded(row[None], 100).transpose(0, 2, 1)}
    source = load_source(saved(tmp_path / 'net.onnx', outputs, 'planes'))
    assert isinstance(source, OnnxBoxDetector)
    (box,) = source.find_boxes(BODY.frame)
    np.testing.assert_allclose(box.box_px, BOX.box_px, atol=1e-3)


@pytest.mark.parametrize('family', ['rtmo', 'yolo_pose', 'movenet_multipose'])
def test_somebody_whom_depth_contradicts_is_not_found(family, tmp_path):
    source = load_source(saved(tmp_path / 'net.onnx', *PEOPLE[family]()))
    assert isinstance(source, OnnxKeypointDetector)
    wall = BODY.frame.depth_m * 0 + 12.0  # a person of this size there would be 8 m tall
    assert source.detect(type(BODY.frame)(BODY.frame.rgb, wall, CAMERA)) == []
