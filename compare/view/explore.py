"""A page on this machine to play with: what theory says of a set as its sliders move, and the
motion in 3-D.

NiceGUI serves it: one process and no page to build, with three.js and plotly.js in the package, so
that it works without a network. Each tab has a set and a motion of its own, by the event-driven
simulation."""

import base64
import dataclasses
import errno
import json
import os
import signal
import socket
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Exists
from analytic.flowmeter import real_fluid
from analytic.flowmeter.design import THRESHOLDS
from compare.campaign import compiling
from compare.campaign.stops import SIGNALS
from compare.figures.branches import slipping_curve, stable_ends
from compare.figures.pages import typeset
from compare.figures.style import COLOURS
from compare.figures.validity import model_warning, torque_left_out
from compare.method.quantities import QUANTITIES
from compare.subjects.thresholds.figures import TINTS
from compare.view import cases, steady
from compare.view import page as motion
from model import Case, InputError, Parameters, SimulationError, State, Trajectory, drag, storage
from model.parameters import REACH, parse_number

HOST = "127.0.0.1"
LASTS, RATE = 10.0, 60
"""Duration of a motion, s, and its samples a second."""
REST, RECONNECT = 0.3, 3600.0
"""How long nothing is moved before the motion is simulated anew, s, and a tab is kept that doesn't
answer: a browser that is busy for seconds, as with 3-D without a graphics card, would begin with
the first set again."""
OIL = 1e-5
"""Viscosity of the fluid, m2 s-1, for laws of drag that need one where the set has none."""
BUTTONS = "#0b57a4"
"""Colour of buttons and sliders: that of links on the other pages."""
HANDLES = 64
"""Files and connections that the server opens, and two or three tabs at once."""
UNSAID = Parameters.named("reference")
"""The set whose values an address leaves out, whatever the page began with: a link is a setting,
also for somebody else."""
SLIDERS: dict[str, tuple[str, float, float, float]] = {
    "mu": ("friction of the floor μ", 0.0, 1.2, 0.01),
    "eta": ("friction of the wall η", 0.0, 1.2, 0.01),
    "j": ("inertia j", 0.05, 0.66, 0.01),
    "kappa": ("drag κ = c√(R/g)", 0.005, 2.0, 0.005),
    "omega_0": ("fluid ω₀, rad/s", 0.0, 80.0, 0.1),
}
"""Text, range and step of each."""
LIMITS = (
    "The model is the paper's: a rigid ball with Coulomb's friction in a fluid that turns like a "
    "rigid body. Left out are rolling resistance, the fluid's inertia and its torque on the "
    "spinning ball. In water or oil that torque changes the numbers by tens of per cent."
)
"""What a user of the page may not take from it."""
Figure = dict[str, Any]
"""Data and layout of a figure of plotly."""


@dataclass
class Tab:
    """What a tab of the browser shows."""

    p: Parameters
    start: State = field(default_factory=lambda: State(omega_c=0.0))
    run: Trajectory | None = None
    asked: int = 0
    """How often something was asked for."""
    play: Callable[[], None] = lambda: None
    """Shows the run."""


def with_value(p: Parameters, name: str, value: float | str) -> Parameters:
    """The set with another value of a slider or another law of drag; raises `InputError` for one
    out of its range."""
    if name == "kappa":
        return p.replace(c=float(value) * np.sqrt(p.g / p.R))
    more = {"nu_f": OIL} if name == "drag" and value != drag.STOKES and p.nu_f == 0 else {}
    return p.replace(**{name: value}, **more)


def address(tab: Tab) -> str:
    """What the address of the page says: all that is not as in `UNSAID`, the flow, and the
    start."""
    said = {
        name: f"{value:.12g}" if isinstance(value, float) else value
        for name, value in dataclasses.asdict(tab.p).items()
        if value != getattr(UNSAID, name) or name == "omega_0"
    }
    if tab.start.omega_c:
        said["start"] = f"{float(tab.start.omega_c):.6g}"
    return f"/?{urlencode(said)}"


