"""Download a file over HTTP into a part file: resumed where the server can, bounded in size."""

from __future__ import annotations

import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable
from http.client import HTTPException, HTTPMessage, HTTPResponse
from pathlib import Path
from typing import IO

from pop_ros.network_registry import NetworkFileError

Progress = Callable[[int, 'int | None'], None]
TIMEOUT_S = 30.0
BLOCK = 1 << 16
LARGEST = 2**31 - 1  # bytes; an ONNX file cannot be larger
PARTIAL, UNSATISFIABLE = 206, 416


class SafeRedirects(urllib.request.HTTPRedirectHandler):
    """Follows redirects to HTTP only, and never from an encrypted address to a plain one."""

    def redirect_request(
        self, req: urllib.request.Request, fp: IO[bytes], code: int, msg: str,
        headers: HTTPMessage, newurl: str,
    ) -> urllib.request.Request | None:
        """Return the request that follows a redirect.

        Raises:
            NetworkFileError: If it leads elsewhere.
        """
        before, after = (urllib.parse.urlsplit(url).scheme for url in (req.full_url, newurl))
        if after not in ('http', 'https') or (before == 'https' and after == 'http'):
            raise NetworkFileError(
                f'{req.full_url}: expected a redirect to {before}, found one to {newurl}')
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def download(url: str, part: Path, size: int | None, progress: Progress | None = None) -> None:
    """Fill a part file with what a URL holds, going on where an earlier try ended.

    Args:
        url: HTTP or HTTPS address.
        part: File to fill; what it holds already is kept where the server can go on.
        size: Bytes that are expected, None where unknown.
        progress: Told bytes done and bytes in all, None where unknown.

    Raises:
        NetworkFileError: If the server does not answer, refuses, ends early, or sends too much.
        OSError: If the part file cannot be written.
    """
    start = part.stat().st_size if part.exists() else 0
    if size is not None and start > size:
        part.unlink()
        start = 0
    try:
        with _open(url, start) as response:
            _receive(response, part, start, size, progress)
    except urllib.error.HTTPError as error:
        if error.code != UNSATISFIABLE or not start:
            raise NetworkFileError(
                f'{url}: expected a file, found: {error.code} {_printable(error.reason)}'
            ) from None
        if start != size:  # the server has fewer bytes: the part is of something else
            part.unlink()
            download(url, part, size, progress)
    except (urllib.error.URLError, HTTPException, TimeoutError, ConnectionError) as error:
        reason = _printable(getattr(error, 'reason', error)) or type(error).__name__
        raise NetworkFileError(
            f'{url}: expected a file, found: {reason}: run the command again to go on') from None


def _open(url: str, start: int) -> HTTPResponse:
    if urllib.parse.urlsplit(url).scheme not in ('http', 'https'):
        raise NetworkFileError(f'{url}: expected an address with http or https')
    headers = {'User-Agent': 'pop', 'Accept-Encoding': 'identity'}
    if start:
        headers['Range'] = f'bytes={start}-'
    opener = urllib.request.build_opener(SafeRedirects())
    response: HTTPResponse = opener.open(
        urllib.request.Request(url, headers=headers), timeout=TIMEOUT_S)
    return response


def _receive(
    response: HTTPResponse, part: Path, start: int, size: int | None, progress: Progress | None
) -> None:
    goes_on = (response.status == PARTIAL
               and response.headers.get('Content-Range', '').startswith(f'bytes {start}-'))
    done = start if goes_on else 0
    length = response.headers.get('Content-Length', '')
    total = done + int(length) if length.isdigit() else size
    limit = LARGEST if size is None else size
    _bounded(total or 0, limit, response.url, part)
    with part.open('ab' if goes_on else 'wb') as file:
        while block := response.read(BLOCK):
            done += len(block)
            _bounded(done, limit, response.url, part)
            file.write(block)
            if progress is not None:
                progress(done, total)
    if total is not None and done < total:
        raise NetworkFileError(
            f'{response.url}: expected {total} bytes, found the end after {done}: run the command '
            'again to go on')


def _printable(reason: object) -> str:
    """Return what a server said as one line that no terminal obeys."""
    return ''.join(c for c in ' '.join(str(reason).split()) if c.isprintable())[:160]


def _bounded(found: int, limit: int, url: str, part: Path) -> None:
    if found > limit:
        part.unlink(missing_ok=True)
        raise NetworkFileError(f'{url}: expected up to {limit} bytes, found at least {found}')
