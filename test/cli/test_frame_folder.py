import json
import struct
import zlib

import cv2
import numpy as np
import pytest
from cli.conftest import write_frame

from pop_core.errors import FrameError
from pop_ros.camera_file import camera_json, load_camera
from pop_ros.frame_folder import find_frames, load_frame
from pop_ros.png_file import check_png


@pytest.fixture
def folder(tmp_path, scene):
    return write_frame(tmp_path / 'frame', scene[0], None)


def test_a_frame_read_back_is_the_frame_written(folder, scene):
    frame = load_frame(folder)
    np.testing.assert_array_equal(frame.rgb, scene[0].rgb)
    # Half a millimetre: depth is stored in whole ones.
    np.testing.assert_allclose(frame.depth_m, scene[0].depth_m, atol=0.5001e-3)
    assert camera_json(frame.camera) == camera_json(scene[0].camera)


def test_a_camera_may_say_how_it_is_mounted(folder):
    path = folder / 'camera.json'
    path.write_text(json.dumps(json.loads(path.read_text()) | {'quarter_turns': 2}))
    camera = load_camera(path)
    assert camera.quarter_turns == 2
    assert camera_json(camera)['quarter_turns'] == 2


def test_zero_depth_is_no_measurement(folder):
    depth_mm = cv2.imread(str(folder / 'depth.png'), cv2.IMREAD_UNCHANGED)
    before = np.isnan(load_frame(folder).depth_m)
    depth_mm[3, 4] = 0
    cv2.imwrite(str(folder / 'depth.png'), depth_mm)
    missing = np.isnan(load_frame(folder).depth_m)
    assert not before[3, 4]
    assert missing[3, 4]
    assert missing.sum() == before.sum() + 1


def with_scale(folder, scale):
    path = folder / 'camera.json'
    path.write_text(json.dumps(json.loads(path.read_text()) | {'depth_scale': scale}))
    return folder


def test_depth_of_another_unit_is_read_by_its_scale(folder, scene):
    units = np.rint(np.nan_to_num(scene[0].depth_m) * 5000).astype(np.uint16)
    cv2.imwrite(str(folder / 'depth.png'), units)
    frame = load_frame(with_scale(folder, 5000))
    # Half a unit of 0.2 mm.
    np.testing.assert_allclose(frame.depth_m, scene[0].depth_m, atol=0.1001e-3)


def test_millimetres_may_be_said(folder):
    before = load_frame(folder)
    np.testing.assert_array_equal(load_frame(with_scale(folder, 1000)).depth_m, before.depth_m)


@pytest.mark.parametrize(('scale', 'sentence'), [
    (0, 'units per metre.*found 0$'),
    (-1000, 'found -1000$'),
    (0.001, r'found 0\.001: 1000, where that is metres per unit$'),
    (1e300, r'found 1e\+300$'),
    (float('inf'), 'finite number, found inf'),
    (float('nan'), 'finite number, found nan'),
    ('5000', "finite number, found '5000'"),
    (None, 'finite number, found nothing'),
    (True, 'finite number, found True'),
])
def test_a_scale_that_is_none_gets_one_line_that_says_why(folder, scale, sentence):
    with pytest.raises(FrameError, match=rf'camera\.json: expected depth_scale as .*{sentence}'):
        load_frame(with_scale(folder, scale))


def test_folders_may_be_named_by_text(folder):
    np.testing.assert_array_equal(load_frame(str(folder)).depth_m, load_frame(folder).depth_m)
    assert [found.path for found in find_frames(str(folder))] == [folder]


def test_camera_may_lie_in_the_parent_folder(folder):
    (folder / 'camera.json').rename(folder.parent / 'camera.json')
    assert load_frame(folder).camera.width == 160


def test_a_frame_is_named_after_its_folder_and_frames_below_after_their_path(tmp_path, scene):
    for name in ('b/deep/1', 'a', 'b/2'):
        write_frame(tmp_path / 'set' / name, scene[0], None)
    assert [f.name.as_posix() for f in find_frames(tmp_path / 'set')] == ['a', 'b/2', 'b/deep/1']
    assert [f.name.as_posix() for f in find_frames(tmp_path / 'set' / 'a')] == ['a']


def test_a_folder_that_contains_itself_by_a_link_is_searched_once(tmp_path, scene):
    write_frame(tmp_path / 'set' / 'a', scene[0], None)
    (tmp_path / 'set' / 'loop').symlink_to(tmp_path / 'set')
    assert len(find_frames(tmp_path / 'set')) == 1


@pytest.mark.parametrize('name', ['color.png', 'depth.png', 'camera.json'])
def test_a_missing_file_is_named(folder, name):
    (folder / name).unlink()
    with pytest.raises(FrameError, match=f'expected {name}'):
        load_frame(folder)


@pytest.mark.parametrize('kept', [0, 5, 40, 0.5, 0.99])
@pytest.mark.parametrize('name', ['color.png', 'depth.png'])
def test_a_truncated_image_is_refused_wherever_it_is_cut(folder, name, kept):
    content = (folder / name).read_bytes()
    end = kept if isinstance(kept, int) else int(kept * len(content))
    (folder / name).write_bytes(content[:end])
    with pytest.raises(FrameError, match=f'{name}: expected'):
        load_frame(folder)


