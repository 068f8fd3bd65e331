"""Figures as SVG that a page can play with: series switched, values under the pointer, zoom.

matplotlib draws the figure, once. What bears a label is written as a series of that name, and axes
say how a place in the picture becomes a value; `templates/figure.js` reads both. Where no script
runs, the picture is there all the same. Plotly or Bokeh would need a second description of each
figure, and 1 to 5 MB a page; Panzoom, the library, has 10 kB. A label that begins with an
underscore names a series that no legend lists, as is matplotlib's rule."""

import functools
import io
import json
import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

import matplotlib
import numpy as np
from matplotlib import textpath
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG, RendererSVG
from matplotlib.container import Container
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.ticker import FixedFormatter

from compare.figures.pages import typeset

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
_FEW = 4
"""Fewer marks that look alike stay as matplotlib writes them."""
_UNNAMED = re.compile(r"_child\d+|_nolegend_|")
_TEX = {r"\omega": "ω", r"\Omega": "Ω", r"\eta": "η", r"\mu": "μ", r"\rho": "ρ", r"\nu": "ν"}
_TEX |= {r"\Delta": "Δ", r"\sqrt{R/g}": "√(R/g)", r"^0": "⁰"}
_textpath: Any = textpath
_textpath.MathTextParser = functools.cache(MathTextParser)
"""One for all figures, which remembers formulas: else labels are parsed anew."""
for _prefix, _uri in (("", _SVG), ("xlink", _XLINK)):
    ElementTree.register_namespace(_prefix, _uri[1:-1])


