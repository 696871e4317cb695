"""Laws of the rate limit: never faster than allowed, never slower than it must be."""

import numpy as np
import pytest

from pop_ros.rate_limit import RateLimit

SECOND_NS = 1_000_000_000


def admitted(stamps: np.ndarray, rate_hz: float) -> list[int]:
    limit = RateLimit()
    return [int(s) for s in stamps if limit.admit(int(s), rate_hz)]


@pytest.mark.parametrize('rate_hz', [1.0, 7.0, 10.0, 20.0, 29.0])
def test_a_jittering_camera_is_thinned_to_the_allowed_rate(rate_hz: float) -> None:
    rng = np.random.default_rng(2)
    stamps = np.sort(np.arange(900) * SECOND_NS // 30 + rng.integers(0, 8_000_000, 900))
    found = admitted(stamps, rate_hz)
    seconds = 30
    # Jitter moves some stamps behind the next period: those are lost.
    assert rate_hz * seconds * 0.95 - 1 <= len(found) <= rate_hz * seconds + 1
    assert np.diff(found).min() >= SECOND_NS / rate_hz / 2


def test_no_limit_and_a_limit_above_the_camera_s_rate_admit_everything() -> None:
    stamps = np.arange(60) * SECOND_NS // 30
    assert len(admitted(stamps, 0.0)) == len(admitted(stamps, 31.0)) == 60


def test_a_pause_is_not_made_up_for_by_a_burst() -> None:
    stamps = np.concatenate([[0], 10 * SECOND_NS + np.arange(30) * SECOND_NS // 30])
    assert len(admitted(stamps, 2.0)) == 1 + 3


def test_a_bag_that_starts_anew_is_admitted_at_once() -> None:
    limit = RateLimit()
    assert limit.admit(100 * SECOND_NS, 1.0)
    assert limit.admit(5 * SECOND_NS, 1.0)
    assert not limit.admit(5 * SECOND_NS + 1, 1.0)
