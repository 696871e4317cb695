"""A real HTTP server on this machine whose answers can be as bad as a test wants."""

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class FileServer(ThreadingHTTPServer):
    """Serves one content below several paths, each with manners of its own."""

    daemon_threads = True

    def __init__(self, content: bytes) -> None:
        super().__init__(('127.0.0.1', 0), _Handler)
        self.content = content
        self.ranges: list[str] = []  # what was asked for, in order
        self.redirect_to = ''

    def url(self, manner: str) -> str:
        """Return the address at which the server behaves in that manner."""
        return f'http://127.0.0.1:{self.server_port}/{manner}/net.onnx'


class _Handler(BaseHTTPRequestHandler):
    server: FileServer

    def do_GET(self) -> None:
        self.server.ranges.append(self.headers.get('Range', ''))
        getattr(self, 'answer_' + self.path.split('/')[1])(self.server.content)

    def log_message(self, *_: object) -> None:
        """Say nothing."""

    def send(self, status: int, body: bytes, **headers: object) -> None:
        """Send a whole answer."""
        self.send_response(status)
        for name, value in {'Content-Length': len(body), **headers}.items():
            self.send_header(name.replace('_', '-'), str(value))
        self.end_headers()
        self.wfile.write(body)

    def answer_plain(self, content: bytes) -> None:
        """Know nothing of ranges."""
        self.send(200, content)

    def answer_ranges(self, content: bytes) -> None:
        """Go on where the client wants."""
        wanted = re.fullmatch(r'bytes=(\d+)-', self.headers.get('Range', ''))
        if wanted is None:
            self.send(200, content)
            return
        start = int(wanted[1])
        if start >= len(content):
            self.send(416, b'', Content_Range=f'bytes */{len(content)}')
            return
        self.send(206, content[start:],
                  Content_Range=f'bytes {start}-{len(content) - 1}/{len(content)}')

    def answer_wrong_range(self, content: bytes) -> None:
        """Promise to go on, and begin anew."""
        self.send(206 if self.headers.get('Range') else 200, content,
                  Content_Range=f'bytes 0-{len(content) - 1}/{len(content)}')

    def answer_truncated(self, content: bytes) -> None:
        """Promise everything and send the first half of what is wanted."""
        wanted = re.fullmatch(r'bytes=(\d+)-', self.headers.get('Range', ''))
        rest = content[int(wanted[1]) if wanted else 0:]
        status = 206 if wanted else 200
        self.send_response(status)
        if wanted:
            self.send_header('Content-Range', f'bytes {wanted[1]}-')
        self.send_header('Content-Length', str(len(rest)))
        self.end_headers()
        self.wfile.write(rest[: (len(rest) + 1) // 2])
        self.close_connection = True

    def answer_corrupted(self, content: bytes) -> None:
        """Send as many bytes, one of them another."""
        self.send(200, content[:-1] + bytes([content[-1] ^ 1]))

    def answer_longer(self, content: bytes) -> None:
        """Send more than was published, and say so."""
        self.send(200, content + b'more')

    def answer_endless(self, content: bytes) -> None:
        """Send more than was published, without a length."""
        self.send_response(200)
        self.end_headers()
        try:
            for _ in range(10_000):
                self.wfile.write(content + bytes(1 << 16))
        except OSError:
            pass  # the client had enough

    def answer_redirect(self, content: bytes) -> None:  # noqa: ARG002 - as the others
        """Send the client elsewhere."""
        self.send(302, b'', Location=self.server.redirect_to)

    def answer_missing(self, content: bytes) -> None:  # noqa: ARG002 - as the others
        """Have no such file."""
        self.send(404, b'not here')

    def answer_nonsense(self, content: bytes) -> None:  # noqa: ARG002 - as the others
        """Speak another language."""
        self.wfile.write(b'220 ftp ready\r\n')


@contextmanager
def serving(content: bytes) -> Iterator[FileServer]:
    """Serve a content until the end of the block."""
    with FileServer(content) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()
