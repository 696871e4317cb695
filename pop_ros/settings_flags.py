"""Settings on the command line: `--set fitting.hypotheses=12`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from pop_core.errors import SettingError
from pop_core.settings import Value, apply_settings, list_settings

ConfigT = TypeVar('ConfigT')
TRUTH = {'true': True, 'false': False}


def with_flags(config: ConfigT, flags: Sequence[str]) -> ConfigT:
    """Return the config with `NAME=VALUE` flags applied.

    Raises:
        SettingError: If a flag has no '=', an unknown name, or a value of another type or range.
    """
    defaults = {item.name: item.default for item in list_settings(config)}
    values: dict[str, Value] = {}
    for flag in flags:
        name, equals, text = flag.partition('=')
        if not equals:
            raise SettingError(f'--set: expected NAME=VALUE, found {flag!r}')
        values[name] = _parsed(name, text, defaults.get(name, text))
    return apply_settings(config, values)


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
