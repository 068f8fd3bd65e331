# %% [markdown]
# # Is my contact setting any good?
#
# MuJoCo's contacts are soft, and how soft is up to you: `solref`, `solimp`, `impratio`,
# the friction cone and the time step decide whether a ball that should roll creeps,
# whether one that should slide chatters, and how far it sinks in. There is rarely an
# exact answer to compare with. For the ball in the vessel there is one, so it makes a
# good test piece.
#
# This page takes the settings out of an MJCF file, puts them to the test on motions
# known exactly, explains what goes wrong, and repairs it.
#
# ## Your file
#
# Any MJCF file with a ball that can touch a floor and something beside it will do: only
# the settings of its contacts are taken. Here is one as many people would write it.

# %%
# %config InlineBackend.figure_formats = ["svg"]
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import analytic
import mjsim
from compare.bench import forecast, forecast_page, league, native, settled
from compare.kit.engines import newcomer
from compare.kit.progress import show_nothing
from mjsim import ContactSettings
from model import Case, Parameters

warnings.simplefilter(
    "ignore"
)  # `mjsim` warns of settings that hover, which are the topic here
plt.rcParams |= {
    "figure.figsize": (7, 3.4),
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
}
MINE = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1"/>
    <geom name="wall" type="box" size="0.01 1 1" pos="0.1 0 1"/>
    <body pos="0 0 0.05">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.05" mass="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""
Path("mine.xml").write_text(MINE)
mine = native.read(Path("mine.xml"))
print(f"step {mine.option['timestep']} s, impratio {mine.option['impratio']}")
print(f"floor: solref {mine.A.solref}, solimp {mine.A.solimp}")

# %% [markdown]
# ## On the exact cases
#
# `dualball league --settings mine.xml` does this on the command line. Bodies whose
# exact motion is known run with your settings: blocks and spheres on slopes, and the
# ball of the paper in a vessel of flat facets. `dualball cases` says what happens in
# each. An error is the largest of all samples, in units of the case's scales; up to
# 0.01 a case is passed.


# %%
def tested(*files: str, **engines: object) -> None:
    """Print the errors of settings, and of other engines, on the cases."""
    settings = {file: native.entry(Path(file)) for file in files}
    found = league.measure(settings | engines, None, 2, show_nothing)
    for row in league.rows(found):
        print("".join(f"{cell:>22}" for cell in row))
    for name, results in found.items():
        print(f"{name}: {sum(r.passed for r in results)} of {len(results)} passed")


tested("mine.xml")

# %% [markdown]
# What to do about it is what `dualball forecast mine.xml` says: it lets the model come
# to rest, and calculates from its contacts how deep they are, how they creep, and from
# which speed on they hover; advice first.
# A ball that rests needs none but for its depth.

# %%
model, data = settled.load(Path("mine.xml"))
found = forecast.forecast(model, data, settled.settle(model, data, 10.0))
for sentence in forecast_page.sentences(found):
    print("•", sentence)
(pair,) = found.pairs
print(f"{pair.name}: depth {1e6 * pair.depth_measured:.3g} µm")

# %% [markdown]
# ## What hovering looks like
#
# "Hovering" deserves a picture. The ball slips at both points (SS at 25). The floor
# should press on it steadily with its weight, less what the wall carries. With MuJoCo's
# own contact parameters the contact switches on and off from step to step; softer
# friction rows and a lower impedance make it continuous.

# %%
p = Parameters.named("reference").replace(omega_0=25.0)
slipping = analytic.solution(p, Case.SS)
figure, axes = plt.subplots()
for name, settings, colour in (
    ("MuJoCo's own", newcomer(2e-3), "#D55E00"),
    ("dualball's", ContactSettings.for_problem(p, 2e-3), "#0072B2"),
):
    run = mjsim.simulate(p, slipping.x, 3.0, settings=settings, sample_interval=2e-3)
    last = run.time > 2.9
    axes.plot(
        run.time[last],
        run.force_A[last, 1],
        color=colour,
        lw=1,
        marker=".",
        ms=3,
        label=name,
    )
    lost = np.mean(run.force_A[:, 1] == 0)
    print(f"{name:>12}: no contact with the floor in {lost:.0%} of the steps")
axes.axhline(slipping.force_A[1], color="black", ls="--", lw=0.8, label="theory")
axes.set(xlabel="time (s)", ylabel="force of the floor (N)", ylim=(-0.02, 0.45))
axes.legend(loc="upper right", ncols=3)
figure.tight_layout()
plt.show()

# %% [markdown]
# Whether a contact hovers can be calculated before any run: sliding is continuous while
# the *hover number* is less than one. It grows with the slip speed and with the
# stiffness of the friction rows, and falls with the load.
#
# ## What creep looks like
#
# A rolling contact needs friction, and a soft contact gives none without a little slip.
# The theory of the contact model says how much: the higher `impratio`, the less.

# %%
rolling = p.replace(omega_0=12.0)
state = analytic.solution(rolling, Case.RR)
ratios = np.array([1.0, 10.0, 100.0, 1000.0, 1e4])
measured, predicted = [], []
for impratio in ratios:
    soft = ContactSettings.at(2e-3, memory=False, order=1, impratio=float(impratio))
    run = mjsim.simulate(rolling, state.x, 10.0, settings=soft)
    measured.append(run.slip_speed_A[-1])
    at_A = np.hypot(run.force_A[-1, 0], run.force_A[-1, 2]) / p.m
    predicted.append(float(soft.creep_speed(at_A)))
figure, axes = plt.subplots()
axes.loglog(ratios, predicted, color="black", lw=1, label="theory of the contact")
axes.loglog(ratios, measured, "o", color="#D55E00", mfc="white", label="measured")
axes.set(xlabel="impratio", ylabel="slip speed of a rolling contact (m/s)")
axes.legend()
figure.tight_layout()
plt.show()

# %% [markdown]
# `dualball` itself goes another way: it shifts the velocity of the surface by the last
# friction force, which takes the creep away at any `impratio`.
#
# ## Repaired
#
# `ContactSettings.for_problem` calculates settings that fit this problem and this step.
# MuJoCo takes `solreffriction` for a pair of geoms only, so the two pairs have to be
# named in the file:

# %%
fitting = ContactSettings.for_problem(p, 0.002)
print(f"impratio {fitting.impratio:.3g}, solref {fitting.solref}")
print(f"solreffriction {fitting.solreffriction:.3g}, solimp {fitting.solimp:.3g}")
CONTACT = 'solref="0.004 1" solreffriction="4 1" solimp="0.001 0.001 0.0001 0.5 2"'
REPAIRED = MINE.replace("<option ", '<option cone="elliptic" impratio="3000" ').replace(
    "</mujoco>",
    f"""  <contact>
    <pair geom1="ball" geom2="floor" {CONTACT}/>
    <pair geom1="ball" geom2="wall" {CONTACT}/>
  </contact>
</mujoco>""",
)
Path("repaired.xml").write_text(REPAIRED)
tested("mine.xml", "repaired.xml", Coulomb=league.ENTRIES["mujoco"])

# %% [markdown]
# The repair is for a ball that slips fast: spheres come nearer to theory. Blocks rest
# on four points, and lose contact with springs so soft. No setting serves both, and
# round a vessel of flat facets none helps. The last column is MuJoCo with rigid
# contacts under [Coulomb's law](../friction.md), `mjsim.Coulomb(model, rigid=True)`,
# which serves any model; [how MuJoCo is set here](../mujoco-settings.md) derives every
# number on this page.
