import numpy as np

from pop_core.tracking.limb_rest import FIRST_REST_S, LONGEST_REST_S, LimbRests

ARM = np.arange(24) == 20


def seconds(value):
    return round(value * 1e9)


def test_a_limb_looked_for_in_vain_rests_longer_each_time_up_to_a_limit():
    rests, now_ns, waits = LimbRests(), 0, []
    for _ in range(6):
        rests.missed(ARM, now_ns)
        wait_ns = next(k for k in range(0, seconds(2.0), seconds(0.05))
                       if not rests.resting(now_ns + k)[ARM].any())
        waits.append(wait_ns * 1e-9)
        now_ns += wait_ns
    assert waits[0] >= FIRST_REST_S
    assert waits == sorted(waits)
    assert LONGEST_REST_S <= waits[-1] <= LONGEST_REST_S + 0.05


def test_other_limbs_do_not_rest():
    rests = LimbRests()
    rests.missed(ARM, 0)
    np.testing.assert_array_equal(rests.resting(0), ARM)


def test_a_limb_that_was_found_is_looked_for_at_once_when_lost_again():
    rests = LimbRests()
    for _ in range(4):
        rests.missed(ARM, 0)
    rests.found(ARM)
    assert not rests.resting(0).any()
    rests.missed(ARM, 0)
    assert not rests.resting(seconds(FIRST_REST_S) + 1).any()


def test_of_outcomes_in_order_the_last_counts():
    rests = LimbRests()
    rests.note([(ARM, False), (ARM, True)], 0)
    assert not rests.resting(0).any()
    rests.note([(ARM, True), (ARM, False)], 0)
    assert rests.resting(0)[ARM].all()
