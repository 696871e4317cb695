"""Settings of the node itself, declared like those of the pipeline."""

from __future__ import annotations

from dataclasses import dataclass, field

from pop_core.errors import SettingError
from pop_core.settings import setting
from pop_core.tracking.tracking_config import TrackingConfig
from pop_ros.static_frames import parse_extrinsics

RELIABILITIES = ('auto', 'reliable', 'best_effort')
MESH_DETAILS = ('full', 'reduced', 'off')
TF_FRAMES = ('off', 'people', 'joints')


@dataclass(frozen=True, slots=True)
class SyncConfig:
    """How colour and depth are paired."""

    slop_s: float = setting(
        0.03, unit='s', minimum=0.0, maximum=10.0,
        about='Largest difference of the stamps of a colour image and its depth image.')


@dataclass(frozen=True, slots=True)
class InputConfig:
    """How inputs are subscribed."""

    reliability: str = setting(
        'auto', about='Reliability asked of publishers: auto (as offered), reliable, best_effort.')
    rectified: bool = setting(
        False, about='Images come with distortion taken out (image_rect): P holds, not K and D.')
    quarter_turns: int = setting(
        0, minimum=0, maximum=3,
        about='Counterclockwise quarter turns that bring the image upright: 2 for a camera that '
        'hangs upside down, 1 or 3 for one on its side.')


@dataclass(frozen=True, slots=True)
class DepthConfig:
    """How depth in a frame of its own is brought to colour."""

    extrinsics: str = setting(
        '', about='Depth camera in the color frame, "x y z qx qy qz qw" [m]; empty asks TF.')


@dataclass(frozen=True, slots=True)
class MeshConfig:
    """What is published on ~/mesh."""

    detail: str = setting(
        'full', about='Mesh to publish: full, reduced (fits default shared memory), off.')
    max_rate_hz: float = setting(
        0.0, unit='Hz', minimum=0.0, maximum=1000.0,
        about='Most meshes of a person per second, by the stamps of the images; 0 sends all.')
    lifetime_s: float = setting(
        0.0, unit='s', minimum=0.0, maximum=3600.0,
        about='Time after which rviz removes a mesh that is not renewed; 0 keeps it.')


@dataclass(frozen=True, slots=True)
class TfConfig:
    """What is published on /tf."""

    frames: str = setting(
        'off', about='TF frames: off, people (body_<id>), joints (also body_<id>/<joint>).')


@dataclass(frozen=True, slots=True)
class SnapshotConfig:
    """What ~/snapshot does."""

    folder: str = setting(
        'snapshots', about='Folder that ~/snapshot writes into, from where the node was started.')


@dataclass(frozen=True, slots=True)
class DiagnosticsConfig:
    """Beyond which values /diagnostics warns; 0 switches a warning off."""

    max_age_s: float = setting(
        1.0, unit='s', minimum=0.0, maximum=3600.0,
        about='Warn when the images are older than this when their people are published.')
    min_rate_hz: float = setting(
        0.0, unit='Hz', minimum=0.0, maximum=1000.0,
        about='Warn when fewer frames per second are fitted while somebody listens.')
    max_skew_s: float = setting(
        0.02, unit='s', minimum=0.0, maximum=10.0,
        about='Warn when stamps of colour and depth usually differ by more.')
    max_drops: float = setting(
        0.5, minimum=0.0, maximum=1.0,
        about='Warn when a larger share of the pairs is dropped for a fault of theirs.')


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """Settings of the node around the pipeline."""

    sync: SyncConfig = field(default_factory=SyncConfig)
    input: InputConfig = field(default_factory=InputConfig)
    depth: DepthConfig = field(default_factory=DepthConfig)
    mesh: MeshConfig = field(default_factory=MeshConfig)
    tf: TfConfig = field(default_factory=TfConfig)
    snapshot: SnapshotConfig = field(default_factory=SnapshotConfig)
    diagnostics: DiagnosticsConfig = field(default_factory=DiagnosticsConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    rep155: bool = setting(
        False, about='Publish people below /humans/bodies too (REP-155); needs hri_msgs.')
    autostart: bool = setting(
        True, about='Whether the node configures and activates itself; else its manager does.')
    lazy: bool = setting(
        True, about='Work only while somebody subscribes to an output.')
    enabled: bool = setting(True, about='Whether frames are processed.')

    def __post_init__(self) -> None:
        _check_choice('input.reliability', self.input.reliability, RELIABILITIES)
        _check_choice('mesh.detail', self.mesh.detail, MESH_DETAILS)
        parse_extrinsics(self.depth.extrinsics)
        _check_choice('tf.frames', self.tf.frames, TF_FRAMES)
        if self.rep155:
            _check_hri_msgs()


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise SettingError(f'{name}: expected one of {", ".join(choices)}, found {value!r}')


def _check_hri_msgs() -> None:
    from pop_ros.interop import HRI_MISFIT  # settings are read where no ROS is, too

    if HRI_MISFIT:
        raise SettingError(
            f'rep155: expected the messages of hri_msgs (ros-jazzy-hri-msgs), found none that '
            f'fit: {HRI_MISFIT}')
