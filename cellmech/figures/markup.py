"""The Markdown our tables are written in as HTML: headings, paragraphs, lists, tables, code and bold, no more."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import groupby

from markupsafe import Markup, escape


def markdown_html(text: str, top: int = 3) -> Markup:
    """Markdown as HTML; whatever else it holds is shown as text.

    Args:
        text: the Markdown.
        top: level of its highest heading on the page.
    """
    return Markup("\n").join(_blocks(text, top))


def _blocks(text: str, top: int) -> Iterator[Markup]:
    for kind, group in groupby(text.splitlines(), _kind):
        lines = [line.strip() for line in group]
        if kind == "heading":
            for line in lines:
                level = min(6, top - 1 + len(line) - len(line.lstrip("#")))
                yield Markup("<h{0}>{1}</h{0}>").format(level, _inline(line.lstrip("# ")))
        elif kind == "list":
            yield _wrapped("ul", "li", (line[2:] for line in lines))
        elif kind == "table":
            yield _table(lines)
        elif kind == "text":
            yield Markup("<p>{}</p>").format(_inline(" ".join(lines)))


def _kind(line: str) -> str:
    line = line.strip()
    starts = {"#": "heading", "- ": "list", "* ": "list", "|": "table"}
    return next((kind for start, kind in starts.items() if line.startswith(start)), "text" if line else "")


def _table(lines: list[str]) -> Markup:
    header, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    body = [row for row in rows if not all(re.fullmatch(":?-+:?", cell) for cell in row)]
    head = _wrapped("tr", "th", header)
    parts = Markup("").join(_wrapped("tr", "td", row) for row in body)
    return Markup('<div class="scroll"><table><thead>{}</thead><tbody>{}</tbody></table></div>').format(head, parts)


def _wrapped(outer: str, inner: str, items: Iterator[str] | list[str]) -> Markup:
    content = Markup("").join(Markup("<{0}>{1}</{0}>").format(Markup(inner), _inline(item)) for item in items)
    return Markup("<{0}>{1}</{0}>").format(Markup(outer), content)


def _inline(text: str) -> Markup:
    marked: str = str(escape(text))
    swaps: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
        (r"`([^`]+)`", r"<code>\1</code>"),
        (r"\*\*([^*]+)\*\*", r"<strong>\1</strong>"),
    )
    for pattern, replacement in swaps:
        marked = re.sub(pattern, replacement, marked)
    return Markup(marked)
