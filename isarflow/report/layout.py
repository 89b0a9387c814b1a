"""What a page is made of - figures, tables, sections - and how all looks: fonts, colours, SVG, numbers as text."""

import base64
import io
import re
from collections import namedtuple
from functools import cached_property

import matplotlib
import pandas as pd
from matplotlib.figure import Figure as Canvas
from PIL import Image

# Okabe and Ito's palette without its yellow, for colour-blind readers; then five as dark, but less far apart.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#B0578D", "#C98500", "#3A93C9", "#222222")
PALETTE += ("#A6193C", "#00707A", "#7A6A00", "#5B4BB5", "#767676")
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, CRIMSON, TEAL, OLIVE, INDIGO, GREY = PALETTE

ON_LIGHT, ON_DARK = "#010101", "#fefefe"  # on a coloured cell: not turned over in the page's dark look
RASTER_COLORS = 96  # of pictures within an SVG: meshes and images have few, and are a fifth as large with a palette
SCALE = 1.55  # CSS pixels per point; true size would be 4/3

# The font comes with matplotlib, so that every machine draws the same.
RCPARAMS = {"font.family": "DejaVu Sans", "font.size": 9, "axes.titlesize": 9}
RCPARAMS |= {"axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True}
RCPARAMS |= {"grid.color": "#d9d9d9", "grid.linewidth": 0.6, "legend.frameon": False}
RCPARAMS |= {"lines.linewidth": 1.4, "lines.markersize": 3.5}
# The ids in an SVG file do not depend on chance; savefig.dpi is of what is rasterized inside one.
RCPARAMS |= {"svg.hashsalt": "isarflow", "svg.fonttype": "path", "figure.dpi": 100, "savefig.dpi": 120}

# One chapter: an anchor, a heading, a few lines of text, then figures, tables and code, shown as it is, folded;
# or live: data, for JSON, of what the script <id>.js draws within <id>.html.
Section = namedtuple("Section", "id title text figures tables code live", defaults=((), (), (), "", None))


class Figure(namedtuple("Figure", "name svg data alt caption wide")):
    """A picture of the page: an SVG file (bytes), the numbers drawn in it, and what it says to those who cannot see it.

    wide: it takes the page's whole width.
    """

    @property
    def size(self):
        """Width and height in CSS pixels at which the figure's letters are nearly as large as the page's."""
        width, height = re.search(rb'<svg [^>]*?width="([\d.]+)pt" height="([\d.]+)pt"', self.svg).groups()
        return round(float(width) * SCALE), round(float(height) * SCALE)


class Table(namedtuple("Table", "name shown data caption")):
    """A table of the page: `shown`, its cells as text, and `data`, the same in full precision for the CSV file."""

    @cached_property
    def text_columns(self):
        """Those of words, which are set flush left."""
        return [name for name in self.shown if self.shown[name].str.contains(r"^[A-Za-z]").any()]


def table(name, data, shown, caption):
    """Build a table of `data`, which is the CSV file.

    shown: rows, mappings of heading to text; or how each row of `data` is written: by heading a format string with the
    row's columns in braces, or a function of the row, a mapping.
    """
    if isinstance(shown, dict):
        shown = [
            {head: text.format(**row) if isinstance(text, str) else text(row) for head, text in shown.items()}
            for row in data.to_dict("records")
        ]
    return Table(name, pd.DataFrame(shown), data, caption)


def figure(name, drawing, data, caption, wide=False, alt=""):
    """The Figure of what was drawn on a canvas. alt: what it says, the caption's first sentence where none is given."""
    return Figure(name, to_svg(drawing), data, alt or caption.partition(". ")[0], caption, wide)


def style():
    """Context manager: within it matplotlib draws as this report does."""
    return matplotlib.rc_context({**matplotlib.rcParamsDefault, **RCPARAMS})


def canvas(width, height, layout="constrained"):
    """An empty matplotlib figure, inches; it belongs to no window and is freed with its last reference."""
    return Canvas(figsize=(width, height), layout=layout)


def to_svg(drawing):
    """What was drawn on a canvas as SVG bytes, the same bytes every time."""
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    # A hundredth of a point is less than anyone sees, and the file a good part smaller.
    svg = re.sub(rb' d="[^"]*"', lambda path: re.sub(rb"(\.\d\d)\d+", rb"\1", path[0]), buffer.getvalue())
    return re.sub(rb"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)", _with_palette, svg)


def _with_palette(uri):
    """A picture within an SVG with a palette, where that is smaller. uri: the match, its group the PNG as base64."""
    png, buffer = base64.b64decode(uri[1]), io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGBA")
    few = picture.quantize(RASTER_COLORS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    few.save(buffer, "PNG", optimize=True)
    return b"data:image/png;base64," + base64.b64encode(min(buffer.getvalue(), png, key=len))
