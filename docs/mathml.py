"""Equations of the site as MathML, which browsers draw themselves: a Sphinx extension without a script or a font."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx

_NUMBER = re.compile(r"\\tag\{(\w+)\}")


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    equation = tex2mathml(_NUMBER.sub(r"\\qquad (\1)", node.astext()), as_block=True)
    writer.body.append(f'<div class="math table-wrapper">{equation}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer; `\\tag{3}` in a block is its number."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True}