@pytest.mark.parametrize('name', ['color.png', 'depth.png'])
def test_a_flipped_bit_anywhere_is_found(folder, name):
    content = bytearray((folder / name).read_bytes())
    rng = np.random.default_rng(0)
    for at in rng.integers(8, len(content) - 12, 60):
        damaged = content.copy()
        damaged[at] ^= 1 << int(rng.integers(8))
        with pytest.raises(FrameError):
            check_png(bytes(damaged), folder / name)


def test_depth_of_eight_bits_is_refused(folder):
    cv2.imwrite(str(folder / 'depth.png'), np.zeros((120, 160), np.uint8))
    with pytest.raises(FrameError, match=r'expected depth as 16-bit gray.*found 8-bit gray'):
        load_frame(folder)


def test_colour_saved_as_jpeg_is_refused(folder):
    jpeg = cv2.imencode('.jpg', np.zeros((120, 160, 3), np.uint8))[1]
    (folder / 'color.png').write_bytes(jpeg.tobytes())
    with pytest.raises(FrameError, match='expected a PNG'):
        load_frame(folder)


def test_an_image_of_another_size_than_the_camera_is_refused(folder):
    cv2.imwrite(str(folder / 'color.png'), np.zeros((60, 80, 3), np.uint8))
    with pytest.raises(FrameError, match=r'expected 160x120 as the camera says, found .*80x60'):
        load_frame(folder)


def test_gray_and_transparent_colour_images_are_read(folder):
    cv2.imwrite(str(folder / 'color.png'), np.full((120, 160), 77, np.uint8))
    assert (load_frame(folder).rgb == 77).all()
    cv2.imwrite(str(folder / 'color.png'), np.full((120, 160, 4), (1, 2, 3, 0), np.uint8))
    assert (load_frame(folder).rgb == (3, 2, 1)).all()


def test_a_bomb_is_refused_by_its_header(tmp_path):
    data = struct.pack('>IIBBBBB', 2**31 - 1, 2**31 - 1, 8, 2, 0, 0, 0)
    crc = struct.pack('>I', zlib.crc32(data, zlib.crc32(b'IHDR')))
    content = b'\x89PNG\r\n\x1a\n' + struct.pack('>I', 13) + b'IHDR' + data + crc
    with pytest.raises(FrameError, match='at most'):
        check_png(content, tmp_path / 'color.png')


GOOD = {'width': 4, 'height': 3, 'fx': 2.0, 'fy': 2.0, 'cx': 1.5, 'cy': 1.0}


def test_distortion_is_read(tmp_path):
    path = tmp_path / 'camera.json'
    d = [0.1, -0.2, 0.0, 0.0, 0.05]
    path.write_text(json.dumps({**GOOD, 'distortion_model': 'plumb_bob', 'd': d}))
    camera = load_camera(path)
    assert camera.distortion_model == 'plumb_bob'
    np.testing.assert_array_equal(camera.d, d)


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        ('', 'expected JSON'),
        ('{"width": 4', 'expected JSON'),
        ('[1, 2]', 'expected a JSON object, found list'),
        ('[' * 100_000, 'nested too deeply'),
        (json.dumps({**GOOD, 'width': 4.5}), 'width as a whole number'),
        (json.dumps({**GOOD, 'width': True}), 'width as a finite number'),
        (json.dumps({**GOOD, 'fx': '525'}), "fx as a finite number, found '525'"),
        (json.dumps({**GOOD, 'fx': float('nan')}), 'fx as a finite number'),
        (json.dumps({**GOOD, 'fx': 10**400}), 'fx as a finite number'),
        ('{"width": ' + '9' * 5000 + '}', 'expected'),
        (json.dumps({**GOOD, 'fy': -2}), 'fx and fy of'),
        (json.dumps({**GOOD, 'height': 0}), 'positive size'),
        (json.dumps({k: v for k, v in GOOD.items() if k != 'cx'}), 'cx .*found nothing'),
        (json.dumps({**GOOD, 'd': 3}), 'd as a list'),
        (json.dumps({**GOOD, 'd': [1, None, 2, 3]}), 'd as a finite number'),
        (json.dumps({**GOOD, 'd': [1, 2, 3], 'distortion_model': 'plumb_bob'}), 'expected'),
        (json.dumps({**GOOD, 'd': [1, 2, 3, 4], 'distortion_model': 'fancy'}), 'expected'),
        (json.dumps({**GOOD, 'd': [1, 2, 3, 4], 'distortion_model': 7}), 'distortion_model'),
    ],
    ids=range(18),
)
def test_a_camera_that_is_none_gets_one_line_that_says_why(tmp_path, text, sentence):
    path = tmp_path / 'camera.json'
    path.write_text(text)
    with pytest.raises(FrameError, match=sentence) as caught:
        load_camera(path)
    assert str(path) in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_camera_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / 'camera.json'
    path.write_bytes(b'\xff\xfe\x00{')
    with pytest.raises(FrameError, match='expected JSON'):
        load_camera(path)
