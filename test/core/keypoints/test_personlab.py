import time

import numpy as np
import pytest
from personlab_maps import STRIDE, perfect_maps, standing

from pop_core.keypoints import personlab
from pop_core.keypoints.network import NetworkSpec, TensorSpec
from pop_core.keypoints.personlab import PersonLabDecoder, decode_people, read_maps


def matched(found, people):
    """Return the largest error of each person's keypoints, by the nearest decoded person."""
    return [min(np.abs(f[:, :2] - p).max() for f in found) for p in people]


@pytest.mark.parametrize('people', [
    [standing(300, 240, 300)],
    [standing(150, 240, 300), standing(450, 230, 260)],
    [standing(100, 200, 200), standing(220, 220, 220), standing(330, 210, 210),
     standing(450, 230, 240), standing(560, 200, 200)],
])
def test_people_come_back_from_perfect_maps(people):
    found = decode_people(perfect_maps(people), 32.0)
    assert len(found) == len(people)
    assert max(matched(found, people)) < 1e-2  # float32 offsets of some hundred pixels


def test_an_empty_map_holds_nobody():
    maps = perfect_maps([standing(300, 240, 300)])
    maps.scores[:] = 0.1
    assert decode_people(maps, 32.0) == []


def test_a_person_with_hidden_legs_keeps_their_low_scores():
    maps = perfect_maps([standing(300, 240, 300)])
    maps.scores[:, :, 13:] = 0.05
    (person,) = decode_people(maps, 32.0)
    assert person[13:, 2].max() < 0.06
    assert person[:13, 2].min() > 0.6


def test_codes_and_values_decode_to_the_same_people():
    people = [standing(150, 240, 300), standing(450, 230, 260)]
    maps = perfect_maps(people)
    logits = np.clip(np.log(maps.scores / (1 - maps.scores + 1e-6) + 1e-6), -9, 9)
    values = [logits, maps.short.reshape(31, 41, 34), maps.mid.reshape(31, 41, 64)]
    zeros = (personlab.HEAT_ZERO, personlab.HEAT_ZERO, personlab.MID_ZERO)
    steps = (personlab.HEAT_STEP, personlab.HEAT_STEP, personlab.MID_STEP)
    codes = [
        np.clip(np.rint(value / step + zero), 0, 255).astype(np.uint8)[None]
        for value, step, zero in zip(values, steps, zeros, strict=True)
    ]
    read = read_maps(codes, 641)
    assert read.stride == STRIDE
    found = decode_people(read, 32.0)
    assert len(found) == 2
    # Two short offsets of half a code (0.04 px) end every path through the coarser mid offsets.
    assert max(matched(found, people)) < 0.1


def test_decoding_five_people_takes_a_few_milliseconds():
    people = [standing(x, 220, 210) for x in (80, 200, 320, 440, 560)]
    maps = perfect_maps(people)
    decode_people(maps, 32.0)
    assert shortest_ms(lambda: decode_people(maps, 32.0)) < 15.0


def shortest_ms(call):
    times = []
    for _ in range(10):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def test_the_decoder_runs_in_pixels_of_the_image():
    spec = NetworkSpec(
        (TensorSpec('image', (1, 481, 641, 3), 'uint8'),),
        (TensorSpec('mid', (1, 31, 41, 64), 'float32'),
         TensorSpec('heat', (1, 31, 41, 17), 'float32'),
         TensorSpec('short', (1, 31, 41, 34), 'float32')))
    assert PersonLabDecoder.fits(spec)
    maps = perfect_maps([standing(300, 240, 300)])
    logits = np.log((maps.scores + 1e-6) / (1 - maps.scores + 1e-6))

    def run(tensor):
        assert tensor.shape == (1, 481, 641, 3)
        return [maps.mid.reshape(1, 31, 41, 64), logits[None],
                maps.short.reshape(1, 31, 41, 34)]

    # An image of half the network's size: its pixels are half as many.
    (person,) = PersonLabDecoder(spec).detect(np.zeros((240, 320, 3), np.uint8), run)
    nose_network = standing(300, 240, 300)[0, ::-1]
    # 2x enlargement, one leftover row and column split by rounding: within a pixel.
    np.testing.assert_allclose(person.keypoints_px[8], (nose_network + 0.5) / 2 - 0.5, atol=0.6)
