"""Laws of the pairer: colour is the clock, exact stamps first, then the nearest in the slop."""

import numpy as np
import pytest

from pop_ros.pairing import HOLD_NS, FramePairer

MS = 1_000_000
Event = tuple[str, int, int]  # kind (c or d), stamp [ms], arrival [ms]


def play(pairer: FramePairer[int], events: list[Event]) -> list[tuple[int, int]]:
    """Feed (kind, stamp_ms, arrival_ms) events; return (colour, depth) stamps in ms."""
    pairs = []
    for kind, stamp_ms, arrival_ms in events:
        add = pairer.add_color if kind == 'c' else pairer.add_depth
        pairs += add(stamp_ms * MS, stamp_ms, arrival_ms * MS)
    return [(pair.color, pair.depth) for pair in pairs]


def finish(pairer: FramePairer[int], events: list[Event]) -> list[tuple[int, int]]:
    pairs = play(pairer, events)
    return pairs + [(pair.color, pair.depth) for pair in pairer.flush()]


def test_equal_stamps_pair_at_once_in_either_order() -> None:
    for order in ('cd', 'dc'):
        pairer = FramePairer(0)
        assert play(pairer, [(kind, 100, 100) for kind in order]) == [(100, 100)]


def test_any_interleaving_of_exact_stamps_gives_every_pair_once() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        stamps = [33 * i for i in range(12)]
        lag = rng.uniform(0, 90, 12)
        events = [('c', s, s) for s in stamps] + [
            ('d', s, int(s + late)) for s, late in zip(stamps, np.sort(lag), strict=True)]
        events.sort(key=lambda event: event[2])
        assert sorted(finish(FramePairer(20 * MS), events)) == [(s, s) for s in stamps]


def test_exact_stamp_beats_a_nearer_arrival() -> None:
    events = [('d', 95, 0), ('c', 100, 1), ('d', 100, 2)]
    assert finish(FramePairer(50 * MS), events) == [(100, 100)]


def test_nearest_depth_is_taken_whichever_side_it_lies_on() -> None:
    for depths, expected in (((90, 104, 130), 104), ((97, 110), 97)):
        events = [('c', 100, 0), *(('d', d, i) for i, d in enumerate(depths)), ('c', 200, 9)]
        assert (100, expected) in finish(FramePairer(50 * MS), events)


def test_known_period_pairs_without_waiting_for_the_next_image() -> None:
    pairer = FramePairer(20 * MS)
    start = [(kind, 33 * i + offset, 33 * i + offset)
             for i in range(4) for kind, offset in (('c', 0), ('d', 5))]
    play(pairer, start)
    assert play(pairer, [('c', 132, 132), ('d', 137, 137)]) == [(132, 137)]


def test_a_depth_image_goes_to_the_colour_image_nearest_to_it() -> None:
    # Colour at 30 Hz, depth at 15 Hz: the colour image between two depth images stays alone.
    events = []
    for i in range(6):
        events.append(('c', 33 * i, 33 * i))
        if i % 2 == 0:
            events.append(('d', 33 * i + 4, 33 * i + 4))
    pairer = FramePairer(33 * MS)
    assert finish(pairer, events) == [(0, 4), (66, 70), (132, 136)]
    assert pairer.statistics.missed == 3


def test_no_depth_image_is_used_twice() -> None:
    rng = np.random.default_rng(7)
    for _ in range(40):
        events = [('c', int(s), int(s)) for s in np.sort(rng.integers(0, 900, 25))]
        events += [('d', int(s), int(s)) for s in np.sort(rng.integers(0, 900, 15))]
        events.sort(key=lambda event: event[2])
        pairs = finish(FramePairer(60 * MS), events)
        depths = [depth for _, depth in pairs]
        stamps = {stamp for kind, stamp, _ in events if kind == 'd'}
        assert len(depths) == len(set(depths))
        assert stamps.issuperset(depths)
        assert all(abs(color - depth) <= 60 for color, depth in pairs)


def test_stamps_beyond_the_slop_never_pair_and_the_gap_is_told() -> None:
    pairer = FramePairer(50 * MS)
    assert finish(pairer, [('c', 522, 0), ('d', 313, 1)]) == []
    assert pairer.statistics.missed == 1
    assert pairer.statistics.missed_gap_ns == 209 * MS


def test_a_single_early_depth_pairs_once_the_colour_image_has_waited() -> None:
    pairer = FramePairer(400 * MS)
    assert play(pairer, [('c', 522, 0), ('d', 313, 1)]) == []
    assert pairer.poll(pairer.wait_ns) == []
    pair, = pairer.poll(pairer.wait_ns + 1)
    assert (pair.color, pair.depth, pair.skew_ns) == (522, 313, -209 * MS)


def test_a_gap_of_exactly_the_slop_is_accepted_and_a_nanosecond_more_is_not() -> None:
    for extra, count in ((0, 1), (1, 0)):
        pairer = FramePairer(50 * MS)
        pairer.add_depth(0, 0, 0)
        pairer.add_color(50 * MS + extra, 1, 0)
        assert len(pairer.flush()) == count


@pytest.mark.parametrize('lag', [0, 1, 3])
@pytest.mark.parametrize('offset', [0, 6])
def test_a_bag_that_loops_three_times_gives_every_pair_every_time(lag: int, offset: int) -> None:
    """Depth lags `lag` messages behind colour, also across the jump back in time."""
    stamps = [33 * i for i in range(10)] * 3
    pairer = FramePairer(15 * MS)
    events = []
    for i in range(len(stamps) + lag):
        if i < len(stamps):
            events.append(('c', stamps[i], 33 * i))
        if i >= lag:
            events.append(('d', stamps[i - lag] + offset, 33 * i))
    pairs = finish(pairer, events)
    expected = sorted((s, s + offset) for s in stamps)
    assert sorted(pairs) == expected
    assert pairer.color_stream.jumps_back == 2


def test_depth_of_an_earlier_run_is_forgotten() -> None:
    pairer = FramePairer(15 * MS)
    play(pairer, [('d', 100, 0), ('d', 5000, 10)])
    later_ms = HOLD_NS // MS + 11
    assert finish(pairer, [('d', 0, later_ms), ('c', 100, later_ms)]) == []


def test_when_depth_stops_colour_images_do_not_pile_up() -> None:
    pairer = FramePairer(15 * MS)
    play(pairer, [('c', 33 * i, 0) for i in range(500)])
    assert pairer.statistics.missed == 490
    assert len(pairer.flush()) == 0


def test_pairs_of_one_run_come_in_the_order_of_colour_stamps() -> None:
    events = [('c', 33 * i, 33 * i) for i in range(8)]
    events += [('d', 33 * i + 2, 250 + i) for i in range(8)]
    colors = [color for color, _ in finish(FramePairer(10 * MS), events)]
    assert colors == [33 * i for i in range(8)]
