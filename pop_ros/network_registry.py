"""Networks that others publish: where they are, what they must hash to, their licences.

A network that was fetched is read again only if its SHA-256 is still that of what was verified.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from pop_core.errors import PopError
from pop_core.retrieval.default_library import cache_folder


class NetworkFileError(PopError):
    """A published network that is not there, or not the one that was published."""


@dataclass(frozen=True, slots=True)
class NetworkEntry:
    """A network of the registry.

    Args:
        name: What the user calls it.
        url: Where its publisher has it.
        sha256: Of the download, as its publisher says; None where nobody does.
        size: Bytes of the download, None where unknown.
        member: Name of the network in the archive that is downloaded, None if it is no archive.
        licence: SPDX name of the weights' licence.
        decoder: What reads its outputs.
        about: What it is, in a sentence.
        evidence: Who says what it hashes to.
    """

    name: str
    url: str
    sha256: str | None
    size: int | None
    member: str | None
    licence: str
    decoder: str
    about: str
    evidence: str

    @property
    def path(self) -> Path:
        """Return where the network is cached."""
        return networks_folder() / f'{self.name}.onnx'

    @property
    def record(self) -> Path:
        """Return where is written what was verified."""
        return self.path.with_suffix('.json')


def networks_folder() -> Path:
    """Return the folder of fetched networks."""
    return cache_folder() / 'networks'


@cache
def load_registry(path: Path | None = None) -> tuple[NetworkEntry, ...]:
    """Return the networks of the registry.

    Args:
        path: A file in place of the package's own.
    """
    source = files('pop_ros') / 'data' / 'networks.json' if path is None else path
    document = json.loads(source.read_text(encoding='utf-8'))
    return tuple(NetworkEntry(**entry) for entry in document['networks'])


def find_entry(name: str) -> NetworkEntry | None:
    """Return the network of that name, or None."""
    return next((entry for entry in load_registry() if entry.name == name), None)


def known_entry(name: str) -> NetworkEntry:
    """Return the network of that name.

    Raises:
        NetworkFileError: If there is none.
    """
    entry = find_entry(name)
    if entry is None:
        names = ', '.join(entry.name for entry in load_registry())
        raise NetworkFileError(f'expected a network of {names}, found {name}')
    return entry


def verified_network(entry: NetworkEntry, download_sha256: str | None = None) -> bytes:
    """Return a fetched network, which is the one that was verified.

    Args:
        entry: Which one.
        download_sha256: What its download must have hashed to, where the user says so.

    Raises:
        NetworkFileError: If it was not fetched, or is not that one any more.
    """
    try:
        content = entry.path.read_bytes()
        recorded = json.loads(entry.record.read_text(encoding='utf-8'))
    except (OSError, ValueError):
        raise NetworkFileError(
            f'{entry.name}: expected {entry.path}, found none: run `pop models fetch '
            f'{entry.name}`') from None
    wanted = _wanted(entry, recorded, download_sha256 or entry.sha256)
    found = hashlib.sha256(content).hexdigest()
    if wanted is None or found != wanted:
        raise NetworkFileError(
            f'{entry.path}: expected SHA-256 {wanted or entry.sha256}, found {found}: it is not '
            f'what was verified; run `pop models fetch {entry.name}`')
    return content


def save_record(entry: NetworkEntry, content: bytes, download_sha256: str) -> None:
    """Write down what was verified: the network, and the download that it came with."""
    digest = hashlib.sha256(content).hexdigest()
    document = {'sha256': digest, 'download_sha256': download_sha256, 'url': entry.url}
    entry.record.write_text(json.dumps(document) + '\n', encoding='utf-8')


def _wanted(entry: NetworkEntry, recorded: Any, download_sha256: str | None) -> str | None:
    """Return what a cached network must hash to; None if it is of another download."""
    if not isinstance(recorded, dict):
        return None
    sha256, download = (str(recorded.get(key)) for key in ('sha256', 'download_sha256'))
    if download_sha256 not in (None, download):
        return None
    return download if entry.member is None else sha256
