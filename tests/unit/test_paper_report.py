"""The page: it stands alone, has every figure, and shows text as text."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from paper_files import write_results
from PIL import Image

from cellmech.errors import InputError
from cellmech.figures.embedded import WIDEST, embed
from cellmech.figures.markup import markdown_html
from cellmech.figures.page import duration, pretty
from studies.paper.__main__ import main
from studies.paper.comparison import compare
from studies.paper.report import FIGURES, report_html

VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """Tags, what they load, and whether they are nested as they should be."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.open += [] if tag in VOID else [tag]
        self.loads += [value or "" for name, value in attributes if name in ("src", "href", "srcset", "data", "action")]
        self.ids += [value or "" for name, value in attributes if name == "id"]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with pictures of all figures but the last."""
    folder = write_results(tmp_path_factory.mktemp("results"))
    (folder / "figures").mkdir()
    for index, stem in enumerate(FIGURES):
        if stem != "fig7":
            Image.new("RGB", (40 + index, 30), (10 * index, 0, 0)).save(folder / "figures" / f"{stem}.png")
    return folder


@pytest.fixture
def results(finished: Path, tmp_path: Path) -> Path:
    """A copy to change."""
    return Path(shutil.copytree(finished, tmp_path / "results"))


@pytest.fixture(scope="module")
def page(finished: Path) -> str:
    return report_html(finished, compare(finished))


def test_every_figure_is_embedded_and_a_missing_one_is_said_to_be(page: str, finished: Path) -> None:
    for stem in FIGURES:
        assert f'<figure id="{stem}">' in page
        if stem != "fig7":
            content = base64.b64encode((finished / "figures" / f"{stem}.png").read_bytes()).decode()
            assert page.count(content) == 1
    assert "Figure 7 is missing" in page and "Figure 6 is missing" not in page


def test_the_page_loads_nothing_from_outside_and_needs_no_script(page: str) -> None:
    found = Page(page)
    assert found.open == [] and found.tags.count("img") == 6
    assert {url.partition(":")[0] if ":" in url else url[0] for url in found.loads} == {"data", "#"}
    assert {url[1:] for url in found.loads if url.startswith("#")} <= set(found.ids)
    assert not {"script", "link", "iframe", "object"} & set(found.tags)
    assert not re.search(r"url\(|@import|https?://", page)


def test_tiles_and_comparison_show_the_numbers(page: str) -> None:
    for text in ("57 of 57", "11,400", "7 min", "two parameter sweeps", "1.032", "× ", "Mooney–Rivlin"):
        assert text in page
    assert page.count('class="matrix"') == 5 and page.count("<summary>") == 9
    assert re.search(r'<td class="off"><b>× 5\.8</b><small>5\.00 \| 0\.86</small>', page)  # 5.0/0.86


def test_reasons_and_names_are_shown_as_text(results: Path) -> None:
    path = results / "fig2" / "yeoh" / "result.json"
    entries = {"status": "failed", "reason": '<script>alert("x")</script> & more'}
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))
    text = report_html(results, compare(results))
    assert "<script" not in text and "&lt;script&gt;alert" in text and "&amp; more" in text
    assert "56 of 57" in text and "Cases without a result" in text
    (results / "figures" / 'audit"><b>.png').write_bytes((results / "figures" / "fig1.png").read_bytes())
    assert 'audit"><b>' not in report_html(results, compare(results))


def test_the_audit_is_taken_in_when_it_is_there(results: Path, page: str) -> None:
    assert "has not been run" in page
    (results / "figures" / "audit.md").write_text("# Audit\n\nNo single *load* does it: **12 %** <at most>.\n")
    (results / "figures" / "calibration.md").write_text("# Fits\n\nNone.\n\n## Table <1>\n\n| a |\n|---|\n| 7 |\n")
    Image.new("RGB", (9, 9)).save(results / "figures" / "audit_map.png")
    Image.new("RGB", (9, 9)).save(results / "figures" / "other.png")
    text = report_html(results, compare(results))
    audit = text[text.index('<section id="audit">') : text.index('<section id="runs">')]
    assert "<strong>12 %</strong> &lt;at most&gt;" in audit and '<figure id="audit_map">' in audit
    assert "<summary>Table &lt;1&gt;</summary>" in audit and "<td>7</td>" in audit and "has not been run" not in text
    assert '<figure id="other">' in text and '<figure id="other">' not in audit


def test_command_writes_the_page_beside_the_studies(finished: Path, tmp_path: Path, capsys: Any) -> None:
    assert main(["report", "--results", str(finished), "--out", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_huge_picture_is_made_smaller(tmp_path: Path) -> None:
    Image.new("RGB", (2 * WIDEST, 500), "white").save(tmp_path / "a.png")
    found = embed(tmp_path / "a.png")
    assert found is not None and (found.width, found.height) == (WIDEST, 250)
    with Image.open(io.BytesIO(base64.b64decode(found.uri.partition(",")[2]))) as image:
        assert image.size == (WIDEST, 250)


def test_a_file_that_is_no_picture_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("nothing")
    with pytest.raises(InputError, match=r"a.png: is no PNG or GIF picture"):
        embed(tmp_path / "a.png")
    assert embed(tmp_path / "b.png") is None


def test_markdown_becomes_html() -> None:
    text = "# Title\n\nOne `x < 1`\ntwo.\n\n- a\n- **b**\n\n| h | k |\n|---|--:|\n| 1 | 2 |\n"
    found = str(markdown_html(text))
    assert "<h3>Title</h3>" in found and "<p>One <code>x &lt; 1</code> two.</p>" in found
    assert "<ul><li>a</li><li><strong>b</strong></li></ul>" in found
    assert "<tr><th>h</th><th>k</th></tr>" in found and "<tbody><tr><td>1</td><td>2</td></tr></tbody>" in found


def test_symbols_get_low_indices() -> None:
    assert pretty("σ_Mises, c_f,l = 0.9, E_np, J1² − q0 < J12") == (
        "σ<sub>Mises</sub>, c<sub>f,l</sub>\u00a0=\u00a00.9, E<sub>np</sub>, J<sub>1</sub>² − q<sub>0</sub> &lt; J12"
    )


@pytest.mark.parametrize(("seconds", "text"), [(99, "99 s"), (120, "2 min"), (7200, "2.0 h"), (float("nan"), "–")])
def test_durations_are_readable(seconds: float, text: str) -> None:
    assert duration(seconds) == text
