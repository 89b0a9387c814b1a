"""The pages as a site, `make docs`: the Markdown files as they stand, from the repository's README on."""

from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

ROOT = Path(__file__).resolve().parents[1]

project = "isarflow"
root_doc = "README"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md", "docs/*.md"]
include_patterns += [f"resources/fields/{folder}README.md" for folder in ("", "families/", "flyers/", "flyers-metal/")]
include_patterns += ["resources/cad/README.md", "resources/glossary.md"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_typehints = "none"  # they stand in the signature
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = {"math"}  # as GitHub has them
myst_heading_anchors = 4
html_theme = "furo"
html_math_renderer = "mathml"  # which browsers draw by themselves, without a program from the network
html_title = project
html_show_copyright = False
highlight_language = "text"
nitpicky = True

MENU = {
    "First steps": ["docs/tutorial", "docs/running", "config/README", "docs/troubleshooting", "docs/cluster"],
    "What to change": [f"docs/adding-{what}" for what in ("a-target", "an-snr", "a-model", "an-imager", "a-solver")]
    + ["docs/materials", "docs/families"],
    "Data": [
        "docs/rcs",
        "resources/fields/README",
        "resources/fields/families/README",
        "resources/fields/flyers/README",
        "resources/fields/flyers-metal/README",
        "resources/cad/README",
        "docs/own-fields",
        "docs/exported-images",
        "docs/api",
        "docs/comparing-runs",
        "resources/glossary",
    ],
    "What it computes": [
        "docs/method",
        "docs/imagers",
        "docs/motion",
        "docs/recognition",
        "docs/kinds",
        "docs/flight",
        "docs/benchmark",
        "docs/validation",
        "docs/results",
    ],
    "The project": ["docs/README", "CONTRIBUTING", "CHANGELOG"],
}


def _add_menu(app, name, source):
    """The menu of all pages: where the README is read by itself it has none."""
    if name == root_doc:
        for caption, pages in MENU.items():
            there = [page for page in pages if (ROOT / f"{page}.md").exists()]
            source[0] += "\n```{toctree}\n:hidden:\n:caption: " + caption + "\n\n" + "\n".join(there) + "\n```\n"


def _inline(writer, node):
    writer.body.append(tex2mathml(node.astext()))
    raise SkipNode


def _block(writer, node):
    # The theme gives each a scroll bar of its own.
    formula = tex2mathml(node.astext(), as_block=True).replace("<math ", '<math style="overflow: visible" ', 1)
    writer.body.append(f'<div style="overflow-x: auto; overflow-y: hidden; padding: 0.4em 0">{formula}</div>')
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("source-read", _add_menu)
