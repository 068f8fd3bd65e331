"""The drag of the fluid on the ball: -m c(|w|) w, with w its velocity relative to the fluid.

c(|w|) = c C_D(Re) Re/24 with Re = 2 r |w|/nu_f: Stokes' coefficient c (10) times what the drag of
the sphere is greater by. A law is that factor as a function of Re:

* ``stokes``: 1 (the paper's);
* ``schiller-naumann``: 1 + 0.15 Re^0.687, and from where that is less (Re = 989) that of a constant
  C_D = 0.44 (Schiller and Naumann 1935; Clift, Grace and Weber, "Bubbles, Drops, and Particles",
  1978);
* ``quadratic``: C_D Re/24 with a constant C_D."""

STOKES, SCHILLER_NAUMANN, QUADRATIC = LAWS = ("stokes", "schiller-naumann", "quadratic")
REYNOLDS = {STOKES: (0.0, 1.0), SCHILLER_NAUMANN: (0.0, 2e5), QUADRATIC: (1e3, 2e5)}
"""From which to which Reynolds number each law is meant; above 2e5 comes the drag crisis."""
