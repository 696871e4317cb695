"""ROS parameters derived from the settings of the node and of the pipeline."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from pop_core.errors import PopError, SettingError
from pop_core.settings import Setting, Value, apply_settings, list_settings

NodeConfigT = TypeVar('NodeConfigT')
PipelineConfigT = TypeVar('PipelineConfigT')
INT_LIMIT = 2**63 - 1


def descriptor(item: Setting, *, read_only: bool = False) -> ParameterDescriptor:
    """Return the ROS description of a setting: sentence, unit and range."""
    unit = f' [{item.unit}]' if item.unit else ''
    described = ParameterDescriptor(
        name=item.name, description=f'{item.about}{unit}', read_only=read_only)
    if item.minimum is None and item.maximum is None:
        return described
    if isinstance(item.default, float):
        low = -sys.float_info.max if item.minimum is None else float(item.minimum)
        high = sys.float_info.max if item.maximum is None else float(item.maximum)
        described.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    else:
        low_int = -INT_LIMIT if item.minimum is None else int(item.minimum)
        high_int = INT_LIMIT if item.maximum is None else int(item.maximum)
        described.integer_range = [IntegerRange(from_value=low_int, to_value=high_int)]
    return described


def declare(node: Node, item: Setting, *, read_only: bool = False) -> Value:
    """Declare one setting and return its value, which the command line or a file may override.

    Raises:
        SettingError: If the override has another type or lies outside the range.
    """
    try:
        parameter = node.declare_parameter(
            item.name, item.default, descriptor(item, read_only=read_only))
    except InvalidParameterTypeException as error:
        kind = type(item.default).__name__
        example = f'{item.default}'.lower()
        raise SettingError(
            f'{item.name}: expected a {kind} such as {example}, found another type ({error})'
        ) from error
    except InvalidParameterValueException as error:
        raise SettingError(f'{item.name}: {error}') from error
    value: Value = parameter.value
    return value


class ConfigParameters(Generic[NodeConfigT, PipelineConfigT]):
    """Keeps two configs equal to the node's parameters and refuses what does not fit."""

    def __init__(
        self, node: Node, node_config: NodeConfigT, pipeline_config: PipelineConfigT,
        on_change: Callable[[], None],
    ) -> None:
        """Declare every setting and apply overrides.

        Raises:
            SettingError: If an override does not fit.
        """
        self._names = {item.name for item in list_settings(node_config)}
        self.node_config = apply_settings(
            node_config, {i.name: declare(node, i) for i in list_settings(node_config)})
        self.pipeline_config = apply_settings(
            pipeline_config, {i.name: declare(node, i) for i in list_settings(pipeline_config)})
        self._known = self._names | {item.name for item in list_settings(pipeline_config)}
        self._on_change = on_change
        node.add_on_set_parameters_callback(self._on_set)

    def _on_set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        values = dict(self._own_values(parameters))
        try:
            node_config = apply_settings(
                self.node_config, {k: v for k, v in values.items() if k in self._names})
            pipeline_config = apply_settings(
                self.pipeline_config, {k: v for k, v in values.items() if k not in self._names})
        except PopError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.node_config, self.pipeline_config = node_config, pipeline_config
        if values:
            self._on_change()
        return SetParametersResult(successful=True)

    def _own_values(self, parameters: Sequence[Parameter]) -> Iterator[tuple[str, Value]]:
        for parameter in parameters:
            if parameter.name in self._known:
                yield parameter.name, parameter.value
