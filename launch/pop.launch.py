"""Start the node for a camera, and rviz2 if asked for.

ros2 launch pop_ros pop.launch.py camera:=realsense rviz:=true
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import (
    DeclareLaunchArgument,
    LogInfo,
    OpaqueFunction,
    SetEnvironmentVariable,
)
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from pop_ros.camera_presets import CAMERA_PRESETS, camera_preset

SHARE = Path(get_package_share_directory('pop_ros'))
CONFIG = SHARE / 'config'
ARGUMENTS = {
    'camera': ('realsense', f'driver whose topics are read: {", ".join(CAMERA_PRESETS)}'),
    'color': ('', 'colour topic, if not that of the driver'),
    'depth': ('', 'registered depth topic, if not that of the driver'),
    'info': ('', 'CameraInfo topic of colour, if not that of the driver'),
    'keypoints': ('depth', 'json, depth, an ONNX network or a name of pop models list; commas'),
    'keypoints_dir': ('', 'folder of <stamp_ns>.json files, for keypoints:=json'),
    'decoder': ('', 'decoder of a network whose outputs do not tell'),
    'body': ('', 'body model made by pop body import, in place of the default body'),
    'library': ('', 'pose library made by pop library build, in place of the default one'),
    'params_file': ('pop.yaml', 'files of parameters with commas between, later ones win; names '
                    'without a folder are those of the package: '
                    + ', '.join(path.name for path in sorted(CONFIG.glob('*.yaml')))),
    'rviz': ('false', 'whether to start rviz2'),
    'large_data': ('true', 'whether to use shared memory that holds images (Fast DDS)'),
}
OPTIONAL = ('keypoints_dir', 'decoder', 'body', 'library')  # flags of the node, where given


def parameter_files(text: str) -> list[str]:
    """Return the files named with commas between; plain names are files of the package."""
    names = [Path(name.strip()) for name in text.split(',') if name.strip()]
    return [str(CONFIG / name if name.name == str(name) and not name.is_file() else name)
            for name in names]


def start_node(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the node, its topics taken from the preset and overridden by name."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    preset = camera_preset(given['camera'])
    topics = preset.topics
    flags = ['--keypoints', given['keypoints']]
    for name in OPTIONAL:
        if given[name]:
            flags += [f'--{name.replace("_", "-")}', given[name]]
    advice = LogInfo(msg=f'pop reads {given["camera"]}; {preset.driver} needs: {preset.hint}')
    return [advice, Node(
        package='pop_ros', executable='pop_node', name='pop', output='screen', arguments=flags,
        parameters=parameter_files(given['params_file']),
        remappings=[
            ('color/image', given['color'] or topics.color),
            ('depth/image', given['depth'] or topics.depth),
            ('color/camera_info', given['info'] or topics.info),
        ])]


def generate_launch_description() -> LaunchDescription:
    """Return arguments, node and rviz2."""
    declared = [DeclareLaunchArgument(name, default_value=value, description=about)
                for name, (value, about) in ARGUMENTS.items()]
    profile = SetEnvironmentVariable(
        'FASTRTPS_DEFAULT_PROFILES_FILE', str(CONFIG / 'fastdds_large_data.xml'),
        condition=IfCondition(LaunchConfiguration('large_data')))
    rviz = Node(
        package='rviz2', executable='rviz2', name='rviz2',
        arguments=['-d', str(SHARE / 'rviz' / 'pop.rviz')],
        condition=IfCondition(LaunchConfiguration('rviz')))
    return LaunchDescription([*declared, profile, OpaqueFunction(function=start_node), rviz])
