"""Outputs for tools that know other people messages, where their packages are installed.

A package of another version than the converter was written for is found out once, by converting
a person of no importance, and its output is left away with a reason.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from std_msgs.msg import Header

from pop_core.body.joints import N_JOINTS
from pop_core.body.model import rest_parameters
from pop_core.estimate import BodyEstimate
from pop_core.geometry.camera import Camera
from pop_ros import interop_hri, interop_vision, interop_yolo, interop_zed
from pop_ros.interop_person import POINT_NAMES, Person
from pop_ros.message_packages import message_module

Convert = Callable[[Sequence[Person], Header, Any], Any]


@dataclass(frozen=True, slots=True)
class Interop:
    """One output in another package's messages.

    Args:
        package: Package of the messages.
        kind: Message type.
        convert: Called with people, header and the module of the messages.
    """

    package: str
    kind: str
    convert: Convert


INTEROP = {
    'vision_detections': Interop(
        'vision_msgs', 'Detection3DArray', interop_vision.detections_message),
    'yolo_detections': Interop('yolo_msgs', 'DetectionArray', interop_yolo.detections_message),
    'zed_objects': Interop('zed_msgs', 'ObjectsStamped', interop_zed.objects_message),
}


def misfit(package: str, try_out: Callable[[Any], object]) -> str:
    """Return why a package's messages cannot be written, or '' if they can."""
    module = message_module(package)
    if module is None:
        return f'{package} is not installed'
    try:
        try_out(module)
    # What generated messages raise for fields, types and lengths they do not have.
    except (AttributeError, AssertionError, TypeError, ValueError) as error:
        return f'{package} is of another version: {error}'
    return ''


def interop_message(name: str, people: Sequence[Person], header: Header) -> Any:
    """Return the message of one of INTEROP_TYPES."""
    interop = INTEROP[name]
    return interop.convert(people, header, message_module(interop.package))


def _trial_person() -> Person:
    n = len(POINT_NAMES)
    points, identity = np.arange(3.0 * n).reshape(n, 3), np.tile(np.eye(3), (N_JOINTS, 1, 1))
    body = BodyEstimate(
        rest_parameters(), points, points[:N_JOINTS], identity, np.zeros(N_JOINTS, np.int64),
        identity, np.ones((2, 2), bool), 0.5)
    return Person(
        0, body, Camera(2, 2, 1.0, 1.0, 0.5, 0.5), points, points[:, :2], np.ones(n, bool),
        np.ones(n), np.array([[0.0, 0, 1], [1, 1, 2]]), np.array([0.0, 0, 1, 1]))


def _try_hri(hri_msgs: Any) -> None:
    person, header = _trial_person(), Header()
    interop_hri.ids_message(['trial'], header, hri_msgs)
    interop_hri.skeleton_message(person, header, hri_msgs)
    interop_hri.region_message(person, header, hri_msgs)


def _try_out(convert: Convert) -> Callable[[Any], object]:
    return lambda module: convert([_trial_person()], Header(), module)


# Why an output is not there, or '', by output.
MISFITS = {name: misfit(i.package, _try_out(i.convert)) for name, i in INTEROP.items()}
# Message types by output, of the packages that are installed and fit.
INTEROP_TYPES: dict[str, Any] = {
    name: getattr(message_module(i.package), i.kind)
    for name, i in INTEROP.items() if not MISFITS[name]}
HRI_MISFIT = misfit('hri_msgs', _try_hri)
