"""Settings on the command line: `--set max_people=2`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from pop_core.errors import SettingError
from pop_core.settings import Value, apply_settings, check_name, list_settings

ConfigT = TypeVar('ConfigT')
OtherT = TypeVar('OtherT')
TRUTH = {'true': True, 'false': False}


def with_flags(config: ConfigT, flags: Sequence[str]) -> ConfigT:
    """Return the config with `NAME=VALUE` flags applied.

    Raises:
        SettingError: If a flag has no '=', an unknown name, or a value of another type or range.
    """
    defaults = {item.name: item.default for item in list_settings(config)}
    return apply_settings(config, _values(flags, defaults))


def pair_with_flags(
    first: ConfigT, second: OtherT, flags: Sequence[str]
) -> tuple[ConfigT, OtherT]:
    """Return two configs with `NAME=VALUE` flags applied, each to the one it is a setting of.

    Raises:
        SettingError: If a flag has no '=', a name unknown to both, or a value of another type or
            range.
    """
    of_first = {item.name: item.default for item in list_settings(first)}
    of_second = {item.name: item.default for item in list_settings(second)}
    values = _values(flags, {**of_first, **of_second})
    return (
        apply_settings(first, {k: v for k, v in values.items() if k in of_first}),
        apply_settings(second, {k: v for k, v in values.items() if k in of_second}))


def _values(flags: Sequence[str], defaults: Mapping[str, Value]) -> dict[str, Value]:
    """Return what flags say, as values of the types that the settings have."""
    values: dict[str, Value] = {}
    for flag in flags:
        name, equals, text = flag.partition('=')
        if not equals:
            raise SettingError(f'--set: expected NAME=VALUE, found {flag!r}')
        check_name(name, defaults)
        values[name] = _parsed(name, text, defaults[name])
    return values


def _parsed(name: str, text: str, default: Value) -> Value:
    if isinstance(default, str):
        return text
    if isinstance(default, bool):
        if text.lower() not in TRUTH:
            raise SettingError(f'{name}: expected true or false, found {text!r}')
        return TRUTH[text.lower()]
    try:
        return type(default)(text)
    except ValueError:
        raise SettingError(f'{name}: expected {type(default).__name__}, found {text!r}') from None
