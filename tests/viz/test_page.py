from __future__ import annotations

import json

from bluefoot_mpc.viz.page import embed_json, embed_script


def test_json_cannot_end_its_script() -> None:
    value = {"text": "</script><!-- <script>", "numbers": [1.5, None]}
    text = str(embed_json(value))
    assert "<" not in text
    assert json.loads(text) == value


def test_script_cannot_end_its_element() -> None:
    text = str(embed_script('a = "</script>"; b = "<!-- x";'))
    assert "</script" not in text
    assert "<!--" not in text
