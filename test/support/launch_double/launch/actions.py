from launch import LaunchDescriptionEntity


class Action(LaunchDescriptionEntity):
    def __init__(self, *, condition=None) -> None:
        self.condition = condition


class DeclareLaunchArgument(Action):
    def __init__(self, name, *, default_value=None, description=None) -> None:
        super().__init__()
        self.name, self.default_value, self.description = name, default_value, description


class LogInfo(Action):
    def __init__(self, *, msg, **settings) -> None:
        super().__init__(**settings)
        self.msg = msg


class OpaqueFunction(Action):
    def __init__(self, *, function, **settings) -> None:
        super().__init__(**settings)
        self.function = function


class SetEnvironmentVariable(Action):
    def __init__(self, name, value, **settings) -> None:
        super().__init__(**settings)
        self.name, self.value = name, value
