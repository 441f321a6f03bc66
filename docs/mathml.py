"""A hook of MkDocs: equations become MathML when the site is built, so that it needs no network."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
_EQUATION = re.compile(r"\$\$(?P<block>.+?)\$\$|\$(?P<inline>[^$]+?)\$", re.DOTALL)
_PLACE = "equation{}equation"
_equations: list[str] = []  # of the page that is being made


def on_page_markdown(markdown: str, **_: object) -> str:
    """A mark in the place of each equation, which Markdown would take for its own signs."""
    _equations.clear()
    parts = _CODE.split(markdown)
    return "".join(part if k % 2 else _EQUATION.sub(_kept, part) for k, part in enumerate(parts))


def on_page_content(html: str, **_: object) -> str:
    for k, equation in enumerate(_equations):
        html = html.replace(_PLACE.format(k), equation)
    return html


def _kept(found: re.Match[str]) -> str:
    latex = " ".join((found["block"] or found["inline"]).split())
    _equations.append(convert(latex, display="block" if found["block"] else "inline"))
    return _PLACE.format(len(_equations) - 1)