def set_from(tab: Tab, said: Mapping[str, str]) -> None:
    """Set a tab as an address says; raises `InputError` for what can't be."""
    values: dict[str, Any] = {
        q.name: parse_number(q.name, said[q.name], q.metadata["unit"], REACH)
        for q in Parameters.quantities()
        if q.name in said
    }
    values |= {"drag": said["drag"]} if "drag" in said else {}
    if values:
        tab.p = UNSAID.replace(**values)
    if "start" in said:
        tab.start = State(omega_c=parse_number("start", said["start"], "rad s-1", REACH))


def characteristic(p: Parameters, start: float, fastest: float) -> Figure:
    """A figure of omega_c of stationary solutions over omega_0, the thresholds, and where the ball
    starts."""
    t, folds, (rolls, rides) = bifurcation.thresholds(p), p.eta < p.j, stable_ends(p)
    lines: list[tuple[str, Case, Any, Any, str]] = []
    if np.isfinite(rolls):
        lines.append(("RR", Case.RR, [0, min(rolls, fastest)], [0, min(rolls, fastest)], "solid"))
    if folds and p.mu > 0 and p.c > 0 and np.isfinite(t.omega_02):
        x, flows, grows = slipping_curve(p, 401)
        for text, part, dash in (("SS", ~grows, "solid"), ("SS, unstable", grows, "dash")):
            lines.append((text, Case.SS, flows, np.where(part, x.omega_c, np.nan), dash))
    if np.isfinite(rides) and rides < fastest:
        # on one line their colours take turns
        for case, dash in ((Case.SR, "solid"), (Case.NR, "12px,12px")):
            lines.append((case.name, case, [rides, fastest], [rides, fastest], dash))
    curves = [
        {"type": "scatter", "mode": "lines", "name": text, "x": np.asarray(x).tolist(),
         "y": [None if np.isnan(v) else v for v in np.asarray(y, float).tolist()],
         "line": {"color": COLOURS[case], "dash": dash, "width": 3}}
        for text, case, x, y, dash in lines
    ]  # fmt: skip
    known = [name for name in THRESHOLDS if not (folds and name == "omega_03")]
    shown = [(QUANTITIES[name].symbol, getattr(t, name)) for name in known]
    shown = [(symbol, at) for symbol, at in shown if at < fastest]
    guide = {"type": "line", "yref": "paper", "y0": 0, "y1": 1}
    guide["line"] = {"color": "#999", "dash": "dot"}
    label = {"yref": "paper", "y": 0.98, "xanchor": "left", "showarrow": False}
    label["font"] = {"size": 11}
    guides = {
        "shapes": [guide | {"x0": at, "x1": at} for _, at in shown],
        "annotations": [label | {"x": at, "text": symbol} for symbol, at in shown],
    }
    cells = np.linspace(0.0, fastest, 81).tolist()
    clicked = {
        "type": "heatmap", "x": cells, "y": cells, "z": _as_bytes(np.zeros((81, 81))),
        "opacity": 0.0, "showscale": False, "hoverinfo": "none",
    }  # fmt: skip
    data = [clicked, *curves, _cross(p.omega_0, start)]
    return _figure(data, "ω₀ (rad/s)", "ω_c (rad/s)", fastest, fastest, **guides)


def regions(p: Parameters, fastest: float) -> Figure:
    """A figure of which stationary solutions exist over the wall's friction and the flow, and where
    the set is."""
    eta, flows = np.linspace(0.0, SLIDERS["eta"][2], 121), np.linspace(0.0, fastest, 161)
    found = bifurcation.case_map(p, p.mu, eta, flows).T
    kinds, index = np.unique(found, return_inverse=True)
    cells = index.reshape(found.shape)
    names = [
        " ".join(dict.fromkeys(f.name.split("_")[0] for f in Exists if f & int(kind) and f.name))
        for kind in kinds
    ]
    shades = [TINTS.get(Exists(int(kind)), "#eeeeee") for kind in kinds]
    colours = [[(k + end) / len(kinds), shade] for k, shade in enumerate(shades) for end in (0, 1)]
    names_at = []
    for k, name in enumerate(names):  # where its region is widest, unless that is narrow
        depth = distance_transform_edt(np.pad(cells[::2, ::2] == k, 1))
        y, x = 2 * (np.array(np.unravel_index(depth.argmax(), depth.shape)) - 1)
        if depth.max() > 3:
            names_at.append({"x": eta[x], "y": flows[y], "text": name, "showarrow": False})
    heat = {
        "type": "heatmap", "x": eta.tolist(), "y": flows.tolist(), "z": _as_bytes(cells),
        "colorscale": colours, "zmin": -0.5, "zmax": len(kinds) - 0.5, "showscale": False,
        "hovertemplate": "η %{x:.2f}, ω₀ %{y:.1f} rad/s<extra></extra>",
    }  # fmt: skip
    data, across = [heat, _cross(p.eta, p.omega_0)], "friction of the wall η"
    return _figure(data, across, "ω₀ (rad/s)", eta[-1], fastest, annotations=names_at)


