import re
from pathlib import Path

import pytest

from scripts.write_docs import PARAMETER_FILE, parameter_file, parameters_page

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / 'README.md', *(ROOT / 'docs').glob('*.md')])


def test_the_parameter_page_is_what_the_code_says():
    written = (ROOT / 'docs' / 'parameters.md').read_text(encoding='utf-8')
    assert written == parameters_page(), 'run: make docs'
    assert PARAMETER_FILE.read_text(encoding='utf-8') == parameter_file(), 'run: make docs'


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_links_between_pages_and_to_pictures_lead_somewhere(page):
    targets = re.findall(r'\]\(([^)#]+)(?:#[^)]*)?\)', page.read_text(encoding='utf-8'))
    missing = [t for t in targets if '://' not in t and not (page.parent / t).exists()]
    assert missing == []


@pytest.mark.parametrize('page', PAGES, ids=lambda p: p.name)
def test_commands_that_pages_show_exist(page):
    text = page.read_text(encoding='utf-8')
    from pop_ros.cli import COMMANDS
    names = {command.name for command in COMMANDS}
    assert set(re.findall(r'^ *(?:\$ )?pop ([\w-]+)', text, re.MULTILINE)) <= names
    rules = set(re.findall(r'^(\w[\w-]*):', (ROOT / 'Makefile').read_text(), re.MULTILINE))
    assert set(re.findall(r'`make ([\w-]+)`', text)) <= rules


def test_the_index_leads_to_every_page():
    index = (ROOT / 'docs' / 'index.md').read_text(encoding='utf-8')
    pages = {path.name for path in (ROOT / 'docs').glob('*.md')} - {'index.md'}
    assert {name for name in pages if f'({name})' not in index} == set()
