"""Models drawn by a seed, of all that MuJoCo has geoms, joints, options and constraints for."""

from __future__ import annotations

import mujoco
import numpy as np

ASSETS = (
    '<asset><mesh name="tetra" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/>'
    '<hfield name="hill" nrow="3" ncol="3" size="2 2 .1 .1" elevation="0 0 0 0 1 0 0 0 0"/></asset>'
)
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


def model(seed: int, rigid: bool) -> mujoco.MjModel:
    """The model of a seed; none with what rigid contacts refuse."""
    return mujoco.MjModel.from_xml_string(Draw(seed).text(rigid))


class Draw:
    """The text of a model, piece by piece."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.count = 0  # of joints, those of balls too, which are not in the list
        self.joints: list[str] = []
        self.bodies: list[str] = []
        self.geoms: list[str] = []

    def one(self, *of: str) -> str:
        return str(self.random.choice(of))

    def often(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def numbers(self, count: int, least: float, most: float) -> str:
        return " ".join(f"{x:.4g}" for x in self.random.uniform(least, most, count))

    def size_of_numbers(self, least: float, most: float) -> str:
        """A number, evenly on the scale of its logarithm."""
        return f"{np.exp(self.random.uniform(np.log(least), np.log(most))):.3g}"

    def text(self, rigid: bool) -> str:
        floor = self.one('type="plane" size="5 5 1"', 'type="hfield" hfield="hill"')
        bodies = "".join(self.body(0) for _ in range(self.random.integers(1, 6)))
        parts = self.tendons() + self.actuators() + self.equalities() + self.pairs()
        return (
            f"<mujoco>{self.options(rigid)}{ASSETS}<worldbody>"
            f'<geom name="floor" {floor} {self.contact()}/>{bodies}</worldbody>{parts}</mujoco>'
        )

    def options(self, rigid: bool) -> str:
        integrators = ["Euler", "implicit", "implicitfast"] + ["RK4"] * (not rigid)
        flags = {
            **{"island": 0.2, "warmstart": 0.1, "eulerdamp": 0.1, "refsafe": 0.2},
            **{"filterparent": 0.1, "gravity": 0.1, "midphase": 0.1, "frictionloss": 0.1},
        }
        off = " ".join(f'{flag}="disable"' for flag, share in flags.items() if self.often(share))
        on = " ".join(
            f'{flag}="enable"'
            for flag in ("energy", "fwdinv", "override", "multiccd")
            if self.often(0.15)
        )
        return (
            f'<option integrator="{self.one(*integrators)}" '
            f'solver="{self.one("Newton", "Newton", "CG", "PGS")}" '
            f'cone="{self.one("elliptic", "pyramidal")}" '
            f'jacobian="{self.one("dense", "sparse", "auto")}" '
            f'timestep="{self.size_of_numbers(5e-4, 8e-3)}" impratio="{self.one("1", "1", "10")}" '
            f'density="{self.one("0", "0", "1.2", "1000")}" wind="{self.numbers(3, -1, 1)}" '
            f'gravity="{self.numbers(2, -4, 4)} -9.81"><flag {off} {on}/></option>'
        )

    def contact(self) -> str:
        """What a geom says of its contacts."""
        solref = self.one(
            *("0.02 1", "0.02 1", "0.005 0.5", "0.2 1", "0.01 3", "-1000 -10", "-1e5 -300")
        )
        mu = f"{self.size_of_numbers(0.01, 2)} {self.size_of_numbers(1e-4, 0.1)}"
        return (
            f'condim="{self.one("1", "3", "3", "4", "6")}" solref="{solref}" '
            f'solimp="{self.one(".9 .95 .001", ".1 .1 .01", ".95 .99 .0001", ".5 .9 .1")}" '
            f'friction="{mu} {self.size_of_numbers(1e-5, 0.01)}" '
            f'margin="{self.one("0", "0", ".001", ".02")}" gap="{self.one("0", "0", ".001")}" '
            f'solmix="{self.one("1", "1", ".1")}" priority="{self.one("0", "0", "1")}"'
        )

    def geom(self) -> str:
        kind, name = self.one(*SIZES, "mesh"), f"g{len(self.geoms)}"
        self.geoms.append(name)
        shape = 'mesh="tetra"'
        if kind in SIZES:
            shape = f'size="{self.numbers(SIZES[kind], 0.02, 0.12)}"'
        return (
            f'<geom name="{name}" type="{kind}" {shape} density="{self.size_of_numbers(50, 8000)}" '
            f'pos="{self.numbers(3, -0.05, 0.05)}" quat="{self.numbers(4, -1, 1)}" '
            f"{self.contact()}/>"
        )

    def joint(self, *kinds: str) -> str:
        kind, name = self.one(*kinds), f"j{self.count}"
        self.count += 1
        if kind != "ball":
            self.joints.append(name)
        limit = f'limited="true" range="{self.one("0 40", "0 90") if kind == "ball" else "-1 1"}"'
        dry = f'frictionloss="{self.size_of_numbers(1e-3, 1)}"' if self.often(0.3) else ""
        return (
            f'<joint name="{name}" type="{kind}" axis="{self.numbers(3, -1, 1)}" '
            f'damping="{self.one("0", ".01", "1")}" stiffness="{self.one("0", "0", "5")}" '
            f'armature="{self.one("0", ".01")}" {dry} {limit if self.often(0.4) else ""}/>'
        )

    def body(self, depth: int) -> str:
        name, free = f"b{len(self.bodies)}", depth == 0 and self.often(0.6)
        self.bodies.append(name)
        place = f"{self.numbers(2, -0.3, 0.3)} {self.numbers(1, 0.1, 0.6)}"
        joints = "<freejoint/>" if free else self.joint("hinge", "hinge", "slide", "ball")
        if not free and self.often(0.2):
            joints += self.joint("slide")
        geoms = "".join(self.geom() for _ in range(self.random.integers(1, 3)))
        below = "".join(self.body(depth + 1) for _ in range(2) if depth < 3 and self.often(0.35))
        place = place if depth == 0 else self.numbers(3, -0.2, 0.2)
        return f'<body name="{name}" pos="{place}">{joints}{geoms}{below}</body>'

    def tendons(self) -> str:
        if len(self.joints) < 2 or self.often(0.5):
            return ""
        one, other = self.random.choice(self.joints, 2, replace=False)
        return (
            f'<tendon><fixed name="t" damping="{self.one("0", "1")}" '
            f'frictionloss="{self.one("0", ".2")}" limited="{self.one("false", "true")}" '
            f'range="-.5 .5"><joint joint="{one}" coef="1"/><joint joint="{other}" coef="-1"/>'
            "</fixed></tendon>"
        )

    def actuators(self) -> str:
        kinds = (
            *('position joint="{}" kp="20" kv="1"', 'velocity joint="{}" kv="2"'),
            *('motor joint="{}" gear="2"', 'intvelocity joint="{}" kp="5" actrange="-1 1"'),
            *(
                'damper joint="{}" kv="1" ctrlrange="0 1"',
                'muscle joint="{}" ctrlrange="0 1" lengthrange="-1 1"',
            ),
        )
        some = [joint for joint in self.joints if self.often(0.4)]
        some = [f"<{self.one(*kinds).format(joint)}/>" for joint in some]
        return f"<actuator>{''.join(some)}</actuator>" if some else ""

    def equalities(self) -> str:
        some = []
        if len(self.bodies) > 1 and self.often(0.4):
            one, other = self.random.choice(self.bodies, 2, replace=False)
            kind = self.one("weld", 'connect anchor="0 0 0"')
            some.append(f'<{kind} body1="{one}" body2="{other}"/>')
        if len(self.joints) > 1 and self.often(0.3):
            one, other = self.random.choice(self.joints, 2, replace=False)
            some.append(f'<joint joint1="{one}" joint2="{other}" polycoef="0 1 0 0 0"/>')
        return f"<equality>{''.join(some)}</equality>" if some else ""

    def pairs(self) -> str:
        """Contacts that a model names, with friction of five numbers."""
        if len(self.geoms) < 2 or self.often(0.6):
            return ""
        one, other = self.random.choice([*self.geoms, "floor"], 2, replace=False)
        return (
            f'<contact><pair geom1="{one}" geom2="{other}" condim="{self.one("3", "4", "6")}" '
            f'friction="{self.numbers(2, 0.05, 1.5)} .01 .001 .002"/></contact>'
        )
