"""`python -m pop_core.training`: the commands, or what is missing to run them."""

import sys

try:
    from pop_core.training.commands import main
except ModuleNotFoundError as error:
    if (error.name or '').startswith('pop_'):
        raise
    sys.exit(
        f'pop_core.training: expected the module {error.name}, found none: run '
        "`pip install 'pop_ros[train]'`, or `make train` in a checkout")

if __name__ == '__main__':
    raise SystemExit(main())
