# %% [markdown]
# # The paper in ten minutes
#
# M. Antali and G. Stépán, *Discontinuity-induced bifurcations of a dual-point contact
# ball*, Nonlinear Dynamics (2016), in pictures. They were computed when this page was
# built: theory by `analytic`, simulation by `mjsim`, which is MuJoCo and knows nothing
# of the theory. This page is a script with cells; open it as a notebook, or run it with
# Python.
#
# ## The ball
#
# ![The ball in its vessel, with contact forces and slip](../render.png)
#
# A ball lies in a round vessel. Water swirls in it with the angular velocity $\omega_0$
# and carries the ball round along the wall, with the angular velocity $\omega_c$. This
# is the moving part of a flowmeter: count how often the ball comes by, and you know the
# flow, *if* $\omega_c = \omega_0$. When is that so?
#
# The ball can touch the floor at A and the wall at B. At each it rolls (R), slips (S),
# or doesn't touch (N). Two letters, floor first, make nine cases: RR rolls at both, NR
# has left the floor and rolls along the wall, NN flies.

# %% tags=["hide-input"]
# %config InlineBackend.figure_formats = ["svg"]

import matplotlib.pyplot as plt
import numpy as np

import analytic
import mjsim
from analytic.bifurcation.diagram import threshold_curves
from compare import plot
from model import Case, Flow, Parameters

plt.rcParams |= {
    "figure.figsize": (7, 3.8),
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
}
MUJOCO = {"color": "black", "lw": 1, "ls": ":"}
p = Parameters.named("reference")
for field in p.quantities():
    unit, meaning = field.metadata["unit"], field.metadata["meaning"]
    print(f"{field.name:>13} = {getattr(p, field.name):<6g} {unit:<9} {meaning}")

# %% [markdown]
# ## Where the motion changes
#
# As the flow gets faster, the steady motion changes at certain $\omega_0$, for which
# the paper has formulas.

# %% tags=["hide-input"]
limits = analytic.thresholds(p)
meanings = {
    "omega_01": "above it a ball that rolls at both points begins to slip",
    "omega_02": "above it the wall can carry the ball",
    "omega_03": "above it the floor carries nothing of a rolling ball",
    "omega_04": "above it there is no steady slipping",
}
for name, meaning in meanings.items():
    print(f"{name} = {getattr(limits, name):8.4f} rad/s: {meaning}")

# %% [markdown]
# ## The characteristic curve
#
# For each flow the theory lists the steady motions. Solid: a disturbed ball comes back
# to it. Dashed: it does not. Circles: MuJoCo, started at rest at each flow and simulated
# for 40 seconds.

# %% tags=["hide-input"]
starts = np.linspace(4, 44, 11)
settings = mjsim.RigidContacts(timestep=4e-3)
at_rest = [0.0] * 6
runs = mjsim.simulate_many(
    [p.replace(omega_0=float(omega_0)) for omega_0 in starts],
    [at_rest] * len(starts),
    40.0,
    settings=settings,
)

figure, axes = plt.subplots()
plot.characteristic(p, axes)
axes.plot(
    starts,
    [run.omega_c[-1] for run in runs],
    "o",
    color="black",
    mfc="white",
    ms=6,
    label="MuJoCo, from rest",
)
axes.legend(fontsize=8)
figure.tight_layout()
plt.show()

# %% [markdown]
# Up to $\omega_{01}$ the ball rolls at both points and reads the flow exactly. Then it
# slips at both and its speed hardly changes any more. Beyond $\omega_{02}$ it may also
# ride on the wall, where it goes round with the flow again: between $\omega_{02}$ and
# $\omega_{04}$ what it reads depends on its past.
#
# How far is MuJoCo from the theory?

# %% tags=["hide-input"]
for omega_0, run in zip(starts, runs, strict=True):
    steady = analytic.stable_solutions(p.replace(omega_0=float(omega_0)))
    nearest = min(steady, key=lambda each: abs(each.x[2] - run.omega_c[-1]))
    error = run.omega_c[-1] / nearest.x[2] - 1
    case = run.cases[-1].name
    print(f"omega_0 = {omega_0:4.1f}: ends in {case}, omega_c off by {error:+.0e}")

# %% [markdown]
# ## Why eigenvalues can't tell
#
# A stationary motion is usually called stable if the eigenvalues of its linearisation
# have negative real parts. Those of rolling (RR) don't change at $\omega_{01}$. What
# changes is whether friction can *hold* the contacts: rolling is the edge of slipping,
# and the equations of motion jump there. So push the ball into a slight slip and see
# what becomes of it.

