"""TeX between the marks of pymdownx.arithmatex → MathML."""

from __future__ import annotations

import html as entities
import re

from latex2mathml.converter import convert

INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.S)
DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.S)


def with_mathml(html: str) -> str:
    """Return the page with every equation as a `<math>` element."""
    html = DISPLAY.sub(lambda m: f'<div class="equation">{_mathml(m[1], "block")}</div>', html)
    return INLINE.sub(lambda m: _mathml(m[1], "inline"), html)


def _mathml(tex: str, display: str) -> str:
    return convert(entities.unescape(tex).strip(), display=display)
