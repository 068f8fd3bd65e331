"""Claims about the dotted arrows of Fig. 6: where does a ball leave the floor?"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from analytic import slip_stability
from compare.claims.claim import Bearing, Claim
from compare.measure.record import Measurement, state
from model import Case


def _lift(m: Measurement, lift: Callable[..., float]) -> float:
    inner, outer = Case[str(m.conditions["inner"])], Case[str(m.conditions["outer"])]
    return lift(inner, outer, np.array(state(m)), m.parameters)


def _lifting(inner: Case, outer: Case) -> Claim:
    def along(m: Measurement) -> bool:
        return m.conditions["inner"] == inner.name

    never = inner is Case.RS
    return Claim(
        id=f"lift-{inner.name}-{outer.name}",
        source="Fig. 6, dotted",
        statement=f"Out of {inner.name} the ball {'never ' * never}lifts off the floor{'' if never else ' once'}"
        f"{', whatever its orbit' if never else f' the wall alone, in {outer.name}, would drive it up'}.",
        bearings=(
            Bearing(
                "lift",
                "lifts",
                lambda m: float(_lift(m, slip_stability.lift_acceleration) > 0),
                when=along,
                by="slip_stability.lift_acceleration",
            ),
            Bearing(
                "lift",
                "lift_onset",
                lambda m: _lift(m, slip_stability.lift_onset),
                when=along,
                by="slip_stability.lift_onset",
            ),
        ),
    )


CLAIMS = tuple(_lifting(inner, outer) for inner, outer in slip_stability.LIFT_ARROWS)
