"""Reads a page the way a browser does, as far as structure and outside references go."""

from __future__ import annotations

import re
from html.parser import HTMLParser

VOID = {"meta", "input", "br", "link", "img", "hr"}


class PageReader(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.policy = ""
        self.texts: dict[str, str] = {}
        self._script = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        if values.get("id"):
            self.ids.append(str(values["id"]))
        if values.get("http-equiv") == "Content-Security-Policy":
            self.policy = str(values["content"])
        for key in ("src", "href", "srcset", "action", "data", "poster"):
            # Pictures inside the page load nothing.
            if values.get(key) and not str(values[key]).startswith("data:image/"):
                self.references.append(str(values[key]))
        self._script = str(values.get("id") or "") if tag == "script" else ""

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1] == tag, f"</{tag}> closes <{self.open[-1]}>"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script" and self._script:
            self.texts[self._script] = self.texts.get(self._script, "") + data
        if self.open and self.open[-1] == "style":
            self.references += re.findall(r"url\(([^)]*)\)|@import\s+(\S+)", data)


def read_page(text: str) -> PageReader:
    """A page that is well-formed, names nothing twice, and loads nothing from outside."""
    page = PageReader(text)
    assert not page.open, f"never closed: {page.open}"
    assert len(page.ids) == len(set(page.ids))
    assert page.references == []
    assert page.policy.startswith("default-src 'none'")
    assert "http" not in page.policy
    return page
