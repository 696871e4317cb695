"""Quality of service: subscribe as the publisher offers, and say it in words."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

# Of the images that wait in the middleware only a few matter: old ones are never fitted.
INPUT_DEPTH = 5
OUTPUT_DEPTH = 5
STATIC_TF_DEPTH = 100  # one per publisher, and every publisher counts


def matched_qos(
    offers: Sequence[QoSProfile], *, latched: bool = False, reliability: str = 'auto'
) -> QoSProfile:
    """Return the strictest profile that receives from every publisher.

    A VGA image is larger than the default shared-memory segment, so a best-effort subscriber of
    a reliable publisher loses half of the images, and a reliable subscriber of a best-effort
    publisher receives nothing at all.

    Args:
        offers: What each publisher of the topic offers.
        latched: Whether to ask for the last message from before the subscription where offered.
        reliability: 'auto', or 'reliable' or 'best_effort' to insist.
    """
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    if reliability != 'auto':
        reliable = reliability == 'reliable'
    keeps = latched and all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(  # type: ignore[no-untyped-call]
        history=HistoryPolicy.KEEP_LAST,
        depth=INPUT_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if keeps else DurabilityPolicy.VOLATILE,
    )


def output_qos(*, latched: bool = False) -> QoSProfile:
    """Return the profile of the node's outputs: reliable, so that every subscriber matches."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(  # type: ignore[no-untyped-call]
        history=HistoryPolicy.KEEP_LAST, depth=1 if latched else OUTPUT_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE, durability=durability)


def static_tf_qos() -> QoSProfile:
    """Return the profile of /tf_static: the last messages of all its publishers."""
    return QoSProfile(  # type: ignore[no-untyped-call]
        history=HistoryPolicy.KEEP_LAST, depth=STATIC_TF_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def describe_qos(profile: QoSProfile) -> str:
    """Return reliability and durability in words."""
    reliable = profile.reliability == ReliabilityPolicy.RELIABLE
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return f'{"reliable" if reliable else "best effort"}{", latched" if latched else ""}'


def same_qos(a: QoSProfile, b: QoSProfile) -> bool:
    """Return whether two profiles receive the same way."""
    return bool(a.reliability == b.reliability and a.durability == b.durability)
