# %% [markdown]
# # Does it slip?
#
# A box on a slope and a rod in a gripper, both well inside their friction cones, both
# with MuJoCo's own contact parameters. Both creep. How fast can be computed before the
# simulation runs; one option makes it slower, and Coulomb's law ends it.

# %% tags=["hide-input"]
# %config InlineBackend.figure_formats = ["svg"]
import functools

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from compare.bench.forecast import forecast
from compare.bench.forecast_page import sentences
from compare.bench.settled import settle
from mjsim import Coulomb

plt.rcParams |= {
    "figure.figsize": (7, 3.2),
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
}
SLOPE = """
<mujoco>
  <option cone="elliptic"/>
  <default><geom friction="0.6"/></default>
  <worldbody>
    <geom name="slope" type="plane" size="2 2 0.1" euler="0 15 0"/>
    <body pos="0.013 0 0.0485" euler="0 15 0">
      <freejoint/>
      <geom name="box" type="box" size="0.05 0.05 0.05" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""
GRIPPER = """
<mujoco>
  <option cone="elliptic" impratio="10"/>
  <worldbody>
    <body pos="-0.03 0 0.5" gravcomp="1">
      <joint name="left" type="slide" axis="1 0 0" damping="20"/>
      <geom name="left" type="box" size="0.01 0.03 0.03" mass="0.2"/>
    </body>
    <body pos="0.03 0 0.5" gravcomp="1">
      <joint name="right" type="slide" axis="-1 0 0" damping="20"/>
      <geom name="right" type="box" size="0.01 0.03 0.03" mass="0.2"/>
    </body>
    <body pos="0 0 0.5">
      <freejoint/>
      <geom name="rod" type="capsule" size="0.02 0.03" mass="0.1"/>
    </body>
  </worldbody>
  <actuator><motor joint="left"/><motor joint="right"/></actuator>
  <keyframe><key name="held" ctrl="5 5"/></keyframe>
</mujoco>
"""

# %% [markdown]
# ## The forecast
#
# `dualball forecast scene.xml` does this on the command line. The engine settles the
# model and says what each contact carries. The creep follows from the regularisation $R_t$ of
# the friction rows and their damping $b_f$: a contact that bears the friction $f_t$
# slips at $R_t f_t / b_f$.


# %% tags=["hide-input"]
def settled(text):
    """A model at rest, its state, and the forecast."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data, forecast(model, data, settle(model, data, limit=10.0))


for text in (SLOPE, GRIPPER):
    _, _, found = settled(text)
    for pair in found.pairs:
        print(
            f"{pair.name:>12}: {pair.cone:.0%} of the cone in use, "
            f"creep {1e6 * pair.creep:.4g} µm/s predicted, "
            f"{1e6 * pair.creep_measured:.4g} µm/s measured"
        )
    for line in sentences(found):
        print("   ", line)

# %% [markdown]
# ## What each option does
#
# The creep of the box for every `impratio`, computed once and measured each time. It
# falls in proportion, and never to zero.

# %% tags=["hide-input"]
ratios = np.geomspace(1, 1e4, 5)
predicted, measured = [], []
for ratio in ratios:
    _, _, found = settled(SLOPE.replace("elliptic", f'elliptic" impratio="{ratio:g}'))
    predicted.append(found.pairs[0].creep)
    measured.append(found.pairs[0].creep_measured)
figure, axes = plt.subplots()
axes.loglog(ratios, predicted, color="black", lw=1, label="predicted")
axes.loglog(ratios, measured, "o", color="#D55E00", mfc="white", label="measured")
axes.set(xlabel="impratio", ylabel="creep (m/s)")
axes.legend()
figure.tight_layout()
plt.show()

# %% [markdown]
# ## Coulomb's law
#
# `mjsim.Coulomb(model).step(data)` takes the place of `mj_step`. Each contact remembers
# the friction force it had in the last step, so that none of it is left to creep. How
# far the box and the rod come in five seconds:


# %% tags=["hide-input"]
def way(model, data, step, seconds=5.0):
    """Distance of the last body from where it was, in µm, and the time, sampled."""
    begin, moved = data.xpos[-1].copy(), []
    for _ in range(100):
        step(data, int(seconds / 100 / model.opt.timestep))
        mujoco.mj_kinematics(model, data)
        moved.append(1e6 * np.linalg.norm(data.xpos[-1] - begin))
    return np.arange(1, 101) * seconds / 100, moved


figure, panels = plt.subplots(1, 2)
for axes, (name, text) in zip(
    panels, {"box on a slope": SLOPE, "rod in a gripper": GRIPPER}.items(), strict=True
):
    model, data, _ = settled(text)
    held = mujoco.MjData(model)
    mujoco.mj_copyData(held, model, data)
    coulomb = Coulomb(model)
    coulomb.step(held, 500)  # it takes a moment to know the forces
    plainly = functools.partial(mujoco.mj_step, model)
    axes.plot(*way(model, data, plainly), color="#D55E00", label="plain")
    lawful = way(model, held, coulomb.step)
    axes.plot(*lawful, color="#0072B2", label="Coulomb's law")
    axes.set(title=name, xlabel="time (s)", ylabel="way (µm)")
    print(f"{name}: {lawful[1][-1]:.1e} µm in 5 s under Coulomb's law")
panels[0].legend()
figure.tight_layout()
plt.show()

# %% [markdown]
# ## What slides
#
# The same box on a slope of 30°, where friction cannot hold it any more: it slides down
# with $g(\sin 30^\circ - 0.25\cos 30^\circ)$. In plain MuJoCo slip lifts it; it hovers,
# lands and hovers again. Under the law it keeps its contact, and its acceleration.

# %% tags=["hide-input"]
SLIDE = SLOPE.replace("0 15 0", "0 30 0").replace("0.6", "0.25")
SLIDE = SLIDE.replace('pos="0.013 0 0.0485"', 'pos="0.025 0 0.0433"')
exact = 9.81 * (np.sin(np.radians(30)) - 0.25 * np.cos(np.radians(30)))
figure, (loads, speeds) = plt.subplots(1, 2, layout="constrained")
for name, color in {"plain": "#D55E00", "Coulomb's law": "#0072B2"}.items():
    model = mujoco.MjModel.from_xml_string(SLIDE)
    data, coulomb = mujoco.MjData(model), Coulomb(model)
    plainly = functools.partial(mujoco.mj_step, model)
    step = plainly if name == "plain" else coulomb.step
    rows = []
    for _ in range(500):
        step(data)
        pressed = data.efc_force[: 3 * data.ncon : 3].sum()  # of three rows a contact
        rows.append((data.time, pressed, np.linalg.norm(data.qvel[:3])))
    time, load, speed = np.transpose(rows)
    loads.plot(time, load, color=color, label=name, lw=0.8)
    speeds.plot(time, speed - exact * time, color=color, lw=0.8)
    lost = np.mean(load[100:] == 0)
    print(f"{name}: without contact in {lost:.0%} of the steps after 0.2 s")
loads.set(xlabel="time (s)", ylabel="normal force (N)", ylim=(0, 40))
speeds.set(xlabel="time (s)", ylabel="speed less exact speed (m/s)")
figure.legend(*loads.get_legend_handles_labels(), loc="outside upper center", ncols=2)
plt.show()

# %% [markdown]
# [The forecast](../forecast.md) has the formulas, [Coulomb's law in MuJoCo](../friction.md) the
# law, and says where it ends.
