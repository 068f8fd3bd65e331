"""Where the model doesn't hold, in words that all commands and pages share."""

from analytic.flowmeter import real_fluid
from model import Parameters


def model_warning(off: float) -> list[str]:
    """The warning that the model leaves out too much, if its error `off` is too large."""
    if off <= real_fluid.LIMIT:
        return []
    return [
        "Warning: the paper's model doesn't hold for this fluid: it is off by up to "
        f"{100 * off:.0f} %. Above all, it leaves out the fluid's torque on the spinning ball."
    ]


def torque_left_out(p: Parameters) -> str:
    """In words what the fluid's torque, which theory leaves out, does to a ball that rolls at both
    points; empty where the fluid isn't known."""
    if not (p.nu_f or p.fluid_torque) or not (p.c and p.omega_0):
        return ""
    laws = {"by Stokes": real_fluid.rolling(p, False)}
    layer = real_fluid.rolling(p)
    if p.fluid_torque:
        laws = {f"at the rate of {p.fluid_torque:g} 1/s that is given": layer}
    elif layer.Re > 8:
        laws["with a boundary layer"] = layer
    told = ", ".join(
        f"{law.omega_c:.3g} rad/s ({100 * law.shift:+.0f} %) {how}" for how, law in laws.items()
    )
    said = f"Left out is the fluid's torque on the spin: the rolling ball's ω_c would be {told}."
    if max(law.friction for law in laws.values()) > 1:
        said += " That takes more friction than there is: it would slip."
    return said
