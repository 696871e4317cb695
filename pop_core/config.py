"""All settings of the pipeline, nested by stage; ROS parameters and flags are derived from it."""

from __future__ import annotations

from dataclasses import dataclass, field

from pop_core.fitting.fitting_config import FittingConfig
from pop_core.keypoints.depth_votes import DepthNetConfig
from pop_core.keypoints.fusion import FusionConfig
from pop_core.keypoints.lifting import LiftingConfig
from pop_core.keypoints.people_selection import PeopleConfig
from pop_core.keypoints.region import RegionConfig
from pop_core.retrieval.retrieve import RetrievalConfig
from pop_core.segmentation.body_segmentation import SegmentationConfig
from pop_core.settings import setting


@dataclass(frozen=True, slots=True)
class PipelineConfig:
    """Settings of `BodyPipeline`."""

    max_people: int = setting(
        6, minimum=1, maximum=50, about='Most people fitted in one frame, nearest first.')
    max_range_m: float = setting(
        8.0, unit='m', minimum=0.5, maximum=100.0,
        about='People whose torso is farther away are not fitted.')
    min_joints: int = setting(
        4, minimum=3, maximum=15,
        about='Fewest lifted joints a person is fitted to.')
    min_support: float = setting(
        0.35, minimum=0.0, maximum=1.0,
        about='Smallest share of the visible body that measured depth must agree with.')
    max_residual_m: float = setting(
        0.25, unit='m', minimum=0.02, maximum=2.0,
        about='Largest distance of the best library pose to the joints, root mean square.')
    use_ground: bool = setting(
        True, about='Whether the floor is looked for: feet stand on it and never below it.')
    use_completion: bool = setting(
        True, about='Whether a network says where hidden joints are expected, and which keypoints '
        'are wrong.')
    region: RegionConfig = field(default_factory=RegionConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    fusion: FusionConfig = field(default_factory=FusionConfig)
    depth_net: DepthNetConfig = field(default_factory=DepthNetConfig)
    lifting: LiftingConfig = field(default_factory=LiftingConfig)
    retrieval: RetrievalConfig = field(default_factory=RetrievalConfig)
    segmentation: SegmentationConfig = field(default_factory=SegmentationConfig)
    fitting: FittingConfig = field(default_factory=FittingConfig)
