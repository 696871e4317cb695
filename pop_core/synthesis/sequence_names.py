"""Kinds of sequences by name, for those who only want to name one."""

from __future__ import annotations

from enum import Enum


class SequenceKind(str, Enum):
    """What happens in a sequence."""

    TABLE = 'table'
    CROSSING = 'crossing'
    THREE = 'three'
    WALL = 'wall'
    LEAVING = 'leaving'
    SITTING = 'sitting'
    TURNING = 'turning'
    ARMS = 'arms'
    CAMERA = 'camera'
    STILL = 'still'


ABOUT = {
    SequenceKind.TABLE: 'one person walks to and fro behind a table',
    SequenceKind.CROSSING: 'two people walk to and fro, the nearer hides the other in passing',
    SequenceKind.THREE: 'the same with a third person who stands between them and waves',
    SequenceKind.WALL: 'one person passes behind a wall, hidden for more than a second',
    SequenceKind.LEAVING: 'one person walks out of the image, turns there and comes back',
    SequenceKind.SITTING: 'one person sits down behind a table and stands up again',
    SequenceKind.TURNING: 'one person turns round on the spot behind a table',
    SequenceKind.ARMS: 'one person behind a counter moves the arms fast',
    SequenceKind.CAMERA: 'the walk behind a table, seen by a camera that moves',
    SequenceKind.STILL: 'one person stands behind a table and does not move at all',
}
