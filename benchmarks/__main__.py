"""`python -m benchmarks NAME [ARGUMENTS]`: runs one benchmark."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys

import benchmarks
from pop_core.errors import PopError


def main(argv: list[str]) -> int:
    """Run the benchmark named first; its own `--help` tells its arguments."""
    names = runnable()
    if not argv or argv[0] not in names:
        found = repr(argv[0]) if argv else 'none'
        print(f'benchmarks: expected one of {", ".join(names)}, found {found}', file=sys.stderr)
        return 2
    module = importlib.import_module(f'benchmarks.{argv[0]}')
    try:
        return int(module.run(argv[1:]))
    except (PopError, OSError) as error:
        print(f'benchmarks {argv[0]}: {error}', file=sys.stderr)
        return 2


def runnable() -> list[str]:
    """Return the modules of the package that have a `run(arguments)`."""
    names = [item.name for item in pkgutil.iter_modules(benchmarks.__path__)]
    chosen = []
    for name in names:
        if name != '__main__':
            spec = importlib.util.find_spec(f'benchmarks.{name}')
            if spec is not None and spec.origin and _has_run(spec.origin):
                chosen.append(name)
    return chosen


def _has_run(path: str) -> bool:
    with open(path, encoding='utf-8') as file:  # noqa: PTH123 - a path of the import system
        return any(line.startswith('def run(') for line in file)


if __name__ == '__main__':
    raise SystemExit(main(sys.argv[1:]))