def _as_bytes(cells: npt.NDArray[Any]) -> dict[str, str]:
    """Small whole numbers as bytes, in the form that plotly reads: much faster on a page than a
    list of numbers."""
    cells = cells.astype(np.uint8)
    return {
        "bdata": base64.b64encode(cells.tobytes()).decode(),
        "dtype": "u1",
        "shape": "{}, {}".format(*cells.shape),
    }


def _cross(x: float, y: float) -> Figure:
    return {
        "type": "scatter", "mode": "markers", "name": "here", "x": [x], "y": [y],
        "marker": {"symbol": "cross", "size": 12, "color": "black"},
        "showlegend": False, "cliponaxis": False,
    }  # fmt: skip


def _figure(data: list[Figure], x: str, y: str, right: float, top: float, **more: Any) -> Figure:
    """A figure of plotly whose axes, with these labels, begin at 0 and end at `right` and `top`."""
    across, up = ({"title": {"text": str(typeset(label))}} for label in (x, y))
    layout = {
        "xaxis": across | {"range": [0, right]}, "yaxis": up | {"range": [0, top]},
        "margin": {"l": 50, "r": 10, "t": 30, "b": 40}, "hovermode": "closest",
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"}, "uirevision": "kept",
    }  # fmt: skip
    return {"data": data, "layout": layout | more, "config": {"displayModeBar": False}}


def simulated(p: Parameters, start: State) -> Trajectory:
    """The motion of theory from a start; as far as it came if it broke down."""
    try:
        return analytic.simulate(p, start.stacked(), LASTS, sample_interval=1 / RATE)
    except SimulationError as error:
        run: Trajectory = error.trajectory
        return run


def in_words(p: Parameters) -> str:
    """Whether the model holds, thresholds of a set, and the motions to which its ball settles, in a
    line."""
    t = bifurcation.thresholds(p)
    known = [(name, getattr(t, name)) for name in THRESHOLDS]
    parts = [f"{QUANTITIES[name].symbol} = {at:.4g}" for name, at in known if np.isfinite(at)]
    stable = " or ".join(
        f"{each.case.name} at ω_c = {float(each.state.omega_c):.4g}"
        for each in analytic.stable_solutions(p)
    )
    doubts = "".join(f"{doubt} " for doubt in model_warning(real_fluid.model_error(p)))
    said = f"{doubts}{', '.join(parts)} rad/s. Settles to: {stable or 'nothing stationary'}"
    return f"{said}. {torque_left_out(p)}" if p.nu_f and p.omega_0 and p.c else said


