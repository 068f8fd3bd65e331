"""Where the model doesn't hold, in words that all commands and pages share."""

from __future__ import annotations

from analytic.flowmeter import real_fluid


def model_warning(off: float) -> list[str]:
    """The warning that the model leaves out too much of a real fluid, if its error `off` exceeds
    the limit."""
    if off <= real_fluid.LIMIT:
        return []
    return [
        "Warning: the paper's model doesn't hold for this fluid. What it leaves out, above all the "
        f"fluid's torque on the spinning ball, changes its numbers by up to {100 * off:.0f} %."
    ]
