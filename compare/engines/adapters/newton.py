"""Newton, four of its solvers, on a processor in single precision.

Traps: quaternions end with the scalar; shapes have torsional and rolling friction unless that is
set to zero; friction is the mean of both coefficients, in VBD the root of their product; room for a
thousand contacts, which is what there is unless a model says otherwise, makes a step of Kamino
twelve times as long. The solver MuJoCo wants a MuJoCo older than 4: it is in
`mujoco_warp` by itself. Kernels are compiled when they are first needed, which takes minutes."""

from __future__ import annotations

import logging
from typing import Any

import newton as engine
import numpy as np
import warp

from compare.engines.adapters.free import BodyState, Free
from compare.engines.adapters.scene import Vector, upright
from model.arrays import Array

warp.config.quiet = True
logging.getLogger("newton").setLevel(logging.ERROR)


class Newton(Free):
    """A free body in Newton, with one of its solvers and options."""

    PRECISION = "f32"

    def __init__(
        self, solver: str, note: str, best: str = "", shortest: float = 1e-3, **options: Any
    ) -> None:
        """Of two steps the shorter one is given, s: 1 ms would take minutes a case."""
        super().__init__(f"newton-{solver.lower()}{'' if best else '-defaults'}", note, best)
        self.solver, self.options = getattr(engine.solvers, f"Solver{solver}"), options
        self.TIMESTEPS = (4e-3, shortest)

    def make(self) -> None:
        body, builder = self.scene.body, engine.ModelBuilder(gravity=(0.0, 0.0, -self.scene.g))
        rooted = self.solver is engine.solvers.SolverVBD

        def rough(mu: float) -> Any:
            return builder.ShapeConfig(density=0.0, mu=mu, mu_torsional=0.0, mu_rolling=0.0)

        if hasattr(self.solver, "register_custom_attributes"):
            self.solver.register_custom_attributes(builder)
        for surface, _, point, normal in self.planes():
            material = rough(surface.friction**2 if rooted else 2 * surface.friction)
            own, at = -1, pose(point, normal)
            if self.goes_along(surface):
                self.wall = own = builder.add_body(xform=at, mass=1.0, is_kinematic=True)
                at = warp.transform()
            builder.add_shape_plane(None, body=own, xform=at, width=0.0, length=0.0, cfg=material)
        w, *axis = body.orientation
        start, inertia = warp.transform(body.position, (*axis, w)), np.diag(body.inertia)
        self.number = number = builder.add_body(
            xform=start, mass=body.mass, inertia=inertia, lock_inertia=True
        )
        if body.shape == "sphere":
            builder.add_shape_sphere(number, radius=body.size[0], cfg=rough(float(rooted)))
        else:
            edges = dict(zip(("hx", "hy", "hz"), body.size, strict=True))
            builder.add_shape_box(number, **edges, cfg=rough(float(rooted)))
        builder.joint_qd[-6:] = builder.body_qd[number] = [*body.velocity, *body.spin]
        if rooted:
            builder.color()
        self.model = builder.finalize(device="cpu")
        self.meets = engine.CollisionPipeline(self.model, rigid_contact_max=128)
        self.contacts, self.solves = self.meets.contacts(), self.solver(self.model, **self.options)
        self.old, self.new = self.model.state(), self.model.state()

    def advance(self) -> None:
        self.meets.collide(self.old, self.contacts)
        self.solves.step(self.old, self.new, None, self.contacts, self.timestep)
        self.old, self.new = self.new, self.old
        self.old.clear_forces()

    def read(self) -> BodyState:
        place = self.old.body_q.numpy()[self.number].astype(float)
        rate = self.old.body_qd.numpy()[self.number].astype(float)
        return place[:3], rate[:3], rate[3:]

    def push(self, force: Vector) -> None:
        # on a processor this is the engine's own memory
        self.old.body_f.numpy()[self.number, :3] = force

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        self.old.body_q.numpy()[self.wall] = pose(point, normal)
        self.old.body_qd.numpy()[self.wall] = [*velocity, 0.0, 0.0, 0.0]


def pose(point: Array, normal: Array) -> Any:
    """The pose of a plane, which has z as its normal."""
    w, x, y, z = upright(normal)
    return warp.transform(point, (x, y, z, w))


_CREEPS = (
    "worst with what must not move: each of a few iterations takes a share of the slip out of "
    "positions, so that bodies creep; more iterations lessen that"
)
xpbd_defaults = Newton("XPBD", _CREEPS)
xpbd = Newton("XPBD", _CREEPS, "10 iterations", iterations=10)
semiimplicit_defaults = Newton(
    "SemiImplicit",
    "worst at long steps and with light bodies: its springs and friction of 1000 N s/m are "
    "explicit, and explode at 4 ms, or with the ball in the vessel",
)
vbd_defaults = Newton(
    "VBD",
    "worst with what must not move: below 1 cm/s its friction is smoothed, and neither step nor "
    "iterations lessen that",
    shortest=2e-3,
    rigid_body_contact_buffer_size=128,
)
kamino = Newton(
    "Kamino",
    "resting, sliding and rolling to first order, by ADMM with Coulomb's cone; worst where it "
    "lands",
    "the engine's own settings",
    shortest=2e-3,
)
