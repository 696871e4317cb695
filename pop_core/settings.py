"""Typed settings: one place for default, unit, meaning and bounds of every tunable number.

A stage's config is a frozen dataclass whose fields are made by `setting`. ROS parameters, flags
of the command line and the parameter page of the docs are derived from `list_settings`, never
written twice.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, TypeVar

from pop_core.errors import SettingError

ConfigT = TypeVar('ConfigT')
Value = bool | int | float | str


@dataclass(frozen=True, slots=True)
class Setting:
    """One documented setting.

    Args:
        name: Dotted path, such as `fitting.hypotheses`.
        default: Default value; its type is the setting's type.
        unit: Unit as text ('m', 'px', ''), never part of the value.
        about: One sentence that says what it does.
        minimum: Smallest allowed value, or None.
        maximum: Largest allowed value, or None.
    """

    name: str
    default: Value
    unit: str
    about: str
    minimum: float | int | None
    maximum: float | int | None


def setting(
    default: Value,
    *,
    unit: str = '',
    about: str,
    minimum: float | int | None = None,
    maximum: float | int | None = None,
) -> Any:
    """Declare a config field with its unit, sentence and bounds."""
    metadata = {'unit': unit, 'about': about, 'minimum': minimum, 'maximum': maximum}
    return dataclasses.field(default=default, metadata=metadata)


def list_settings(config: Any, prefix: str = '') -> Iterator[Setting]:
    """Yield every setting of a config and its nested configs, current values as defaults."""
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            yield from list_settings(value, f'{prefix}{field.name}.')
        else:
            meta = field.metadata
            yield Setting(
                f'{prefix}{field.name}', value, meta['unit'], meta['about'],
                meta['minimum'], meta['maximum'],
            )


def apply_settings(config: ConfigT, values: Mapping[str, Value]) -> ConfigT:
    """Return a copy of `config` with dotted settings replaced.

    Raises:
        SettingError: If a name is unknown, a type differs or a value is out of bounds.
    """
    known = {item.name: item for item in list_settings(config)}
    for name, value in values.items():
        check_name(name, known)
        check_value(known[name], value)
    return _replace(config, values)


def check_name(name: str, known: Collection[str]) -> None:
    """Raise SettingError unless a setting of this name is known."""
    if name not in known:
        near = ', '.join(get_close_matches(name, known)) or 'nothing like it'
        raise SettingError(
            f'{name}: expected one of {sorted(known)}, found an unknown name; nearest: {near}')


def check_value(item: Setting, value: Value) -> None:
    """Raise SettingError unless `value` has the setting's type and lies within its bounds."""
    number_for_number = isinstance(item.default, float) and type(value) is int
    if type(value) is not type(item.default) and not number_for_number:
        expected = type(item.default).__name__
        raise SettingError(f'{item.name}: expected {expected}, found {value!r}')
    if isinstance(value, str | bool):
        return
    below = item.minimum is not None and value < item.minimum
    above = item.maximum is not None and value > item.maximum
    if below or above or value != value:  # noqa: PLR0124 - NaN is never within bounds
        raise SettingError(
            f'{item.name}: expected {item.minimum} to {item.maximum} {item.unit}, found {value}'
        )


def _replace(config: ConfigT, values: Mapping[str, Value]) -> ConfigT:
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(config):  # type: ignore[arg-type]
        current = getattr(config, field.name)
        if dataclasses.is_dataclass(current):
            start = f'{field.name}.'
            inner = {k[len(start):]: v for k, v in values.items() if k.startswith(start)}
            changes[field.name] = _replace(current, inner)
        elif field.name in values:
            changes[field.name] = type(current)(values[field.name])
    return dataclasses.replace(config, **changes)  # type: ignore[type-var]
