"""The Markdown pages of the documentation, taken apart for tests."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = (".", "docs", "studies", "benchmarks", "meshes")
PAGES = sorted(path.relative_to(ROOT).as_posix() for folder in FOLDERS for path in (ROOT / folder).glob("*.md"))


@dataclass(frozen=True)
class Page:
    """One page; `name` is its path from the root."""

    name: str

    @property
    def path(self) -> Path:
        return ROOT / self.name

    @property
    def text(self) -> str:
        return self.path.read_text(encoding="utf-8")

    def tokens(self) -> list[Token]:
        return MarkdownIt("commonmark").enable("table").parse(self.text)

    def inline(self) -> Iterator[Token]:
        for token in self.tokens():
            yield from token.children or ()

    def blocks(self, *languages: str) -> list[str]:
        """Contents of the fenced blocks of these languages; "" for indented ones."""
        found = [token for token in self.tokens() if token.type in ("fence", "code_block")]
        return [token.content for token in found if token.info.strip() in languages]

    def spans(self) -> list[str]:
        """Code inside of lines."""
        return [token.content for token in self.inline() if token.type == "code_inline"]

    def targets(self) -> list[str]:
        """Where links and pictures lead."""
        found = [token.attrGet("href") or token.attrGet("src") for token in self.inline()]
        return [str(target) for target in found if target]

    def headings(self) -> list[str]:
        tokens = self.tokens()
        return [tokens[k + 1].content for k, token in enumerate(tokens) if token.type == "heading_open"]

    def anchors(self) -> set[str]:
        """Of the headings, as GitHub makes them."""
        kept = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in self.headings())
        return {text.strip().replace(" ", "-") for text in kept}

    def commands(self) -> list[list[str]]:
        """Words of the commands that the page tells to type, in blocks and inside of lines, without comments."""
        lines = [line[2:] for block in self.blocks("console") for line in block.splitlines() if line.startswith("$ ")]
        lines += [line for block in self.blocks("sh") for line in block.splitlines()]
        known = re.compile(r"(make|sbatch|mpirun(?= -)|(\.venv/bin/)?python) ")
        loose = [*self.spans(), *(line for block in self.blocks("") for line in block.splitlines())]
        lines += [line for line in loose if known.match(line) and "…" not in line]
        return [words for line in lines if (words := shlex.split(line, comments=True))]
