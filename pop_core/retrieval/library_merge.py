"""Several libraries into one, without loading them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pop_core.retrieval.library_file import ARRAYS, load_library, new_library_file
from pop_core.retrieval.pruning import PoseThinner

CHUNK = 50_000


def merge_libraries(out: Path, paths: Sequence[Path], spacing_m: float = 0.0) -> int:
    """Write the poses of libraries, in order, into one; return how many were kept.

    Args:
        out: Library file to write.
        paths: Libraries to read.
        spacing_m: Leave out poses nearer than this mean joint distance [m] to a kept one; 0
            keeps all.

    Raises:
        LibraryFileError: If a file is not a library.
    """
    libraries = [load_library(path) for path in paths]
    chunks = [
        (library, start, min(start + CHUNK, len(library)))
        for library in libraries for start in range(0, len(library), CHUNK)
    ]
    rows = [np.arange(start, end) for _, start, end in chunks]
    if spacing_m > 0:
        sample = np.concatenate([
            library.joints[:: max(1, len(library) // CHUNK)] for library in libraries])
        thinner = PoseThinner(sample, spacing_m, sum(len(library) for library in libraries))
        rows = [
            start + thinner.accept(np.ascontiguousarray(library.joints[start:end]))
            for library, start, end in chunks
        ]
    kept = sum(len(r) for r in rows)
    with new_library_file(out, kept, {'origin': ', '.join(p.name for p in paths)}) as arrays:
        begin = 0
        for (library, _, _), index in zip(chunks, rows, strict=True):
            part = slice(begin, begin + len(index))
            for name in ARRAYS:
                source = getattr(library, name)
                if name == 'columns':
                    arrays[name][:, :, part] = source[:, :, index]
                else:
                    arrays[name][part] = source[index]
            begin = part.stop
    return kept
