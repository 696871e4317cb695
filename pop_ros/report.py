"""One-page HTML reports that need no other file: text, tables, pictures, film strips, 3D views."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from pop_ros.report3d import SceneFrame, scene_html, scene_scripts

JPEG_QUALITY = 86
# The browser itself refuses whatever a page would fetch.
POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'")
STYLE = """
:root { color-scheme: light dark; --ink: #1c2026; --paper: #fafaf8; --line: #d8dade; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e7ea; --paper: #16181c; --line: #3a3e46; }
}
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
       max-width: 1180px; margin: 2.5rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
img { max-width: 100%; border-radius: 6px; display: block; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .9rem .3rem 0; text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
pre { padding: .8rem 1rem; border: 1px solid var(--line); border-radius: 6px; overflow-x: auto; }
button { font: inherit; padding: .15rem .7rem; border-radius: 6px; cursor: pointer;
         border: 1px solid var(--line); background: none; color: inherit; }
input[type=range] { width: 100%; margin: .8rem 0 0; }
figcaption { font-size: .92rem; opacity: .8; margin-top: .35rem; } figure { margin: 1rem 0; }
"""
FILM_SCRIPT = """
for (const film of document.querySelectorAll('.film')) {
  const frames = JSON.parse(film.querySelector('script').textContent);
  const [picture, slider, button, caption] =
    ['img', 'input', 'button', 'figcaption'].map(name => film.querySelector(name));
  let timer = 0;
  const show = () => {
    picture.src = 'data:image/jpeg;base64,' + frames[slider.value].jpeg;
    caption.textContent = frames[slider.value].caption;
  };
  const stop = () => { clearInterval(timer); timer = 0; button.textContent = 'play'; };
  const next = () => { slider.value = (Number(slider.value) + 1) % frames.length; show(); };
  slider.addEventListener('input', () => { stop(); show(); });
  button.addEventListener('click', () => {
    if (timer) stop();
    else { timer = setInterval(next, 250); button.textContent = 'pause'; }
  });
  show();
}
"""


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture of a page.

    Args:
        jpeg: The picture as JPEG in base 64.
        caption: A sentence about it.
    """

    jpeg: str
    caption: str

    @classmethod
    def encoded(cls, rgb: UInt8[np.ndarray, 'h w 3'], caption: str, width: int) -> Picture:
        """Return a picture of at most some width [px].

        Raises:
            OSError: If it cannot be encoded.
        """
        if rgb.shape[1] > width:
            size = (width, max(1, round(rgb.shape[0] * width / rgb.shape[1])))
            rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
        done, content = cv2.imencode(
            '.jpg', cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        if not done:
            raise OSError('the picture could not be encoded')
        return cls(base64.b64encode(content.tobytes()).decode('ascii'), caption)


class Report:
    """A page that is written from top to bottom."""

    def __init__(self, title: str, lead: str) -> None:
        """Begin a page with a title and a sentence."""
        self._title = title
        self._parts = [f'<h1>{html.escape(title)}</h1><p>{html.escape(lead)}</p>']
        self._scripts = f'<script>{FILM_SCRIPT}</script>'

    def heading(self, text: str) -> None:
        """Add a heading."""
        self._parts.append(f'<h2>{html.escape(text)}</h2>')

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f'<p>{html.escape(text)}</p>')

    def commands(self, lines: Sequence[str]) -> None:
        """Add lines to type."""
        self._parts.append(f'<pre>{html.escape(chr(10).join(lines))}</pre>')

    def table(self, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Add a table whose first column is text."""
        cells = [''.join(f'<td>{html.escape(cell)}</td>' for cell in row) for row in rows]
        top = ''.join(f'<th>{html.escape(cell)}</th>' for cell in head)
        body = ''.join(f'<tr>{row}</tr>' for row in cells)
        self._parts.append(f'<table><tr>{top}</tr>{body}</table>')

    def film(self, pictures: Sequence[Picture]) -> None:
        """Add pictures of which a slider shows one."""
        frames = [{'jpeg': p.jpeg, 'caption': p.caption} for p in pictures]
        # A closing tag inside the data would end the script.
        data = json.dumps(frames).replace('</', '<\\/')
        alone = ' hidden' if len(frames) == 1 else ''
        self._parts.append(
            '<figure class="film"><img alt="">'
            f'<input type="range" min="0" max="{len(frames) - 1}" value="{len(frames) // 2}" '
            f'aria-label="frame"{alone}><button type="button"{alone}>play</button>'
            f'<figcaption></figcaption><script type="application/json">{data}</script></figure>')

    def scenes(self, scenes: Sequence[SceneFrame], f: np.ndarray) -> None:
        """Add a 3D view of frames, of which a slider shows one; `f` are the meshes' triangles."""
        if '.scene3d' not in self._scripts:
            self._scripts += scene_scripts()
        self._parts.append(scene_html(scenes, f))

    def write(self, path: Path) -> None:
        """Write the page.

        Raises:
            OSError: If the file cannot be written.
        """
        body = '\n'.join(self._parts)
        path.write_text(
            f'<!doctype html><html lang="en"><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
            f'<meta name="viewport" content="width=device-width">'
            f'<title>{html.escape(self._title)}</title><style>{STYLE}</style>'
            f'<body>{body}{self._scripts}</body></html>\n', encoding='utf-8')
