"""The report's pictures: each is drawn once, and kept beside the results with a hash of all that it shows."""

from __future__ import annotations

import hashlib
import html
from pathlib import Path
from typing import Any

import matplotlib

from compare.kit.drawing import Drawing, GapError
from compare.kit.pictures import svg
from compare.kit.tasks import sources
from compare.kit.workers import JUDGING, at_most
from model import StorageError
from model.files import write_text


def kept(path: Path, drawing: Drawing, data: Any) -> dict[str, str] | None:
    """Picture and caption in an SVG file, if this program made it from the same data."""
    picture = path.read_text("utf-8") if path.is_file() else ""
    if not picture.endswith(mark := _mark(drawing, data)):
        return None
    before, _, caption_on = picture.removesuffix(mark).partition("<desc>")
    caption, _, after = caption_on.partition("</desc>")
    return {"picture": before + after, "caption": html.unescape(caption)}


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
    return {"picture": picture, "caption": caption}


def _mark(drawing: Drawing, data: Any) -> str:
    made_from = "\n".join([repr(data), drawing.title, matplotlib.__version__, sources("model", "analytic", "compare")])
    return f"<!-- {hashlib.sha256(made_from.encode()).hexdigest()} -->"
