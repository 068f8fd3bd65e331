"""The MJCF scene, filled in from `Parameters` and `ContactModel`."""

from __future__ import annotations

import copy
import functools
from pathlib import Path
from typing import Any

import mujoco

from mjsim.contact_settings import ContactModel, ContactSettings
from model import InputError, Parameters

SCENE = Path(__file__).with_name("scene.xml")
IMPRATIO = 300
"""Of rigid contacts: stiffer friction takes more iterations, softer friction creeps more. (At 1000
forces of balls that roll at both points were too rough for the onset of lifting, and it hung on
round-off.)"""
TOLERANCE = 1e-21
"""Of rigid contacts: the law gives the solver ten times as much."""


def spec(p: Parameters, settings: ContactModel) -> Any:
    """The scene as an `mujoco.MjSpec`."""
    spec = mujoco.MjSpec.from_string(SCENE.read_text("utf-8"))
    option, body, wall, height = spec.option, spec.body("ball"), spec.geom("wall"), 2 * p.r
    option.gravity, option.timestep = (0.0, 0.0, -p.g), settings.timestep
    body.pos, body.mass, body.inertia = (p.R, 0.0, p.r), p.m, (p.j * p.m * p.r**2,) * 3
    spec.joint("azimuth").pos = (p.R, -p.r, 0.0)
    spec.geom("ball").size = (p.r, 0.0, 0.0)
    wall.pos, wall.size = (p.R + p.r, 0.0, height), (height, height, p.r)
    spec.geom("floor").size = (4 * p.R, 4 * p.R, p.r)
    vessel = spec.geom("vessel")
    vessel.pos, vessel.size = (0.0, 0.0, height * 1.005), (p.R + p.r, height, 0.0)
    for name, friction in (("A", p.mu), ("B", p.eta)):
        pair = spec.pair(name)
        # The engine raises friction coefficients to 1e-5; no friction at all takes a contact of one
        # row.
        pair.condim = 3 if friction > 0 else 1
        pair.friction = (friction, friction, 0.0, 0.0, 0.0)
        pair.margin = pair.gap = 0.0
    if isinstance(settings, ContactSettings):
        _set_contacts(spec, settings)
    else:  # the law takes none of these
        option.impratio, option.tolerance = IMPRATIO, TOLERANCE
    return spec


def _set_contacts(spec: Any, settings: ContactSettings) -> None:
    """Give the scene MuJoCo's own contacts."""
    option, (time, ratio) = spec.option, settings.solref
    option.impratio, option.noslip_iterations = settings.impratio, settings.noslip_iterations
    option.cone = getattr(mujoco.mjtCone, f"mjCONE_{settings.cone.upper()}")
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{settings.integrator.upper()}")
    for pair in spec.pairs:
        # As stiffness and damping: of times the engine would cut (d tc)^2 off at 1e-15 s2.
        pair.solref = -1 / (time * ratio) ** 2, -2 / time
        pair.solreffriction = (settings.solreffriction, 1.0)
        pair.solimp = (settings.solimp, settings.solimp, 1e-4, 0.5, 2.0)


def build(p: Parameters, settings: ContactModel) -> tuple[Any, str]:
    """The scene compiled to an `mujoco.MjModel` of its own, and as the MJCF text that is simulated.

    Light and textures are left out: no step looks at them, and textures are 1.7 MB and take most of
    the time to build it.

    Raises `InputError` if MuJoCo refuses the parameters.
    """
    # the fluid is no part of a scene
    model, text = compiled(p.replace(omega_0=0.0), settings)
    return copy.copy(model), text


@functools.lru_cache(maxsize=256)
def compiled(p: Parameters, settings: ContactModel) -> tuple[Any, str]:
    """As `build`, but from a cache: the model is shared. It is one for all omega_0: give none."""
    filled = spec(p, settings)
    try:
        for seen in (*filled.textures, *filled.lights):
            filled.delete(seen)
        for material in filled.materials:
            material.textures = [""] * len(material.textures)
        text = str(filled.to_xml())
        model = filled.compile()
    except ValueError as error:
        raise InputError(
            f"MuJoCo cannot compile the scene: {' '.join(str(error).split())}"
        ) from error
    return model, text
