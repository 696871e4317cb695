from launch.actions import Action


class Node(Action):
    def __init__(
        self, *, package, executable, name=None, parameters=None, remappings=None,
        arguments=None, output='log', **settings
    ) -> None:
        super().__init__(**settings)
        self.package, self.executable, self.name = package, executable, name
        self.parameters, self.remappings = parameters or [], remappings or []
        self.arguments, self.output = arguments or [], output
