"""The manual builds without a warning, opens from disk, and knows every public name."""

from __future__ import annotations

import html.parser
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

pytestmark = pytest.mark.slow
pytest.importorskip("mkdocs", reason="needs the extra docs")

from manual.api import docstring_of  # noqa: E402
from manual.mathml import with_mathml  # noqa: E402
from manual.shared_names import one_name_a_line  # noqa: E402
from manual.subjects import PACKAGES, PublicName, public_names, subject_of  # noqa: E402
from manual.terms import TERMS, with_links  # noqa: E402


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(out)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return out


class _Page(html.parser.HTMLParser):
    def __init__(self, path: Path) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.loaded: list[str] = []
        self.pictures: list[tuple[str, str]] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        if "id" in found:
            self.ids.add(found["id"])
        if tag in ("script", "img", "iframe") and "src" in found:
            self.loaded.append(found["src"])
        if tag == "link" and found.get("rel") in ("stylesheet", "preconnect", "icon"):
            self.loaded.append(found["href"])
        if tag == "img" and "twemoji" not in found.get("class", ""):
            self.pictures.append((found.get("src", ""), found.get("alt", "")))


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[str, _Page]:
    return {str(p.relative_to(site)): _Page(p) for p in sorted(site.rglob("*.html"))}


def test_nothing_is_loaded_from_elsewhere(pages):
    for name, page in pages.items():
        if name == "404.html":  # is served from anywhere, so its links begin at the root
            continue
        for address in page.loaded:
            assert "//" not in address, f"{name}: {address}"
            assert not address.startswith("/"), f"{name}: {address}"


def test_pictures_are_there_and_have_a_text(site, pages):
    for name, page in pages.items():
        for source, text in page.pictures:
            assert len(text) > 10, f"{name}: {source}"
            assert ((site / name).parent / source).resolve().is_file(), f"{name}: {source}"


def test_search_works_without_a_server(site):
    assert (site / "search" / "search_index.js").stat().st_size > 100_000
    assert (site / "assets" / "iframe-worker.js").is_file()


def test_every_public_name_is_described_once(pages):
    described = [
        (name, identity)
        for name, page in pages.items()
        if name.startswith("reference/python/")
        for identity in page.ids
    ]
    face = public_names()
    sources = {name.source for name in face}
    for name in face:
        (page,) = {p for p, identity in described if identity == name.path}
        assert page == f"reference/python/{subject_of(name)}.html"
    for package in PACKAGES:
        for name in public_names(package):
            if name.source not in sources:
                assert [p for p, identity in described if identity == name.path], name.path


@pytest.fixture(scope="module")
def loaded():
    import griffe

    return griffe.load("drake_racket", search_paths=[ROOT], resolve_aliases=True)


NAMES = [name for package in ("", *PACKAGES) for name in public_names(package)]


@pytest.mark.parametrize("name", NAMES, ids=lambda name: name.path)
def test_every_public_name_has_a_docstring(name: PublicName, loaded):
    text = docstring_of(name, loaded)
    assert len(text.split()) >= 4
    assert "TODO" not in text


def test_formulas_are_set_when_the_site_is_built(site):
    for path in site.rglob("*.html"):
        assert "arithmatex" not in path.read_text(encoding="utf-8"), path
    text = with_mathml('<span class="arithmatex">\\(k x^2 &lt; F\\)</span>')
    assert re.search(r"<msup>\s*<mi>x</mi>\s*<mn>2</mn>", text)
    assert 'aria-label="k x^2 &lt; F"' in text


def test_the_glossary_is_linked_where_a_page_uses_a_word_first():
    text = (
        "# T0\n\nThe `T0` of a bed. Now T0 and T0, [T0](x.md) and swingweight. The Swingweight.\n"
    )
    linked = with_links(text, "howto/page.md")
    assert linked == text.replace("Now T0", "Now [T0](../reference/glossary.md#t0)").replace(
        "and swingweight", "and [swingweight](../reference/glossary.md#swingweight)"
    )
    assert with_links(text, "reference/glossary.md") == text
    page = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")
    for anchor in TERMS.values():
        assert f'<a id="{anchor}"></a>' in page


def test_names_that_share_a_line_are_parted():
    text = (
        "It.\n\nArgs:\n    a, b: one text\n        of two lines.\n    c: m.  d: s, of\n        it."
    )
    assert one_name_a_line(text).splitlines()[2:] == [
        "Args:",
        "    a: one text",
        "        of two lines.",
        "    b: one text",
        "        of two lines.",
        "    c: m.",
        "    d: s, of",
        "        it.",
    ]
