"""What scenes are drawn from: a set for measuring, a wider one for training."""

from __future__ import annotations

from dataclasses import dataclass, field

from pop_core.synthesis.cameras import CameraRange


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """What scenes are drawn from.

    Args:
        people: Fewest and most people.
        pose_shares: Kind of pose and its share.
        hidden_share: Lowest and highest share of hidden joints of the most hidden person.
        fewest_visible: Shared points that the camera must see of everybody.
        occluders: Fewest and most things put between camera and people.
        clutter: Most things along the walls.
        prop_share: Share of people who carry something.
        child_share: Share of children.
        bare_share: Share of people without clothes, whose T-pose can be compared with truth.
        sensors: Presets of sensor noise, one drawn per scene; empty leaves depth perfect.
        colour: Whether to shade a colour image; black without.
        cameras: What cameras are drawn from.
    """

    people: tuple[int, int] = (1, 3)
    pose_shares: tuple[tuple[str, float], ...] = (
        ('standing', 0.2), ('motion', 0.2), ('walking', 0.1), ('seated', 0.22),
        ('reaching', 0.1), ('bending', 0.06), ('crouching', 0.07), ('lying', 0.05))
    hidden_share: tuple[float, float] = (0.2, 0.6)
    fewest_visible: int = 5
    occluders: tuple[int, int] = (1, 2)
    clutter: int = 5
    prop_share: float = 0.1
    child_share: float = 0.1
    bare_share: float = 0.25
    sensors: tuple[str, ...] = ('structured_light', 'stereo', 'time_of_flight')
    colour: bool = True
    cameras: CameraRange = field(default_factory=CameraRange)


def training_config(width: int = 320, height: int = 256) -> SceneConfig:
    """Return the wide set of scenes that a detector is trained on: also empty and crowded ones."""
    cameras = CameraRange(
        width, height, focal=(0.6, 1.3), distance_m=(0.8, 6.0), height_m=(0.5, 2.8), aim_m=0.4,
        roll_deg=10.0)
    return SceneConfig(
        people=(0, 6), hidden_share=(0.0, 1.0), fewest_visible=0, occluders=(0, 3), clutter=8,
        prop_share=0.25, child_share=0.2, bare_share=0.1, colour=False,
        cameras=cameras)
