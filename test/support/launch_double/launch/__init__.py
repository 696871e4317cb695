"""The few classes of ROS 2's launch that our launch file uses; pip does not have the real ones.

They only keep what they are given, and reject arguments that the real ones do not have.
"""


class LaunchDescriptionEntity:
    pass


class LaunchContext:
    def __init__(self) -> None:
        self.launch_configurations: dict[str, str] = {}


class LaunchDescription:
    def __init__(self, initial_entities: list[LaunchDescriptionEntity]) -> None:
        self.entities = initial_entities
