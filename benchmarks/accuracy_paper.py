"""The paper's own table (its Figure 4) on as many frames: mean and standard deviation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.table import Table

PAPER_FRAMES = 18
# Key, label, mean and standard deviation as reported; metres except err_beta.
REPORTED = (
    ('err_beta', 'err_beta (Eq. 3)', 1.0008, 0.013),
    ('err_J', 'err_J (Eq. 4)', 0.1157, 0.0741),
    ('err_pose', 'err_pose (Eq. 5)', 0.1515, 0.0950),
    ('err_visible', 'err_pose visible (Eq. 6)', 0.1335, 0.0788),
    ('err_occluded', 'err_pose occluded (Eq. 7)', 0.2724, 0.1994),
    ('p2p_vertex', 'err_p2p (Eq. 8)', 0.0228, 0.0064),
)


def paper_subset(entries: Sequence[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """Return the most hidden person of each of the first 18 frames, as far as found."""
    chosen = []
    for entry in entries[:PAPER_FRAMES]:
        people = [record for record in entry['methods'][name]['people'] if record['found']]
        if people:
            chosen.append(max(people, key=lambda record: float(record['hidden_share'])))
    return chosen


def paper_table(records: Sequence[dict[str, Any]]) -> Table:
    """Return our mean and standard deviation beside the reported ones."""
    title = f'The paper\'s table on {len(records)} of our frames, one person each'
    shown = Table(title=title, title_justify='left')
    shown.add_column('metric [m]', no_wrap=True)
    for name in ('mean', 'std', 'paper, as reported,\non its own frames: mean', 'std'):
        shown.add_column(name, justify='right')
    for key, label, mean, std in REPORTED:
        values = np.array([record.get(key, np.nan) for record in records], dtype=np.float64)
        values = values[np.isfinite(values)]
        if len(values):
            shown.add_row(label, f'{values.mean():.4f}', f'{values.std():.4f}',
                          f'{mean:.4f}', f'{std:.4f}')
    return shown
