"""Settings of people.* reach every network that finds people, at start and later."""

from pathlib import Path

import numpy as np
from support.onnx_files import save_network

from pop_core.config import PipelineConfig
from pop_core.keypoints.depth_votes import DepthNetConfig
from pop_core.keypoints.fusion import FusionConfig
from pop_core.keypoints.people_selection import PeopleConfig
from pop_ros.frame_fitter import FrameFitter
from pop_ros.keypoint_sources import apply_settings, keep_people, make_detector
from pop_ros.node_config import NodeConfig

STRICT = PeopleConfig(min_person_score=0.7)


def yolo(path: Path) -> Path:
    """Write a network that sees nobody, in the shape of YOLO's pose networks."""
    nobody = np.zeros((1, 56, 8400), np.float32)
    return save_network(path, {'output0': nobody}, (1, 3, 640, 640), 'float32')


def test_one_network_and_each_of_several_keep_the_people_they_are_told_to(
    tmp_path: Path
) -> None:
    a, b = yolo(tmp_path / 'a.onnx'), yolo(tmp_path / 'b.onnx')
    one, several = make_detector(str(a)), make_detector(f'{a},{b}')
    for detector in (one, several):
        keep_people(detector, STRICT)
    assert one.config is STRICT
    assert [part.config for part in several.people] == [STRICT, STRICT]


def test_settings_of_fusion_reach_the_source_that_merges(tmp_path: Path) -> None:
    merged = make_detector(f'{yolo(tmp_path / "a.onnx")},{yolo(tmp_path / "b.onnx")}')
    fusion = FusionConfig(same_person=0.6)
    fitter = FrameFitter(merged, PipelineConfig(fusion=fusion), NodeConfig())
    assert merged.config is fusion
    fitter.configure(PipelineConfig(), NodeConfig())
    assert merged.config.same_person == FusionConfig().same_person


def test_the_node_s_settings_reach_the_network_at_start_and_later(tmp_path: Path) -> None:
    detector = make_detector(str(yolo(tmp_path / 'a.onnx')))
    fitter = FrameFitter(detector, PipelineConfig(people=STRICT), NodeConfig())
    assert detector.config is STRICT
    fitter.configure(PipelineConfig(), NodeConfig())
    assert detector.config.min_person_score == PeopleConfig().min_person_score


def test_settings_of_the_depth_network_reach_it_alone_and_among_others(tmp_path: Path) -> None:
    alone, merged = make_detector('depth'), make_detector(f'depth,{yolo(tmp_path / "a.onnx")}')
    config = PipelineConfig(depth_net=DepthNetConfig(min_person_score=0.6))
    for detector in (alone, merged):
        apply_settings(detector, config)
    assert alone.config is config.depth_net
    assert config.depth_net in [part.config for part in merged.people]
