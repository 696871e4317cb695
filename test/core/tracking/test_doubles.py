"""Two tracks of one person: the younger ends."""

import numpy as np
from support.stage import Stage

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.tracking.doubles import doubles
from pop_core.tracking.tracking_config import TrackingConfig

EVERY_FRAME = TrackingConfig(detect_every=1)


def test_a_younger_track_that_comes_to_where_an_older_one_is_ends(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body, EVERY_FRAME)
    aside = person.replaced(transl=person.transl + [-0.9, 0.0, 0.2])
    stage.show(person, aside, times=4)
    older, younger = sorted(stage.tracker._tracks, key=lambda track: track.id)
    younger.filter = older.filter
    shown = stage.show(person, times=2)
    assert [found.track.id for found in shown] == [older.id]
    assert [track.id for track in stage.tracker._tracks] == [older.id]


def test_people_beside_or_before_each_other_are_two(
    body: BodyModel, person: BodyParameters
) -> None:
    for step in ([-0.6, 0.0, 0.0], [0.25, 0.0, 0.8]):
        stage = Stage(body, EVERY_FRAME)
        other = person.replaced(transl=person.transl + np.array(step))
        shown = stage.show(person, other, times=4)
        assert len(shown) == 2
        assert not doubles(shown)
