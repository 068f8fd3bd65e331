"""The ball in Siconos: a program for the Python that has it, which takes steps on demand.

It reads and writes lines of JSON. First comes the problem; then nine numbers (place and velocity) to start from, three
(a force) for a step, answered by place and velocity, or none, answered by [contact, force, gap] of each contact point
that carries something. What fails is answered by {"error": ...}. `compare.kit.adapters.siconos` is at the other end.

The Python that runs it isn't that of the project: nothing but Siconos, numpy and the standard library is imported.
"""

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
    """Answer until there is nothing more to read."""
    answers, nowhere = os.fdopen(os.dup(1), "w"), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # Siconos prints warnings to standard output
    os.dup2(nowhere, 2)
    scene: Any = None
    for line in sys.stdin:
        given, answer = json.loads(line), None
        try:
            if isinstance(given, dict):
                scene = (Turning if given["coordinates"] == "joints" else FreeBall)(given)
            elif len(given) == 9:
                scene.start(given[:3], given[3:])
            else:
                answer = scene.advance(given) if given else scene.touches()
        except Exception as error:  # the other side has to say it, whatever it is
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


class Scene:
    """The problem, and the simulation that `start` begins."""

    directions = "C"
    """What a relation calls its matrix: normal and tangents (rows) by velocities, first those of the centre."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.R, self.r, self.mass = given, given["R"], given["r"], given["m"]
        self.inertia = given["j"] * self.mass * self.r**2
        self.weight = self.mass * given["g"]

    def simulate(self, ball: Any, relations: list[Any]) -> None:
        """Begin with a ball and its contacts, first that with the floor."""
        given = self.given
        self.ball, system = ball, kernel.NonSmoothDynamicalSystem(0.0, float("inf"))
        system.insertDynamicalSystem(ball)
        self.contacts = []
        for number, relation in enumerate(relations):
            law = kernel.NewtonImpactFrictionNSL(0.0, 0.0, given["eta" if number else "mu"], 3)
            self.contacts.append(kernel.Interaction(law, relation))
            system.link(self.contacts[-1], ball)
        solver = kernel.FrictionContact(3)
        options = solver.numericsSolverOptions()
        options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = given["iterations"]
        options.dparam[numerics.SICONOS_DPARAM_TOL] = given["tolerance"]
        clock, projection = kernel.TimeDiscretisation(0.0, given["timestep"]), given["projection"]
        if projection is None:
            stepping = kernel.MoreauJeanOSI(given["theta"])
            self.simulation = kernel.TimeStepping(system, clock, stepping, solver)
        else:
            stepping = kernel.MoreauJeanDirectProjectionOSI(given["theta"])
            gaps = kernel.MLCPProjectOnConstraints(numerics.SICONOS_MLCP_ENUM, 1.0)
            self.simulation = kernel.TimeSteppingDirectProjection(system, clock, stepping, solver, gaps)
            self.simulation.setConstraintTolUnilateral(projection)
        stepping.setConstraintActivationThreshold(given["activation"])
        self.simulation.setNewtonTolerance(given["newton"])
        self.simulation.initialize()

    def take_step(self, force: list[float]) -> None:
        """A step under a force that is constant over it."""
        self.ball.setFExtPtr(np.array(force))
        self.ball.computeForces(0.0, self.ball.q(), self.ball.velocity())
        self.ball.swapInMemory()  # a theta method takes a part of the force that is kept from before the step
        self.simulation.computeOneStep()
        self.simulation.nextStep()

    def touches(self) -> list[Any]:
        """Number, force on the ball's centre and gap of each contact that carried something in the last step."""
        shown = []
        for number, contact in enumerate(self.contacts):
            impulse = contact.lambda_(1)
            if impulse[0] > 0:
                force = getattr(contact.relation(), self.directions)()[:, :3].T @ impulse / self.given["timestep"]
                shown.append((number, force.tolist(), contact.y(0)[0]))
        return shown


