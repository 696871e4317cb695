"""Published networks: fetched from a real server, verified, and never used unverified."""

import hashlib
import io
import json
import re
import urllib.request
import zipfile
from dataclasses import replace
from http.client import HTTPMessage

import numpy as np
import pytest
from support.file_server import serving
from support.onnx_files import save_network

from pop_core.keypoints.decoders import DECODERS
from pop_ros.keypoint_sources import make_detector
from pop_ros.network_download import SafeRedirects
from pop_ros.network_fetch import fetch_network
from pop_ros.network_registry import (
    NetworkEntry,
    NetworkFileError,
    find_entry,
    known_entry,
    load_registry,
    networks_folder,
    save_record,
    verified_network,
)

CONTENT = np.random.default_rng(0).bytes(300_000)
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))


@pytest.fixture
def server():
    with serving(CONTENT) as running:
        yield running


def entry_at(url, **changes):
    entry = NetworkEntry(
        name='net', url=url, sha256=SHA256, size=len(CONTENT), member=None, licence='MIT',
        decoder='rtmo', about='', evidence='')
    return replace(entry, **changes)


def nothing_is_kept(entry):
    assert not entry.path.exists()
    with pytest.raises(NetworkFileError):
        verified_network(entry)


def part_of(entry):
    return entry.path.with_suffix('.part')


def test_what_was_published_is_kept_and_fetched_once(server):
    entry = entry_at(server.url('plain'))
    told = []
    assert fetch_network(entry, progress=lambda done, total: told.append((done, total)))
    assert verified_network(entry) == CONTENT
    assert told[-1] == (len(CONTENT), len(CONTENT))
    assert told == sorted(told)
    assert not fetch_network(entry)
    assert len(server.ranges) == 1
    assert not part_of(entry).exists()


@pytest.mark.parametrize('size', [len(CONTENT), None])
@pytest.mark.parametrize('manner', ['corrupted', 'longer', 'endless', 'missing', 'nonsense'])
def test_anything_else_is_not_kept(server, manner, size):
    entry = entry_at(server.url(manner), size=size)
    if manner == 'endless' and size is None:
        entry = replace(entry, sha256='0' * 64, size=2_000_000)
    with pytest.raises(NetworkFileError) as error:
        fetch_network(entry)
    assert '\n' not in str(error.value)
    nothing_is_kept(entry)
    assert not part_of(entry).exists()


def test_a_wrong_hash_is_told_beside_the_right_one(server):
    with pytest.raises(NetworkFileError, match=f'expected SHA-256 {SHA256}, found [0-9a-f]+'):
        fetch_network(entry_at(server.url('corrupted')))


def test_a_broken_download_goes_on_where_it_ended(server):
    entry = entry_at(server.url('truncated'))
    for _ in range(3):
        with pytest.raises(NetworkFileError, match='to go on'):
            fetch_network(entry)
    held = part_of(entry).stat().st_size
    assert held > 0.8 * len(CONTENT)
    assert fetch_network(replace(entry, url=server.url('ranges')))
    assert server.ranges[-1] == f'bytes={held}-'
    assert verified_network(entry) == CONTENT


@pytest.mark.parametrize('manner', ['plain', 'wrong_range'])
def test_where_a_server_cannot_go_on_it_begins_anew(server, manner):
    entry = entry_at(server.url(manner))
    networks_folder().mkdir(parents=True)
    part_of(entry).write_bytes(CONTENT[:1000])
    assert fetch_network(entry)
    assert verified_network(entry) == CONTENT


@pytest.mark.parametrize('held', [b'of another version', CONTENT + b'more', CONTENT[::-1]])
@pytest.mark.parametrize('size', [len(CONTENT), None])
def test_a_part_of_something_else_is_thrown_away(server, held, size):
    entry = entry_at(server.url('ranges'), size=size)
    networks_folder().mkdir(parents=True)
    part_of(entry).write_bytes(held)
    assert fetch_network(entry)
    assert verified_network(entry) == CONTENT


def test_a_part_that_is_whole_needs_no_more_bytes(server):
    entry = entry_at(server.url('ranges'))
    networks_folder().mkdir(parents=True)
    part_of(entry).write_bytes(CONTENT)
    assert fetch_network(entry)
    assert verified_network(entry) == CONTENT


def test_redirects_are_followed(server):
    server.redirect_to = server.url('plain')
    assert fetch_network(entry_at(server.url('redirect')))


@pytest.mark.parametrize('target', ['file:///etc/passwd', 'ftp://example.org/net.onnx', 'loop'])
def test_redirects_to_elsewhere_than_http_and_in_circles_are_not(server, target):
    entry = entry_at(server.url('redirect'))
    server.redirect_to = entry.url if target == 'loop' else target
    with pytest.raises(NetworkFileError):
        fetch_network(entry)
    nothing_is_kept(entry)


def test_redirects_from_an_encrypted_address_to_a_plain_one_are_not_followed():
    asked = urllib.request.Request('https://example.org/net.onnx')
    with pytest.raises(NetworkFileError, match='expected a redirect to https'):
        SafeRedirects().redirect_request(
            asked, io.BytesIO(), 302, 'Found', HTTPMessage(), 'http://example.org/net.onnx')


@pytest.mark.parametrize('url', ['file:///etc/passwd', 'net.onnx', 'http://127.0.0.1:1/net.onnx'])
def test_addresses_that_nobody_serves_are_told(url):
    with pytest.raises(NetworkFileError, match=re.escape(url)):
        fetch_network(entry_at(url))


def test_without_a_hash_nothing_is_asked_for(server):
    entry = entry_at(server.url('plain'), sha256=None)
    with pytest.raises(NetworkFileError, match='--sha256'):
        fetch_network(entry)
    assert server.ranges == []


