"""Newton: several solvers on one scene."""

from __future__ import annotations

from typing import Any

import newton as engine
import numpy as np
import warp

from compare.bench.adapters.free import Free, State, upright
from compare.bench.case import Vector
from model.arrays import Array

warp.config.quiet = True
engine_solvers = engine.solvers


class Newton(Free):
    KNOWN = "newton 1.8.0"
    PRECISION = "f32"

    def __init__(self, solver: str, combine: str, best: str = "", options: Any = None) -> None:
        super().__init__(f"newton-{solver.lower()}" + ("" if best else "-defaults"), best)
        self.solver_name, self.combine, self.options = f"Solver{solver}", combine, options or {}

    def make(self) -> None:
        case, body = self.case, self.case.body
        builder = engine.ModelBuilder(gravity=(0.0, 0.0, -case.g))
        if hasattr(getattr(engine.solvers, self.solver_name), "register_custom_attributes"):
            getattr(engine.solvers, self.solver_name).register_custom_attributes(builder)
        def material(friction: float) -> Any:
            return engine.ModelBuilder.ShapeConfig(density=0.0, mu=friction, mu_torsional=0.0, mu_rolling=0.0, **self.material)
        own, of = {"mean": (0.0, lambda f: 2 * f), "max": (0.0, lambda f: f), "root": (1.0, lambda f: f * f)}[self.combine]
        for surface, point, normal in self.planes():
            if surface.turning:
                raise NotImplementedError("its planes don't turn")
            w, x, y, z = upright(normal)
            self.wall = builder.add_shape_plane(None, xform=warp.transform(point, (x, y, z, w)), width=0.0, length=0.0, cfg=material(of(surface.friction)))
        w, x, y, z = body.orientation
        self.body = builder.add_body(xform=warp.transform(body.position, (x, y, z, w)), mass=body.mass, inertia=np.diag(body.inertia), lock_inertia=True)
        if body.shape == "sphere":
            builder.add_shape_sphere(self.body, radius=body.size[0], cfg=material(own))
        else:
            builder.add_shape_box(self.body, **dict(zip(("hx", "hy", "hz"), body.size)), cfg=material(own))
        builder.joint_qd[-6:] = builder.body_qd[-1] = [*body.velocity, *body.spin]
        if self.solver_name == "SolverVBD": builder.color()
        self.model = builder.finalize(device="cpu")
        self.solver = getattr(engine.solvers, self.solver_name)(self.model, **(self.options() if callable(self.options) else self.options))
        self.now_, self.next_, self.control = self.model.state(), self.model.state(), self.model.control()
        self.now_.body_qd.assign(np.array([[*body.velocity, *body.spin]], np.float32))
        self.contacts = self.model.contacts()
    material: dict = {}

    def advance(self) -> None:
        self.model.collide(self.now_, self.contacts)
        self.solver.step(self.now_, self.next_, self.control, self.contacts, self.timestep)
        self.now_, self.next_ = self.next_, self.now_
        self.now_.clear_forces()

    def state(self) -> State:
        at, rate = self.now_.body_q.numpy()[0], self.now_.body_qd.numpy()[0]
        return at[:3].astype(float), rate[:3].astype(float), rate[3:].astype(float)

    def push(self, force: Vector) -> None:
        self.now_.body_f.numpy()[0, :3] = force

    def turn(self, point: Array, normal: Array) -> None:
        w, x, y, z = upright(normal)
        self.model.shape_transform.numpy()[self.wall] = [*point, x, y, z, w]


xpbd = Newton("XPBD", "mean")
semi = Newton("SemiImplicit", "mean")
feather = Newton("Featherstone", "mean")
mujoco = Newton("MuJoCo", "max")
kamino = Newton("Kamino", "mean")
vbd = Newton("VBD", "root")