# %% tags=["hide-input"]
figure, axes = plt.subplots()
for factor, colour in ((0.8, "#0072B2"), (1.2, "#D55E00")):
    q = p.replace(omega_0=factor * limits.omega_01)
    rolling = analytic.solution(q, Case.RR, formal=True)
    print(f"{factor:g} omega_01: eigenvalues of RR {np.round(rolling.eigenvalues, 3)}")
    pushed = rolling.x + np.array([0, 0, 0, 0.3, 0, 0.3, 0, 0])
    for simulate, look in (
        (analytic.simulate, {"color": colour, "lw": 3}),
        (mjsim.simulate, MUJOCO),
    ):
        run = simulate(q, pushed, 5.0, sample_interval=1e-3)
        speed = np.maximum(run.slip_speed_A, run.slip_speed_B)
        name = "MuJoCo" if look is MUJOCO else "theory"
        axes.semilogy(
            run.time,
            np.maximum(speed, 1e-7),
            **look,
            label=f"{factor:g} $\\omega_{{01}}$, {name}",
        )
axes.set(xlabel="time (s)", ylabel="slip speed (m/s)", ylim=(1e-6, 1))
axes.legend(fontsize=8)
figure.tight_layout()
plt.show()

# %% [markdown]
# Below $\omega_{01}$ the slip stops within a few milliseconds, as dry friction stops
# things. Above it the slip grows. At first it grows so fast that it slows the ball down
# to where rolling is possible, for half a second. The flow speeds it up again. It slips
# again, and settles in SS.
#
# ## The reading that depends on the past
#
# Let the flow rise slowly, and fall again. The slipping ball stays in SS up to the fold
# at $\omega_{04}$. There it has no steady slipping to stay in: it runs up to the speed
# of the flow and rides on the wall. On the way back it stays there down to
# $\omega_{02}$, sinks, lands, and slips again. (Both changes take seconds, while the
# flow goes on changing, so that the curve turns a little late.)

# %% tags=["hide-input"]
there_and_back = Flow.sampled([0, 120, 180], [22, 46, 26])
slipping = analytic.solution(p.replace(omega_0=22.0), Case.SS)
figure, axes = plt.subplots()
theory = analytic.simulate(
    p, slipping.x, 180.0, flow=there_and_back, sample_interval=0.1
)
coarse = mjsim.RigidContacts(timestep=2e-3)
engine = mjsim.simulate(
    p, slipping.x, 180.0, flow=there_and_back, sample_interval=0.1, settings=coarse
)
flow = there_and_back(theory.time)
rising = theory.time <= 120
axes.plot(
    flow[rising],
    theory.omega_c[rising],
    color="#D55E00",
    lw=3,
    label="theory, flow rising",
)
axes.plot(
    flow[~rising],
    theory.omega_c[~rising],
    color="#009E73",
    lw=3,
    label="theory, flow falling",
)
axes.plot(there_and_back(engine.time), engine.omega_c, **MUJOCO, label="MuJoCo")
for name in ("omega_02", "omega_04"):
    axes.axvline(getattr(limits, name), color="0.6", lw=0.8, ls=":")
axes.set(xlabel=r"$\omega_0$ (rad/s)", ylabel=r"$\omega_c$ (rad/s)")
axes.legend(fontsize=8)
figure.tight_layout()
plt.show()

# %% [markdown]
# ## The choice of the wall
#
# The friction of the wall, $\eta$, decides what kind of meter this is. For $\eta < j$
# (the ball's dimensionless moment of inertia) rolling ends at $\omega_{01}$ and
# slipping takes over, up to the fold. For $\eta > j$ there is no slipping motion: the
# ball goes over from floor to wall and always reads the flow. All thresholds meet at
# $\eta = j$.

# %% tags=["hide-input"]
eta = np.linspace(0.02, 0.8, 400)
curves = threshold_curves(p, p.mu, eta)
figure, axes = plt.subplots()
for name in meanings:
    axes.plot(eta, curves[name], label=rf"$\omega_{{{name[-2:]}}}$")
axes.axvline(p.j, color="0.6", lw=0.8, ls=":")
axes.set(xlabel=r"$\eta$", ylabel=r"$\omega_0\sqrt{R/g}$", ylim=(0, 6))
axes.legend()
figure.tight_layout()
plt.show()

# %% [markdown]
# ## By yourself
#
# ```sh
# dualball predict --omega-0 25
# dualball simulate --omega-0 25 --time 20 -o run.h5
# dualball simulate --omega-0 25 --time 20 --engine event -o theory.h5
# dualball compare run.h5 theory.h5
# dualball validate --quick --set reference --claim prop-1
# ```
#
# The last puts a statement of the paper to the test; without `--claim` all of them.
#
# * The formulas, and where each is computed: [theory](../theory.md). Where the paper's
#   text is wrong: [errata](../errata.md).
# * Motions beyond the paper: [hopping for ever](../hopping.md).
# * What engines get right and why: [engines](../engines.md). How far any of it can be
#   trusted: [here](../trust.md).