def svg(figure: Figure) -> str:
    """A figure as SVG; equal figures give equal text."""
    # All axes, and each artist in them that bears a label, with that label in HTML.
    parts: dict[str, tuple[Artist, str]] = {}
    for axes in figure.axes:
        boxes = [each for each in axes.containers if isinstance(each, Container)]
        artists: list[tuple[Any, Any]] = [
            (part, box.get_label()) for box in boxes for part in box.get_children()
        ]
        artists += [(each, each.get_label()) for each in axes.get_children()]
        parts[f"part-{len(parts)}"] = axes, ""
        for artist, label in artists:
            if isinstance(label, str) and not _UNNAMED.fullmatch(label):
                parts[f"part-{len(parts)}"] = artist, str(typeset(plain(label.removeprefix("_"))))
    for gid, (artist, _) in parts.items():
        artist.set_gid(gid)
    out = io.BytesIO()
    renderer: Any = RendererSVG
    for second in (each for axes in figure.axes for each in axes.child_axes):
        second.draw(renderer(1, 1, io.StringIO()))  # it knows its limits only once it was drawn
    # draws once; `Figure.savefig` would do so twice, for the layout
    canvas: Any = FigureCanvasSVG(figure)
    with matplotlib.rc_context({"svg.hashsalt": "dualball"}):  # else ids are random
        canvas.print_svg(out, metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    root = ElementTree.fromstring(re.sub(rb">\s+<", b"><", out.getvalue()))
    for group in root.iter(f"{_SVG}g"):
        if part := parts.get(group.attrib.pop("id", "")):
            artist, name = part
            if isinstance(artist, Axes):
                group.set("data-axes", json.dumps(_scales(figure, artist), ensure_ascii=False))
            else:
                group.set("data-series", name)
        _join_marks(group)
    text = ElementTree.tostring(root, encoding="unicode")
    # Places rounded to hundredths of a point, and no superfluous spaces: half as long.
    short = functools.partial(re.sub, r" +(?=[ \"])|(?<=\.\d\d)\d+", "")
    text = re.sub(r' (?:d|x|y)="[^"]*"|translate\([^)]*\)', lambda places: short(places[0]), text)
    return re.sub(r' style="[^"]*"', lambda found: re.sub("([:;]) ", r"\1", found[0]), text)


def embedded(pictures: Mapping[str, str]) -> tuple[dict[str, str], str]:
    """SVG pictures by name for one page, and an SVG of the letters that they share."""
    letters: dict[str, str] = {}
    made = {}
    for k, (name, picture) in enumerate(pictures.items()):
        letter = r'<path id="(\w+-[\w-]+)"[^>]*/>'
        letters |= {found[1]: found[0] for found in re.finditer(letter, picture)}
        text = re.sub(letter, "", picture).replace("<defs></defs>", "")
        # for all lines of a picture: pages have it, too
        text = re.sub(r"<style.*?</style>", "", text)
        text = text.replace("xlink:href", "href")
        text = re.sub(r'(\bid="|url\(#|href="#)(\w+)\b(?!-)', rf"\1f{k}\2", text)
        start = re.match(r'<svg[^>]*?(viewBox="0 0 ([\d.]+)[^"]*")[^>]*>', text)
        assert start
        # letters of 10 points are at least 6.4 pixels high on a phone
        least = 0.64 * float(start[2])
        head = f'<svg {start[1]} role="img" style="--least:{least:.0f}px">'
        made[name] = head + text[start.end() :]
    shared = f"<defs>{''.join(letters.values())}</defs>"
    return made, f'<svg width="0" height="0" style="position:absolute">{shared}</svg>'


def plain(label: str) -> str:
    """A label of matplotlib without TeX: "$\\omega_c$ (rad/s)" is "ω_c (rad/s)"."""
    for tex, text in _TEX.items():
        label = label.replace(tex, text)
    tilde = r"\\tilde(?:\{(\w)\}| ?(\w))"
    label = re.sub(tilde, lambda found: f"{found[1] or found[2]}\u0303", label)
    return re.sub(r"[${}]|\\", "", label).replace("\n", " ")


def _scales(figure: Figure, axes: Axes) -> dict[str, Any]:
    """The box of axes, and of each axis its label, its kind, and (a, b).

    a + b times the place is the value, or its logarithm."""
    width, height = 72 * figure.get_size_inches()
    box = axes.get_position()
    across, up = (box.x0 * width, box.x1 * width), (height * (1 - box.y0), height * (1 - box.y1))
    places = {"x": across, "y": up}
    scales: dict[str, Any] = {"box": [round(float(v), 2) for v in (*across, *reversed(up))]}
    for name, (first, last) in places.items():
        axis, limits = getattr(axes, f"{name}axis"), getattr(axes, f"get_{name}lim")()
        alike = axes, *getattr(axes, f"get_shared_{name}_axes")().get_siblings(axes)
        label = next(filter(None, (getattr(each, f"get_{name}label")() for each in alike)), name)
        low, high = np.log10(limits) if axis.get_scale() == "log" else limits
        b = (high - low) / (last - first)
        about = {"label": str(typeset(plain(label))), "kind": axis.get_scale()}
        scales[name] = about | {"a": float(f"{low - b * first:.8g}"), "b": float(f"{b:.8g}")}
        if isinstance(formatter := axis.get_major_formatter(), FixedFormatter):
            marks = zip(axis.get_majorticklocs().tolist(), formatter.seq, strict=False)
            scales[name]["names"] = [[at, str(typeset(plain(text)))] for at, text in marks]
    return scales


def _join_marks(group: ElementTree.Element) -> None:
    """Replace marks that look alike by one path, which is a tenth as long."""
    looks = {
        (mark.tag, mark.get(f"{_XLINK}href"), mark.get("style"), *sorted(mark.keys()))
        for mark in group
    }
    if len(group) < _FEW or len(looks) > 1:
        return
    first = group[0]
    if first.tag != f"{_SVG}use" or {"x", "y"} - {*first.keys()}:
        return
    name = f"{first.attrib[f'{_XLINK}href'][1:]}marks"
    as_drawn = {"id": name, "overflow": "visible", "markerUnits": "userSpaceOnUse"}
    shape = ElementTree.Element(f"{_SVG}marker", as_drawn)
    look = {key: first.attrib[key] for key in (f"{_XLINK}href", "style") if key in first.attrib}
    ElementTree.SubElement(shape, f"{_SVG}use", look)
    way = "M " + " ".join(f"{mark.get('x')} {mark.get('y')}" for mark in group)
    ends = dict.fromkeys(("marker-start", "marker-mid", "marker-end"), f"url(#{name})")
    for mark in list(group):
        group.remove(mark)
    group.append(shape)
    path = {"d": way, "fill": "none", "stroke": "none", **ends}
    ElementTree.SubElement(group, f"{_SVG}path", path)
