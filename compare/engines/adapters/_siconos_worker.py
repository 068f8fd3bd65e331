"""The ball in Siconos: a program for the Python that has it, which takes steps on demand.

It reads and writes lines of JSON. First comes the problem; then nine numbers (position, velocity
and spin) to start from, three (a force) for a step, answered by those three vectors, or none,
answered by [contact, force, gap] of each contact point that carries something. All is in world
axes. What fails is answered by {"error": ...}. `siconos.py` beside it is at the other end.

The Python that runs it isn't that of the project: nothing but Siconos, numpy and the standard
library is imported."""

from __future__ import annotations

import json
import math
import os
import sys
from typing import Any

import numpy as np
import siconos.kernel as kernel
import siconos.numerics as numerics


def main() -> None:
    """Read problems, starts and forces, and answer them, until there is nothing more to read."""
    answers, nowhere = os.fdopen(os.dup(1), "w"), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # Siconos prints warnings to standard output
    os.dup2(nowhere, 2)
    scene: Any = None
    for line in sys.stdin:
        given, answer = json.loads(line), None
        try:
            if isinstance(given, dict):
                scene = Scene(given)
            elif len(given) == 9:
                scene.start(given[:3], given[3:6], given[6:])
            else:
                answer = scene.advance(given) if given else scene.touches()
        except Exception as error:  # the other side has to say it, whatever it is
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


class Scene:
    """A ball in axes that turn with it, outward, along, up: floor and wall are planes."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.R, self.r, self.mass = given, given["R"], given["r"], given["m"]
        self.inertia = given["inertia"]
        self.weight = self.mass * given["g"]

    def start(self, position: list[float], velocity: list[float], spin: list[float]) -> None:
        """Begin at a position with a velocity and a spin, in world axes."""
        x, y, z = position
        self.azimuth, h, r = math.atan2(y, x), self.R - math.hypot(x, y), self.r
        self.axes = turned(self.azimuth)
        rates = [*self.axes @ velocity, *self.axes @ spin]
        ball = TurningBall([-h, 0, z - r, 0, 0, 0], rates, self.mass, self.inertia, self.R)
        floor = [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, -r, 0], [0, 1, 0, r, 0, 0]]
        wall = [[-1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, r], [0, 0, 1, 0, -r, 0]]
        given = self.given
        self.ball, system = ball, kernel.NonSmoothDynamicalSystem(0.0, float("inf"))
        system.insertDynamicalSystem(ball)
        self.contacts = []
        for friction, rows in ((given["mu"], floor), (given["eta"], wall)):
            if friction is None:  # there is no floor
                continue
            law = kernel.NewtonImpactFrictionNSL(0.0, 0.0, friction, 3)
            relation = kernel.LagrangianLinearTIR(np.array(rows, float))
            self.contacts.append(kernel.Interaction(law, relation))
            system.link(self.contacts[-1], ball)
        solver = kernel.FrictionContact(3)
        options = solver.numericsSolverOptions()
        options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = 1000
        options.dparam[numerics.SICONOS_DPARAM_TOL] = given["tolerance"]
        clock = kernel.TimeDiscretisation(0.0, given["timestep"])
        stepping = kernel.MoreauJeanDirectProjectionOSI(given["theta"])
        gaps = kernel.MLCPProjectOnConstraints(numerics.SICONOS_MLCP_ENUM, 1.0)
        self.simulation = kernel.TimeSteppingDirectProjection(system, clock, stepping, solver, gaps)
        self.simulation.setConstraintTolUnilateral(given["projection"])
        stepping.setConstraintActivationThreshold(given["activation"])
        self.simulation.setNewtonTolerance(given["newton"])
        self.simulation.initialize()

    def advance(self, force: list[float]) -> Any:
        """Take a step under a force in world axes; position, velocity and spin after it."""
        self.axes, q = turned(self.azimuth), self.ball.q()
        before, way = self.R + q[0], q[1]
        outward, along, upward = self.axes @ force
        self.ball.setFExtPtr(np.array([outward, along, upward - self.weight, 0.0, 0.0, 0.0]))
        self.ball.computeForces(0.0, self.ball.q(), self.ball.velocity())
        # a theta method takes a part of the force that is kept from before the step
        self.ball.swapInMemory()
        self.simulation.computeOneStep()
        self.simulation.nextStep()
        q, rates = self.ball.q(), self.ball.velocity()
        rho = self.R + q[0]
        self.azimuth += 2 * (q[1] - way) / (before + rho)
        axes = turned(self.azimuth)
        position = rho * math.cos(self.azimuth), rho * math.sin(self.azimuth), self.r + q[2]
        return position, (rates[:3] @ axes).tolist(), (rates[3:] @ axes).tolist()

    def touches(self) -> list[Any]:
        """Number, force on the ball and gap of each contact that bore something last."""
        shown = []
        for number, contact in enumerate(self.contacts):
            impulse = contact.lambda_(1)
            if impulse[0] > 0:
                force = contact.relation().C()[:, :3].T @ impulse / self.given["timestep"]
                shown.append((number, (force @ self.axes).tolist(), contact.y(0)[0]))
        return shown


class TurningBall(kernel.LagrangianDS):  # type: ignore[misc]
    """A free ball in axes that turn with it: M dv/dt + M Omega x v = F for velocity and spin.

    Coordinates are -h, the way along the wall, y, and three that nothing depends on; axes outward,
    along and up. Omega = (0, 0, v_along/(R - h))."""

    def __init__(self, q: Any, v: Any, mass: float, inertia: float, R: float) -> None:
        self.R, self.across = R, np.zeros((6, 6))
        self.across[[0, 1, 3, 4], [1, 0, 4, 3]] = -mass, mass, -inertia, inertia
        super().__init__(q, v, np.diag([mass] * 3 + [inertia] * 3))
        self.setFGyrPtr(np.zeros(6))
        self.setJacobianFGyrqPtr(np.zeros((6, 6)))
        self.setJacobianFGyrqDotPtr(np.zeros((6, 6)))

    def computeFGyr(self, *state: Any) -> None:
        """M Omega x v."""
        q, v = state or (self.q(), self.velocity())
        self.fGyr()[:] = v[1] / (self.R + q[0]) * (self.across @ v)

    def computeJacobianFGyrq(self, *state: Any) -> None:
        """The derivative of M Omega x v by the coordinates."""
        q, v = state or (self.q(), self.velocity())
        self.jacobianFGyrq()[:, 0] = -v[1] / (self.R + q[0]) ** 2 * (self.across @ v)

    def computeJacobianFGyrqDot(self, *state: Any) -> None:
        """The derivative of M Omega x v by the velocities."""
        q, v = state or (self.q(), self.velocity())
        jacobian = v[1] * self.across
        jacobian[:, 1] += self.across @ v
        self.jacobianFGyrqDot()[:] = jacobian / (self.R + q[0])


def turned(azimuth: float) -> Any:
    """Outward, along and up, as rows, in world axes."""
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


if __name__ == "__main__":
    main()
