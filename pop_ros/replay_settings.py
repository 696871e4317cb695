"""The settings that a replay fits with: those of the pipeline and those of the node."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from pop_core.config import PipelineConfig
from pop_core.errors import SettingError
from pop_core.settings import list_settings
from pop_ros.node_config import NodeConfig
from pop_ros.settings_flags import pair_with_flags

SLOP = 'sync.slop_s'


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Settings of the pipeline, and of the node around it.

    Args:
        pipeline: Settings of the pipeline.
        node: Settings of messages and of the tracker.
    """

    pipeline: PipelineConfig = field(default_factory=PipelineConfig)
    node: NodeConfig = field(default_factory=NodeConfig)

    @classmethod
    def of_flags(cls, flags: Sequence[str]) -> ReplaySettings:
        """Return the defaults with `NAME=VALUE` flags applied.

        Raises:
            SettingError: If a flag fits no setting, or one that a replay decides itself.
        """
        pipeline, node = pair_with_flags(PipelineConfig(), NodeConfig(), flags)
        if any(flag.partition('=')[0] == SLOP for flag in flags):
            raise SettingError(f'--set: expected {SLOP} as --slop, found it among the settings')
        if not (node.autostart and node.enabled):
            raise SettingError(
                '--set: expected autostart and enabled to stay true, found a node that would not '
                'work')
        return cls(pipeline, node)

    def as_ros_arguments(self) -> list[str]:
        """Return the parameters of a node that has these settings; it knows the defaults."""
        given = [*_changes(self.pipeline, PipelineConfig()), *_changes(self.node, NodeConfig())]
        # Values are YAML: without quotes `off` would be a truth value and `1` a number. JSON's
        # numbers, truth values and quoted texts are YAML's too.
        return [word for name, value in given
                for word in ('-p', f'{name}:={json.dumps(value, ensure_ascii=False)}')]


def _changes(config: Any, defaults: Any) -> list[tuple[str, Any]]:
    """Return the settings that differ from their defaults."""
    pairs = zip(list_settings(config), list_settings(defaults), strict=True)
    return [(item.name, item.default) for item, usual in pairs if item.default != usual.default]