def test_a_hash_of_the_user_counts_where_the_publisher_tells_none(server):
    entry = entry_at(server.url('plain'), sha256=None)
    with pytest.raises(NetworkFileError, match='not kept'):
        fetch_network(entry, '0' * 64)
    assert fetch_network(entry, SHA256.upper())
    assert verified_network(entry) == CONTENT
    assert not fetch_network(entry, SHA256)
    assert not fetch_network(entry)  # verified once, it needs no hash to be here already


@pytest.mark.parametrize('given', ['', 'abc', SHA256[:-1] + 'g', '0' * 64])
def test_a_hash_of_the_user_must_be_one_and_agree_with_the_publisher(server, given):
    with pytest.raises(NetworkFileError, match='--sha256'):
        fetch_network(entry_at(server.url('plain')), given)
    assert server.ranges == []


def test_a_network_changed_after_it_was_fetched_is_not_used(server):
    entry = entry_at(server.url('plain'))
    fetch_network(entry)
    entry.path.write_bytes(CONTENT[:-1] + b'!')
    with pytest.raises(NetworkFileError, match='not what was verified'):
        verified_network(entry)
    assert fetch_network(entry)
    assert verified_network(entry) == CONTENT


def test_a_forged_record_does_not_help_where_the_publisher_tells_a_hash(server):
    entry = entry_at(server.url('plain'))
    networks_folder().mkdir(parents=True)
    entry.path.write_bytes(b'something else')
    for claimed in (SHA256, hashlib.sha256(b'something else').hexdigest()):
        save_record(entry, b'something else', claimed)
        with pytest.raises(NetworkFileError):
            verified_network(entry)


@pytest.mark.parametrize('record', ['', '[]', '{}', '{"sha256": 5}', 'no json', '\0'])
def test_damaged_records_are_no_records(server, record):
    entry = entry_at(server.url('plain'))
    fetch_network(entry)
    entry.record.write_text(record)
    with pytest.raises(NetworkFileError):
        verified_network(entry)


def zipped(**members):
    out = io.BytesIO()
    with zipfile.ZipFile(out, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name.replace('__', '/') + '.onnx', content)
    return out.getvalue()


def archive_entry(server, content, member='end2end.onnx'):
    return entry_at(server.url('plain'), size=len(content), member=member,
                    sha256=hashlib.sha256(content).hexdigest())


def test_a_network_inside_an_archive_is_taken_out():
    content = zipped(folder__end2end=CONTENT, other=b'1')
    with serving(content) as server:
        entry = archive_entry(server, content)
        assert fetch_network(entry)
        assert verified_network(entry) == CONTENT
        assert sorted(p.suffix for p in networks_folder().iterdir()) == ['.json', '.lock', '.onnx']
        assert not fetch_network(entry)


@pytest.mark.parametrize('content', [
    zipped(other=b'1'), zipped(a__end2end=b'1', b__end2end=b'2'), b'no archive',
    zipped(end2end=CONTENT)[:-30],
])
def test_archives_without_the_one_network_are_told(content):
    with serving(content) as server:
        entry = archive_entry(server, content)
        with pytest.raises(NetworkFileError) as error:
            fetch_network(entry)
        assert '\n' not in str(error.value)
        nothing_is_kept(entry)


def test_an_archive_cannot_write_elsewhere(tmp_path):
    out = io.BytesIO()
    with zipfile.ZipFile(out, 'w') as archive:
        archive.writestr('../../../end2end.onnx', CONTENT)
    with serving(out.getvalue()) as server:
        entry = archive_entry(server, out.getvalue())
        assert fetch_network(entry)
    found = list(tmp_path.rglob('*.onnx'))
    assert found == [entry.path]


def test_the_registry_is_well_formed():
    names = [entry.name for entry in load_registry()]
    assert len(set(names)) == len(names)
    for entry in load_registry():
        assert re.fullmatch(r'[a-z0-9-]+', entry.name)
        assert entry.url.startswith('https://')
        assert entry.decoder in DECODERS
        assert entry.licence
        assert (entry.sha256 is None) == (entry.evidence == '')
        assert entry.sha256 is None or re.fullmatch('[0-9a-f]{64}', entry.sha256)
        assert entry.sha256 is None or entry.size
        assert (entry.member is None) == entry.url.endswith('.onnx')
    assert find_entry('nonsense') is None
    with pytest.raises(NetworkFileError, match=r'expected a network of .*rtmo-m'):
        known_entry('nonsense')


def test_a_name_is_a_keypoint_source_once_it_is_verified(tmp_path):
    with pytest.raises(NetworkFileError, match='pop models fetch efficientpose-ii'):
        make_detector('efficientpose-ii')
    entry = known_entry('efficientpose-ii')
    networks_folder().mkdir(parents=True)
    save_network(entry.path, {'heat': np.zeros((1, 46, 46, 16), np.float32)},
                 (1, 368, 368, 3), 'float32')
    content = entry.path.read_bytes()
    save_record(entry, content, hashlib.sha256(content).hexdigest())
    assert 'single_person_heatmap' in make_detector('efficientpose-ii').reason
    entry.path.write_bytes(content + b'\0')
    with pytest.raises(NetworkFileError, match='not what was verified'):
        make_detector('efficientpose-ii')


def test_the_record_says_what_was_verified_and_from_where(server):
    entry = entry_at(server.url('plain'))
    fetch_network(entry)
    assert json.loads(entry.record.read_text()) == {
        'sha256': SHA256, 'download_sha256': SHA256, 'url': entry.url}
