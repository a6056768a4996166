"""Write the site: docs/*.md, README and glossary, the commands from the parser, Python from its docstrings, notebook, examples.

`make docs` runs it. Sphinx builds the pages offline and strictly: a link that leads nowhere is an error, and so are a script or
font from elsewhere and a site of more than 10 MB.
"""

import argparse
import ast
import hashlib
import json
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import calib_core
from cocalib.cli.commands import COMMANDS
from cocalib.cli.exit_codes import exit_codes
from cocalib.cli.help import named_options_help, short_help

_ROOT = Path(__file__).parent.parent
_MOST_MB = 10.0
_PAGES = {
    "Get started": "tour first-steps examples gallery",
    "How to": "radar-formats intrinsics proposals evaluation boxes drift watch fleet report citing rerun simulation",
    "Concepts": "method conventions apex paper reliability security GLOSSARY",
    "Reference": "commands page python formats warnings",
    "Project": "accuracy real paper-experiments speed CHANGELOG CONTRIBUTING ARCHITECTURE SECURITY",
}
_WRAPPED = ".highlight pre { white-space: pre-wrap; overflow-wrap: anywhere; }\n"
"""No line of code is cut off, whatever the window."""
_INLINE = re.compile(r"<(script|style)>(.*?)</\1>", re.DOTALL)
_STYLES = (
    ('style="display: none;"', 'class="visually-hidden"'),
    ('style="opacity: 50%"', 'opacity="0.5"'),
)
_STYLED = re.compile(r"\sstyle=\"[^\"]*\"")
_FORBIDDEN = re.compile(
    r"<script>|<style|\sstyle=|@import|url\([\"']?(https?:)?//|"
    r"(src|href)=[\"']?(https?:)?//[^\"'>]*\.(js|css|woff2?|ttf|svg|png)"
)
"""What the page's policy does not allow, or what comes from elsewhere."""


def _commands() -> Iterator[str]:
    """Yield the page of the commands."""
    yield "# Commands\n\n`--help all` after a command lists every option; options by name are at the end.\n"
    for command in COMMANDS.values():
        yield f"## {command.name}\n\n```text\n{short_help(command)}```\n"
    yield f"## Exit codes\n\n{exit_codes().removeprefix('Exit codes. ')}\n"
    yield f"## Options by name\n\n```text\n{named_options_help(COMMANDS['solve'].load())}```\n"


def _python() -> Iterator[str]:
    """Yield the page of the Python names."""
    yield "# Python\n\n`import cocalib as cc`; the [examples](examples.md) use it. Functions of arrays say their shapes.\n"
    uses = _uses(_ROOT / "docs" / "examples")
    for name in calib_core.__all__:
        kind = "autoclass" if isinstance(getattr(calib_core, name), type) else "autofunction"
        members = "\n   :members:" if kind == "autoclass" else ""
        yield f"```{{eval-rst}}\n.. {kind}:: calib_core.{name}{members}\n```\n"
        if name in uses:
            yield f"```python\n{uses[name]}\n```\n"


def _uses(folder: Path) -> dict[str, str]:
    """Return by public name the shortest statement of the examples that uses it; of one with a body its head."""
    uses: dict[str, str] = {}
    for path in sorted(folder.glob("*.py")):
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Assign | ast.Expr | ast.With | ast.For):
                text = ast.get_source_segment(source, node) or ""
                if isinstance(node, ast.With | ast.For):
                    text = text.split("\n")[0] + "\n    ..."
                for name in re.findall(r"\bcc\.(\w+)", text):
                    uses[name] = min(uses.get(name, text), text, key=len)
    return uses


def _notebook(path: Path) -> Iterator[str]:
    """Yield a notebook with the outputs that it holds."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        yield f"{text}\n" if cell["cell_type"] == "markdown" else f"```python\n{text}\n```\n"
        for output in cell.get("outputs", []):
            yield f"```text\n{''.join(output.get('text', []))}\n```\n"


def _examples(folder: Path) -> Iterator[str]:
    """Yield the page of the examples."""
    yield "# Examples\n\nEach runs on its own, with what is installed; a test runs them from the wheel.\n"
    for path in sorted(folder.glob("*.py")):
        yield f"## {path.stem[3:].replace('_', ' ').capitalize()}\n\n```python\n{path.read_text(encoding='utf-8')}```\n"


def _tree() -> Iterator[str]:
    """Yield the site's contents."""
    for caption, pages in _PAGES.items():
        yield f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(pages.split()) + "\n```\n"


