"""The nine kinematic cases by picture and in words, along the orbit: floor below, wall right."""

from compare.figures.style import COLOURS, SLIP
from model import Case, Contact

_DOES = {Contact.R: "rolls on", Contact.S: "slips on", Contact.N: "is off"}
_RADIUS, _FLOOR, _WALL, _GAP = 14, 44, 56, 8


def in_words(case: Case) -> str:
    """What the ball does in a case: "rolls on the floor, slips on the wall"."""
    return f"{_DOES[case.A]} the floor, {_DOES[case.B]} the wall"


def picture(case: Case) -> str:
    """A case as SVG: a dot where the ball rolls, an arrow where it slips, else a gap."""
    x = _WALL - _RADIUS - _GAP * (case.B is Contact.N)
    y = _FLOOR - _RADIUS - _GAP * (case.A is Contact.N)
    marks = ""
    for contact, at, along in ((case.A, (x, _FLOOR), (-1, 0)), (case.B, (_WALL, y), (0, -1))):
        if contact is Contact.R:
            marks += f'<circle cx="{at[0]}" cy="{at[1]}" r="3.5"/>'
        elif contact is Contact.S:
            tip = f"{at[0] + 16 * along[0]},{at[1] + 16 * along[1]}"
            base = [at[k] + 9 * along[k] for k in (0, 1)]
            left, right = (
                f"{base[0] + side * along[1] * 5},{base[1] + side * along[0] * 5}"
                for side in (-1, 1)
            )
            marks += (
                f'<path d="M{at[0]},{at[1]}L{base[0]},{base[1]}" stroke="{SLIP}" stroke-width="3"/>'
                f'<path d="M{tip}L{left}L{right}Z" fill="{SLIP}"/>'
            )
    return (
        f'<svg viewBox="0 0 62 50" width="62" height="50" role="img" aria-label="{case.name}: '
        f'{in_words(case)}"><path d="M2,{_FLOOR}H{_WALL}V2" fill="none" stroke="#666" '
        f'stroke-width="2"/><circle cx="{x}" cy="{y}" r="{_RADIUS}" fill="{COLOURS[case]}" '
        f'fill-opacity=".45" stroke="{COLOURS[case]}" stroke-width="2"/>{marks}</svg>'
    )
