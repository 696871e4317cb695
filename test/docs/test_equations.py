import re
from importlib import import_module
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'equations.md'
ROW = re.compile(r'^\| (?P<label>[^|]+) \| [^|]+ \| `(?P<target>[\w.]+)` \|$', re.MULTILINE)
ROWS = [(m['label'], m['target']) for m in ROW.finditer(PAGE.read_text(encoding='utf-8'))]


def resolve(target):
    """Return a module, class, function or method by its dotted name."""
    parts = target.split('.')
    for k in range(len(parts), 0, -1):
        try:
            found = import_module('.'.join(parts[:k]))
        except ModuleNotFoundError as error:
            if not target.startswith(error.name or '?'):
                raise
            continue
        for name in parts[k:]:
            found = getattr(found, name)
        return found
    raise AssertionError(f'{target}: no such module')


@pytest.mark.parametrize(('label', 'target'), ROWS, ids=[target for _, target in ROWS])
def test_the_docstring_names_the_equation_the_page_says_it_computes(label, target):
    # 'Eq. 4' is also named by 'Eq. 4-7', and 'Eq. 1' by 'Eq. (1)'.
    docstring = re.sub(r'Eq\. \((\d)\)', r'Eq. \1', resolve(target).__doc__)
    assert re.search(re.escape(label) + r'(?!\d)', docstring), docstring.splitlines()[0]


def test_the_page_covers_every_step_and_equation():
    covered = {label for label, _ in ROWS}
    for first, last in re.findall(r'Eq\. (\d)-(\d)', ' '.join(covered)):
        covered |= {f'Eq. {number}' for number in range(int(first), int(last) + 1)}
    # Step 4 is Eq. 1, step 7 is E_NN.
    steps = {f'step {number}' for number in (1, 2, 3, 5, 6, 8)}
    assert steps | {f'Eq. {k}' for k in range(1, 9)} | {'E_NN', 'E_depth'} <= covered
