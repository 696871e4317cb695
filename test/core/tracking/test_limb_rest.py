import numpy as np

from pop_core.tracking.limb_rest import FIRST_REST_S, LONGEST_REST_S, LimbRests

ARM, LEG = np.arange(24) == 20, np.arange(24) == 7


def seconds(value):
    return round(value * 1e9)


def test_a_limb_looked_for_in_vain_rests_longer_each_time_up_to_a_limit():
    rests, now_ns, waits = LimbRests(), 0, []
    for _ in range(6):
        rests.missed(ARM, now_ns)
        wait_ns = next(k for k in range(0, seconds(2.0), seconds(0.05))
                       if not rests.rests(ARM, now_ns + k))
        waits.append(wait_ns * 1e-9)
        now_ns += wait_ns
    assert waits[0] >= FIRST_REST_S
    assert waits == sorted(waits)
    assert LONGEST_REST_S <= waits[-1] <= LONGEST_REST_S + 0.05


def test_other_limbs_do_not_rest():
    rests = LimbRests()
    rests.missed(ARM, 0)
    assert rests.rests(ARM, 0)
    assert not rests.rests(LEG, 0)
    assert not rests.rests(ARM | LEG, 0)


def test_a_limb_that_was_found_is_looked_for_at_once_when_lost_again():
    rests = LimbRests()
    for _ in range(4):
        rests.missed(ARM, 0)
    rests.found(ARM)
    assert not rests.rests(ARM, 0)
    rests.missed(ARM, 0)
    assert not rests.rests(ARM, seconds(FIRST_REST_S) + 1)