class TurningBall(kernel.LagrangianDS):  # type: ignore[misc]
    """A free ball in axes that turn with it: M dv/dt + M Omega x v = F for its velocity and its spin.

    Coordinates are -h, the way along the wall, y, and three that nothing depends on; axes outward, along and up.
    Omega = (0, 0, v_along/(R - h)).
    """

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
        """Its derivative by the coordinates."""
        q, v = state or (self.q(), self.velocity())
        self.jacobianFGyrq()[:, 0] = -v[1] / (self.R + q[0]) ** 2 * (self.across @ v)

    def computeJacobianFGyrqDot(self, *state: Any) -> None:
        """Its derivative by the velocities."""
        q, v = state or (self.q(), self.velocity())
        jacobian = v[1] * self.across
        jacobian[:, 1] += self.across @ v
        self.jacobianFGyrqDot()[:] = jacobian / (self.R + q[0])


class Turning(Scene):
    """A ball in axes that turn with it, so that floor and wall are planes; in the coordinates of massless joints."""

    def start(self, place: list[float], velocity: list[float]) -> None:
        """Place (ignored, h, y); velocity (omega_c, v_h, v_y, spin about the axes less omega_c)."""
        (_, h, y), (omega_c, v_h, v_y, *spin, s_z), r = place, velocity, self.r
        v = [-v_h, (self.R - h) * omega_c, v_y, *spin, s_z + omega_c]
        ball = TurningBall([-h, 0, y, 0, 0, 0], v, self.mass, self.inertia, self.R)
        floor = [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, -r, 0], [0, 1, 0, r, 0, 0]]
        wall = [[-1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, r], [0, 0, 1, 0, -r, 0]]
        self.simulate(ball, [kernel.LagrangianLinearTIR(np.array(rows, float)) for rows in (floor, wall)])

    def advance(self, force: list[float]) -> Any:
        """Under (torque, inward, upward); the azimuth is that of this step."""
        (torque, inward, upward), q = force, self.ball.q()
        before, way = self.R + q[0], q[1]
        self.take_step([-inward, torque / before, upward - self.weight, 0.0, 0.0, 0.0])
        q, (outward, along, v_y, *spin, s_z) = self.ball.q(), self.ball.velocity()
        rho = self.R + q[0]
        place = 2 * (q[1] - way) / (before + rho), -q[0], q[2]
        return place, (along / rho, -outward, v_y, *spin, s_z - along / rho)


class Contact(kernel.NewtonEuler3DR):  # type: ignore[misc]
    """A ball's contact with a surface that says how far it is from a centre, and its normal there."""

    def __init__(self, r: float, surface: Any) -> None:
        super().__init__()
        self.r, self.surface = r, surface

    def computeh(self, time: float, q: Any, gap: Any) -> None:
        """Gap, contact points and normal."""
        distance, normal = self.surface(q)
        gap[0] = distance - self.r
        self.nc()[:] = normal
        self.pc1()[:] = self.pc2()[:] = q[:3] - self.r * normal


class FreeBall(Scene):
    """A free ball in a true cylinder."""

    directions = "jachqT"

    def start(self, place: list[float], velocity: list[float]) -> None:
        """Place, velocity and spin in world axes."""

        def wall(q: Any) -> Any:
            rho = math.hypot(q[0], q[1])
            return self.R + self.r - rho, np.array([-q[0] / rho, -q[1] / rho, 0.0])

        up, orientation = np.array([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0, 0.0]
        ball = kernel.NewtonEulerDS([*place, *orientation], velocity, self.mass, self.inertia * np.eye(3))
        self.simulate(ball, [Contact(self.r, surface) for surface in (lambda q: (q[2], up), wall)])

    def advance(self, force: list[float]) -> Any:
        """Under a force in world axes."""
        self.take_step([force[0], force[1], force[2] - self.weight])
        (x, y, z, w, *axis), velocity = self.ball.q(), self.ball.velocity()
        spin = velocity[3:]  # in the axes of the ball
        turn = 2 * np.cross(axis, spin)
        return (x, y, z), (*velocity[:3], *(spin + w * turn + np.cross(axis, turn)))


if __name__ == "__main__":
    main()
