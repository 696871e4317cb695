"""The command line `pop`: one table of commands, each imported only when it is called."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module

import typer

from pop_core.errors import PopError

BAD_INPUT = 2
ROS_MODULES = ('rclpy', 'sensor_msgs', 'diagnostic_msgs', 'rcl_interfaces')
ABOUT = """Bodies of people from RGB-D images, hidden limbs included.

Start with [bold]pop demo[/bold], or fit a frame of your own:

  pop fit FRAME --out results

FRAME is a folder with color.png, depth.png (16 bit, millimetres unless camera.json
has a depth_scale) and camera.json.
"""


@dataclass(frozen=True, slots=True)
class Command:
    """One command: where it lives and what it does.

    Args:
        name: As typed after `pop`.
        module: Imported when the command is called.
        attribute: A function, or a typer app with commands of its own.
        about: One sentence for `pop --help`.
        passes_all: Whether everything after the name goes to the function, unparsed.
    """

    name: str
    module: str
    attribute: str
    about: str
    passes_all: bool = False


COMMANDS = (
    Command('fit', 'pop_ros.fit_command', 'fit', 'Fit the people of RGB-D frames on disk.'),
    Command('replay', 'pop_ros.replay_command', 'replay',
            'Feed a bag to the node, or straight through the pipeline, and record the bodies.'),
    Command('show', 'pop_ros.show_command', 'show',
            'Draw recorded bodies over their recording: 3D views, pictures, a film.'),
    Command('bag', 'pop_ros.bag_commands', 'app', 'Make bags of RGB-D frames on disk.'),
    Command('node', 'pop_ros.node', 'main',
            'Run the ROS 2 node: RGB-D topics in, bodies out.', passes_all=True),
    Command('viewer', 'pop_ros.viewer_command', 'main',
            'Show the bodies of a node in rviz on another machine.', passes_all=True),
    Command('relay-ros1', 'pop_ros.relay_ros1_command', 'relay_ros1',
            'Pass the outputs of a running node on to ROS 1.'),
    Command('demo', 'pop_ros.demo_command', 'demo',
            'Synthesise, play, fit, record and show an occluded person.'),
    Command('synth', 'pop_ros.synth_command', 'synth', 'Write synthetic frames with truth.'),
    Command('body', 'pop_ros.body_commands', 'app',
            'Inspect, import and picture body models.'),
    Command('library', 'pop_ros.library_commands', 'app',
            'Build and inspect pose libraries.'),
    Command('models', 'pop_ros.models_commands', 'app',
            'List, fetch and check networks that find keypoints.'),
    Command('doctor', 'pop_ros.doctor_command', 'doctor',
            'Check middleware, caches, message packages and cameras; say what to do.'),
    Command('version', 'pop_ros.version_command', 'version',
            'Print the versions of what results depend on.'),
)


def build_app(called: str | None) -> typer.Typer:
    """Return the command line with the called command loaded and the others named only."""
    app = typer.Typer(
        help=ABOUT, no_args_is_help=True, add_completion=False, rich_markup_mode='rich',
        pretty_exceptions_enable=False)
    app.callback()(_nothing)
    for command in COMMANDS:
        if command.name != called:
            app.command(command.name, help=command.about)(_nothing)
        elif command.passes_all:
            # Parsed by the command itself: ROS arguments would confuse any other parser.
            settings = {
                'ignore_unknown_options': True, 'allow_extra_args': True, 'help_option_names': []}
            app.command(command.name, context_settings=settings)(_passing(command))
        else:
            _mount(app, command)
    return app


def main() -> None:
    """Run `pop`; errors the package raises on purpose end as one line and exit code 2."""
    arguments = sys.argv[1:]
    called = next((word for word in arguments if not word.startswith('-')), None)
    try:
        build_app(called)(arguments, prog_name='pop')
    except (PopError, OSError) as error:  # a file that cannot be read or written, for example
        sys.stderr.write(f'pop {called}: {error}\n')
        sys.exit(BAD_INPUT)
    except ModuleNotFoundError as error:
        if error.name not in ROS_MODULES:
            raise
        sys.stderr.write(
            f'pop {called}: expected the rclpy of ROS 2, found none: source a ROS 2 installation, '
            'or use Python 3.10 to 3.13 on Linux x86-64, where pip installs it\n')
        sys.exit(BAD_INPUT)


def _mount(app: typer.Typer, command: Command) -> None:
    loaded = getattr(import_module(command.module), command.attribute)
    if isinstance(loaded, typer.Typer):
        app.add_typer(loaded, name=command.name, help=command.about)
    else:
        app.command(command.name)(loaded)


def _passing(command: Command) -> Callable[[typer.Context], None]:
    def run(context: typer.Context) -> None:
        function: Callable[[Sequence[str]], int] = getattr(
            import_module(command.module), command.attribute)
        raise typer.Exit(function(context.args))

    return run


def _nothing() -> None:
    """Stand for a command that was not called."""


if __name__ == '__main__':
    main()
