"""Bring a published network into the cache: download, verify, unpack, and only then keep it."""

from __future__ import annotations

import fcntl
import hashlib
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from pop_ros.network_download import BLOCK, LARGEST, Progress, download
from pop_ros.network_registry import (
    NetworkEntry,
    NetworkFileError,
    networks_folder,
    save_record,
    verified_network,
)

SHA256 = re.compile(r'[0-9a-f]{64}')


def fetch_network(
    entry: NetworkEntry, sha256: str | None = None, progress: Progress | None = None
) -> bool:
    """Bring a network into the cache; return whether anything had to be downloaded.

    Args:
        entry: What is wanted.
        sha256: Hash of the download, from where the user trusts; needed where the registry knows
            none.
        progress: Told bytes done and bytes in all, None where unknown.

    Raises:
        NetworkFileError: If nobody says what it must hash to, it cannot be downloaded, or is not
            what was published.
        OSError: If the cache cannot be written.
    """
    if sha256 is None and _is_there(entry, None):
        return False
    wanted = _wanted(entry, sha256)
    if _is_there(entry, wanted):
        return False
    networks_folder().mkdir(parents=True, exist_ok=True)
    part = entry.path.with_suffix('.part')
    with _only_one(entry):
        went_on = part.exists()
        download(entry.url, part, entry.size, progress)
        if went_on and _hash(part) != wanted:  # begun from another version: once more, from 0
            part.unlink()
            download(entry.url, part, entry.size, progress)
        _verify(part, wanted, entry)
        _keep(entry, part, wanted)
    return True


def _wanted(entry: NetworkEntry, given: str | None) -> str:
    if given is not None and not SHA256.fullmatch(given.lower()):
        raise NetworkFileError(f'--sha256: expected 64 hexadecimal digits, found {given!r}')
    if entry.sha256 is None and given is None:
        raise NetworkFileError(
            f'{entry.name}: expected a SHA-256 to verify {entry.url} with, found none: its '
            'publisher tells none that is known here; give one that you trust with --sha256')
    if entry.sha256 is not None and given is not None and given.lower() != entry.sha256:
        raise NetworkFileError(
            f'--sha256: expected {entry.sha256}, as published for {entry.name}, found {given}')
    return entry.sha256 or str(given).lower()


def _is_there(entry: NetworkEntry, wanted: str | None) -> bool:
    """Return whether the network is cached, unchanged, and of the wanted download, if any."""
    try:
        verified_network(entry, wanted)
    except NetworkFileError:
        return False
    return True


@contextmanager
def _only_one(entry: NetworkEntry) -> Iterator[None]:
    """Hold the network's lock, so that two commands do not write one file."""
    with entry.path.with_suffix('.lock').open('w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise NetworkFileError(
                f'{entry.name}: expected to download it alone, found another command that does'
            ) from None
        yield


def _verify(part: Path, wanted: str, entry: NetworkEntry) -> None:
    found = _hash(part)
    if found != wanted:
        part.unlink()
        raise NetworkFileError(
            f'{entry.url}: expected SHA-256 {wanted}, found {found}: not kept')


def _hash(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open('rb') as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _keep(entry: NetworkEntry, part: Path, download_sha256: str) -> None:
    """Put the verified network in its place, at once and with its record."""
    source = part
    if entry.member is not None:
        source = entry.path.with_suffix('.unpacked')
        _unpack(part, entry.member, source)
        part.unlink()
    entry.path.unlink(missing_ok=True)  # never a new record beside an old network
    save_record(entry, source.read_bytes(), download_sha256)
    source.replace(entry.path)


def _unpack(archive: Path, member: str, out: Path) -> None:
    """Write the one file of that name, in whatever folder of an archive, if it has a sane size."""
    try:
        with zipfile.ZipFile(archive) as opened:
            found = [item for item in opened.infolist()
                     if item.filename.rsplit('/', 1)[-1] == member]
            if len(found) != 1 or found[0].file_size > LARGEST:
                raise NetworkFileError(
                    f'{archive}: expected one {member} of up to {LARGEST} bytes, found '
                    f'{len(found)}')
            with opened.open(found[0]) as source, out.open('wb') as target:
                _copy(source, target, found[0].file_size)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise NetworkFileError(f'{archive}: expected a zip archive, found: {error}') from None


def _copy(source: IO[bytes], target: IO[bytes], size: int) -> None:
    left = size
    while block := source.read(min(BLOCK, left)):
        target.write(block)
        left -= len(block)