def serve(p: Parameters, port: int, show: bool) -> None:
    """Serve the page on the loopback address alone until the process is interrupted; a tab has the
    set `p` at first.

    Raises `InputError` if NiceGUI, an extra, isn't installed, the port is in use, or too few files
    may be open."""
    try:
        from nicegui import app, ui
        from starlette.middleware.trustedhost import TrustedHostMiddleware
        from starlette.responses import HTMLResponse
        from uvicorn import server

        from compare.view import guard
    except ImportError as error:
        raise InputError("explore needs NiceGUI: pip install 'nicegui>=3.18'") from error
    with socket.socket() as tried:
        # As the server does: of one that ended nothing is left.
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((HOST, port))
        except OSError as error:
            used = error.errno == errno.EADDRINUSE
            why = "is in use" if used else f"can't be had: {error.strerror}"
            raise InputError(f"port {port} {why}; choose another one by --port") from error
    with ExitStack() as open_ones:  # the server would end in a traceback
        try:
            for _ in range(HANDLES):
                open_ones.enter_context(Path(os.devnull).open("rb"))
        except OSError as error:
            why = f"explore opens {HANDLES} more files and connections: {error.strerror}"
            raise InputError(f"{why}; 'ulimit -n' says how many may be open") from error
    scene = motion.write(p, 1.0)
    app.add_route("/motion", lambda _: HTMLResponse(scene))
    app.add_middleware(guard.OwnOrigin)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])
    print(f"http://{HOST}:{port} (Ctrl-C ends it)", flush=True)
    server.HANDLED_SIGNALS = tuple(
        each for each in SIGNALS if signal.getsignal(each) is not signal.SIG_IGN
    )
    quiet: dict[str, Any] = {"reload": False, "show_welcome_message": False}
    quiet |= {"reconnect_timeout": RECONNECT, "http": guard.Prompt}
    ui.run(partial(page, p), host=HOST, port=port, title="dualball", show=show, **quiet)


def page(p: Parameters) -> None:
    """Build the page in a tab of the browser, as its address says."""
    from nicegui import ui

    tab, draw = Tab(p), list[Callable[[], None]]()
    request = ui.context.client.request
    try:
        set_from(tab, request.query_params if request else {})
    except InputError as error:
        tab = Tab(p)
        ui.notify(f"The address can't be followed: {error}", type="negative")
    ui.colors(primary=BUTTONS)
    _heading(ui)
    wide = "flex: 1 1 26rem; min-width: 0"
    with ui.row().classes("w-full"):
        with ui.column().classes("w-80 max-w-full"):
            follow = _controls(ui, tab, draw)
        with ui.column().style(wide):
            _theory(ui, tab, draw, follow)
        with ui.column().style(wide):
            tab.play = _motion(ui, tab)
    _cases(ui)
    here = ui.context.client

    def keep_address() -> None:
        here.run_javascript(f"history.replaceState(null, '', {json.dumps(address(tab))})")

    draw.append(keep_address)
    follow()


def _heading(ui: Any) -> None:
    ui.html("<h1>A ball that a fluid takes round in a vessel</h1>", sanitize=False).classes("title")
    about = (
        "It touches the floor and the wall. A case has a letter for each: R rolls, S slips, N does "
        "not touch. Move a slider, and see which steady motions theory has, and the motion, "
        "simulated anew. The address holds what you set: to share it, copy the link."
    )
    ui.html(f"<p>{about}</p><p>{LIMITS}</p>", sanitize=False).classes("text-sm about")
    ui.add_css(".title h1 { font-size: 1.5rem; line-height: 1.3; margin: 0 }")


def _cases(ui: Any) -> None:
    with (
        ui.expansion("The nine cases: floor below, wall right", value=True).classes("w-full cases"),
        ui.row(),
    ):
        for case in Case:
            text = f"{cases.picture(case)}<div><b>{case.name}</b> {cases.in_words(case)}</div>"
            ui.html(text, sanitize=False).classes("text-sm").style(
                "display: flex; gap: .5rem; width: 13rem; align-items: center"
            )


