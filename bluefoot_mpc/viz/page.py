"""HTML pages from the templates that ship with the package."""

from __future__ import annotations

import base64
import functools
import gzip
from collections.abc import Sequence
from importlib import resources
from typing import Any

import orjson
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


def render(template: str, **values: Any) -> str:
    """Fill a template; text is escaped, what `embed_json` and `embed_script` made is not."""
    return _environment().get_template(template).render(css=Markup(template_text("style.css")), **values)


def embed_json(value: Any) -> Markup:
    """JSON that may stand inside a ``<script>`` element."""
    text = orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY).decode("utf-8")
    # Inside a script element only "</script" and "<!--" could end or change it.
    return Markup(text.replace("<", "\\u003c"))


def embed_script(source: str) -> Markup:
    """JavaScript that may stand inside a ``<script>`` element."""
    return Markup(source.replace("</script", "<\\/script").replace("<!--", "\\x3c!--"))


def scripts(sources: Sequence[str], *, packed: bool) -> dict[str, Any]:
    """What a template needs to run scripts one after the other.

    Args:
        sources: JavaScript.
        packed: True packs them, for pages that would become too large.
    """
    ready = [pack_script(source) if packed else embed_script(source) for source in sources]
    return {"packed": packed, "scripts": ready, "unpack_script": embed_script(template_text("unpack.js"))}


@functools.cache
def pack_script(source: str) -> str:
    """JavaScript as base64 of its gzip, a third of its size; `unpack.js` makes it run."""
    return base64.b64encode(gzip.compress(source.encode("utf-8"), mtime=0)).decode("ascii")


@functools.cache
def template_text(name: str) -> str:
    """A file of the templates folder, as text."""
    return (resources.files("bluefoot_mpc.viz") / "templates" / name).read_text(encoding="utf-8")


@functools.cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("bluefoot_mpc.viz", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
