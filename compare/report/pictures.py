"""The report's pictures: each is drawn once, and kept beside the results with a hash of all that it shows."""

from __future__ import annotations

import hashlib
import html
import io
import re
import urllib.parse
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from compare.kit.drawing import Drawing, GapError
from compare.kit.tasks import sources
from compare.kit.workers import JUDGING, at_most
from model import StorageError
from model.files import write_text

_UNESCAPED = " !$'()*+,-./:;<=>?@_~"
"""What needs no escape in an address between double quotes."""


def kept(path: Path, drawing: Drawing, data: Any) -> dict[str, str] | None:
    """Address and caption of the picture in an SVG file, if this program made it from the same data."""
    picture = path.read_text("utf-8") if path.is_file() else ""
    if not picture.endswith(_mark(drawing, data)):
        return None
    before, _, caption_on = picture.partition("<desc>")
    caption, _, after = caption_on.partition("</desc>")
    return {"picture": address(before + after), "caption": html.unescape(caption)}


def drawn(new: tuple[Path, Drawing, Any]) -> dict[str, str]:
    """The same of a picture that is drawn and written into the file, where it describes itself by the caption.

    Where it can't be drawn or written, the reason as a "gap".
    """
    path, drawing, data = new
    try:
        with at_most(JUDGING):
            figure, caption = drawing.draw(data)
        picture = svg(figure)
        described = picture.replace("<defs>", f"<desc>{html.escape(caption)}</desc><defs>", 1)
        write_text(path, described + _mark(drawing, data))
    except (GapError, StorageError, TimeoutError) as error:
        return {"gap": str(error)}
    return {"picture": address(picture + _mark(drawing, data)), "caption": caption}


def _mark(drawing: Drawing, data: Any) -> str:
    made_from = "\n".join([repr(data), drawing.title, matplotlib.__version__, sources("model", "analytic", "compare")])
    return f"<!-- {hashlib.sha256(made_from.encode()).hexdigest()} -->"


def address(picture: str) -> str:
    """An SVG picture as an address, to stand between double quotes as it is; in words it is shorter than in base64."""
    single = picture.replace("'", "&apos;").replace('"', "'")
    return f"data:image/svg+xml,{urllib.parse.quote(single, safe=_UNESCAPED)}"


def svg(figure: Figure) -> str:
    """A figure as SVG."""
    out = io.BytesIO()
    if any(axes.child_axes for axes in figure.axes):  # second scales know their limits only once they were drawn
        figure.draw_without_rendering()
    canvas: Any = FigureCanvasSVG(figure)  # draws once; `Figure.savefig` would do so twice, for the layout
    canvas.print_svg(out, metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    text = re.sub(r"\s+", " ", re.sub(r"<!--.*?-->", "", out.getvalue().decode(), flags=re.DOTALL))
    # Hundredths of a point are fine enough, and half as long.
    return re.sub(r' (?:d|x|y)="[^"]*"', lambda place: re.sub(r"(\.\d\d)\d+", r"\1", place[0]), text)