def _controls(ui: Any, tab: Tab, draw: list[Callable[[], None]]) -> Callable[[], None]:
    """Build sliders, choice of drag law and buttons; return a function that draws all and, a bit
    later, simulates."""
    from nicegui import run

    async def simulate() -> Trajectory | None:
        try:
            return await run.io_bound(simulated, tab.p, tab.start)
        except InputError as error:
            ui.notify(str(error), type="negative")
            return None

    async def again(mine: int) -> None:
        # nothing else was asked meanwhile
        if mine == tab.asked and (found := await simulate()) and mine == tab.asked:
            tab.run = found
            tab.play()

    def change(name: str, event: Any) -> None:
        if event.value is None or (name in SLIDERS and float(event.value) == value(name)):
            return
        try:
            tab.p = with_value(tab.p, name, event.value)
        except InputError as error:
            ui.notify(str(error), type="negative")
            return
        follow()

    def follow() -> None:
        tab.asked += 1
        mine = tab.asked  # of all that a slider sent meanwhile the last counts
        ui.timer(0.0, lambda: [each() for each in draw if mine == tab.asked], once=True)
        ui.timer(REST, partial(again, mine), once=True)

    async def download_run() -> None:
        """Also if it isn't simulated yet, or the set was changed since."""
        if found := await simulate():
            _download(ui, partial(storage.save, found), "run.h5")

    def value(name: str) -> float:
        return float(getattr(tab.p, name))

    def show() -> None:
        line.set_content(typeset(in_words(tab.p)))
        for name, slider in sliders.items():
            slider.set_value(value(name))

    sliders = {}
    for name, (text, low, high, step) in SLIDERS.items():
        ui.html(typeset(text), sanitize=False)
        with ui.row().classes("w-full no-wrap items-center"):
            sliders[name] = slider = ui.slider(min=low, max=high, step=step, value=value(name))
            slider.props(f'aria-label="{name}"').on_value_change(partial(change, name))
            number = ui.number(value=round(value(name), 4), step=step, format="%.4g").classes(
                "w-24"
            )
            # not at each digit; what is refused goes
            number.bind_value(slider).props("debounce=500").on("blur", show)
    laws = ui.select(list(drag.LAWS), value=tab.p.drag, label="law of drag").classes("w-40")
    laws.on_value_change(partial(change, "drag"))
    line = ui.html("", sanitize=False).classes("text-sm said")
    draw.append(show)
    with ui.row():
        ui.button("Set as TOML", on_click=lambda: _download(ui, tab.p.save, "set.toml"))
        ui.button("Run as HDF5", on_click=download_run)
    return follow


def _download(ui: Any, save: Callable[[Path], object], name: str) -> None:
    """Hand the browser what a function writes into a file of a name."""
    with tempfile.TemporaryDirectory() as directory:
        save(Path(directory) / name)
        ui.download.content((Path(directory) / name).read_bytes(), name)


def _theory(ui: Any, tab: Tab, draw: list[Callable[[], None]], follow: Callable[[], None]) -> None:
    """Build the characteristic curve and the map of cases; a click chooses where the ball starts,
    or the set."""
    fastest = SLIDERS["omega_0"][2]
    figures = {
        "curve": lambda: characteristic(tab.p, float(tab.start.omega_c), fastest),
        "map": lambda: regions(tab.p, fastest),
    }
    plots = {}
    for name in figures:
        plots[name] = plot = ui.plotly(_figure([], "", "", 1, 1)).classes(f"w-full h-80 {name}")

        def clicked(event: Any, name: str = name) -> None:
            x, y = (float(event.args["points"][0][axis]) for axis in "xy")
            if name == "curve":
                tab.start, tab.p = State(omega_c=y), tab.p.replace(omega_0=x)
            else:
                tab.p = tab.p.replace(eta=x, omega_0=y)
            follow()

        plot.on("plotly_click", clicked)

    def redraw() -> None:
        for name, plot in plots.items():
            plot.update_figure(figures[name]())

    draw.append(redraw)
    hint = (
        "A click on the curve starts the ball at that ω_c in that flow; one on the map chooses η "
        "and ω₀."
    )
    ui.html(typeset(hint), sanitize=False)


def _motion(ui: Any, tab: Tab) -> Callable[[], None]:
    """Build the part with the motion in 3-D; return a function that hands it the run of the tab."""
    line = ui.html("", sanitize=False).classes("text-sm steady")
    within = ui.element("iframe").props('src="/motion" title="motion"').classes("w-full motion")
    within.style("height: 48rem; border: 0")

    def play() -> None:
        if tab.run and len(tab.run.time):
            told = f"After {tab.run.time[-1]:.3g} s: {steady.of_run(tab.run)}"
            line.set_content(typeset(told.replace("omega_c", "ω_c")))
            frames = json.dumps(motion.frames(tab.run, tab.run.time))
            within.client.run_javascript(
                f"getHtmlElement({within.id}).contentWindow.postMessage({frames}, origin)"
            )

    def say_why_nothing_moves() -> None:
        if tab.run:
            waits.cancel()
        elif said := compiling.now():
            line.set_content(f"The motion waits: {said}.")

    waits = ui.timer(compiling.OFTEN, say_why_nothing_moves)
    within.on("load", play)
    return play