def _assemble(folder: Path) -> None:
    """Write the pages that Sphinx reads, all in one folder."""
    docs = _ROOT / "docs"
    pages = {path.stem: path.read_text(encoding="utf-8") for path in docs.glob("*.md")}
    for name in ("README", "GLOSSARY", "CHANGELOG", "CONTRIBUTING", "ARCHITECTURE", "SECURITY"):
        pages[name] = (_ROOT / f"{name}.md").read_text(encoding="utf-8")
    pages["index"] = pages.pop("README") + "\n" + "\n".join(_tree())
    pages["commands"], pages["python"] = "\n".join(_commands()), "\n".join(_python())
    pages["first-steps"] = "\n".join(_notebook(docs / "first-steps.ipynb"))
    pages["examples"] = "\n".join(_examples(docs / "examples"))
    for name, text in pages.items():
        for link, target in (
            ("../", ""),
            ("docs/examples/", "examples.md"),
            ("docs/", ""),
            ("README.md", "index.md"),
            ("first-steps.ipynb", "first-steps.md"),
        ):
            text = text.replace(f"]({link}", f"]({target}")
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    for name in ("images", "schemas"):
        shutil.copytree(docs / name, folder / name)
    tables = Path("benchmarks", "accuracy", "tables")
    shutil.copytree(_ROOT / tables, folder / tables)
    for name in ("CITATION.cff", "LICENSE", "pyproject.toml"):
        shutil.copy(_ROOT / name, folder / name)
    shutil.copy(_ROOT / "static" / "icon.svg", folder / "icon.svg")
    (folder / "styles").mkdir()
    (folder / "styles" / "site.css").write_text(_WRAPPED, encoding="utf-8")


def _moved(out: Path, inline: re.Match[str]) -> str:
    """Write a script or a style of a page to a file of its own, since the page's policy allows none within, and refer to it."""
    kind, text = inline.groups()
    name = f"_static/{hashlib.sha256(text.encode()).hexdigest()[:12]}.{'js' if kind == 'script' else 'css'}"
    (out / name).write_text(text, encoding="utf-8")
    return f'<script src="{name}"></script>' if kind == "script" else f'<link rel="stylesheet" href="{name}">'


def main() -> int:
    """Build the site; return the exit code."""
    from sphinx.application import Sphinx

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=_ROOT / "app" / "cocalib" / "site")
    out = parser.parse_args().out
    settings = {
        "project": "cocalib",
        "html_title": "cocalib",
        "extensions": ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "mathml"],
        "html_theme": "furo",
        "html_math_renderer": "mathml",
        "html_show_copyright": False,
        "html_favicon": "icon.svg",
        "html_static_path": ["styles"],
        "html_css_files": ["site.css"],
        "html_copy_source": False,
        "html_use_index": False,
        "html_show_sourcelink": False,
        "html_show_sphinx": False,
        "myst_heading_anchors": 4,
        "myst_enable_extensions": ["dollarmath"],
        "myst_dmath_allow_space": False,
        "copybutton_exclude": ".go, .gp",
        "autodoc_typehints": "none",
        "napoleon_numpy_docstring": False,
        "highlight_language": "text",
        "add_module_names": False,
    }
    with tempfile.TemporaryDirectory(prefix="cocalib-docs-") as folder:
        _assemble(Path(folder))
        shutil.rmtree(out, ignore_errors=True)
        app = Sphinx(folder, None, out, Path(folder) / ".doctrees", "html", settings, warningiserror=True, status=None)
        app.build()
    for page in out.glob("*.html"):
        text = _INLINE.sub(partial(_moved, out), page.read_text(encoding="utf-8"))
        for style, attribute in _STYLES:
            text = text.replace(style, attribute)
        page.write_text(_STYLED.sub("", text), encoding="utf-8")
    files = [path for path in out.rglob("*") if path.is_file()]
    size_mb = sum(path.stat().st_size for path in files) / 1e6
    forbidden = [
        str(path) for path in files if path.suffix in (".html", ".css") and _FORBIDDEN.search(path.read_text("utf-8"))
    ]
    if app.statuscode or forbidden or size_mb > _MOST_MB:
        print(f"warnings, or what is not allowed in {forbidden}, or {size_mb:.1f} MB of {_MOST_MB:g}", file=sys.stderr)
        return 1
    print(f"{out}: {len(list(out.glob('*.html')))} pages, {size_mb:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
