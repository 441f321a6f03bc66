"""A document as one self-contained HTML page."""

from __future__ import annotations

import base64
import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from bsip_cli.errors import printable
from bsip_cli.report.blocks import Document

FILES = "figures"
"""Folder beside the page that holds its figures and the numbers behind them."""

_BEFORE_UNIT = re.compile(r"(?<=[\d)]) (?=(?:mm|ms|kg|m|s|N|Hz)\b|%)|(?<=N) (?=m\b)|(?<=%) (?=BW)")
_TEMPLATES = Path(__file__).parent / "templates"


def render(document: Document) -> str:
    """The page: figures as data, nothing from the network, no script at all; all texts escaped."""
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_cleaned,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["svg_source"] = _svg_source
    environment.filters["tied"] = _tied
    style = Markup((_TEMPLATES / "report.css").read_text(encoding="utf-8"))
    return environment.get_template("report.html.j2").render(
        document=document, style=style, files=FILES
    )


def _cleaned(value: object) -> object:
    """Names of files and markers may hold control characters; what templates make is clean."""
    is_foreign = isinstance(value, str) and not isinstance(value, Markup)
    return printable(str(value)) if is_foreign else value


def _tied(text: str) -> str:
    """Numbers and their units stay on one line."""
    return re.sub(_BEFORE_UNIT, "\N{NO-BREAK SPACE}", text)


def _svg_source(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode('ascii')}"
