"""Pieces of HTML for notebooks. Text is escaped."""

from __future__ import annotations

import html
from typing import Iterable, Sequence

_COLOURS = {"wrong": "#b00020", "inconclusive": "#8a6d00"}


def block(verdict: str, text: str) -> str:
    colour = _COLOURS.get(verdict, "#1b6e3a")
    return f'<pre style="border-left:4px solid {colour};padding-left:8px">{html.escape(text)}</pre>'


def table(rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f'<{tag} style="text-align:left">{html.escape(str(cell))}</{tag}>' for cell in cells) + "</tr>"

    head = row(header, "th") if header else ""
    return f"<table>{head}{''.join(row(cells, 'td') for cells in rows)}</table>"
