"""All protocols, in the order in which they measure."""

from __future__ import annotations

from compare.measure import (
    birth,
    bounds,
    calm,
    choice,
    edge,
    field,
    growth,
    hysteresis,
    impacts,
    laws,
    lift,
    motions,
    newcomer,
    plane,
    pulsation,
    rates,
    recurrent,
    settled,
    slope,
    steepest,
    swing,
    thresholds,
    unloading,
    unsteady,
    watched,
)
from compare.measure.lab import Level
from compare.measure.programme import Protocol

PROTOCOLS: tuple[Protocol, ...] = (
    Protocol("settled", settled.measure),
    Protocol("newcomer", newcomer.measure),
    Protocol("plane", plane.measure),
    Protocol("hysteresis", hysteresis.measure, ("settled",)),
    Protocol("rates", rates.measure, ("settled",)),
    Protocol("laws", laws.measure, waits=False),
    Protocol("thresholds", thresholds.measure),
    Protocol("edge", edge.measure, ("thresholds",)),
    Protocol("birth", birth.measure, ("thresholds",)),
    Protocol("unloading", unloading.measure, ("thresholds",)),
    Protocol("field", field.measure, waits=False),
    Protocol("growth", growth.measure, waits=False),
    Protocol("steepest", steepest.measure, waits=False),
    Protocol("lift", lift.measure, waits=False),
    Protocol("bounds", bounds.measure, ("thresholds",)),
    Protocol("watched", watched.measure, ("thresholds",)),
    Protocol("motions", motions.measure, waits=False),
    Protocol("impacts", impacts.measure, waits=False),
    Protocol("recurrent", recurrent.measure),
    Protocol("swing", swing.measure, level=Level.DEFAULT),
    Protocol("calm", calm.measure, level=Level.DEFAULT),
    Protocol("choice", choice.measure),
    Protocol("pulsation", pulsation.measure, ("thresholds",)),
    Protocol("unsteady", unsteady.measure, ("thresholds",)),
    Protocol("slope", slope.measure, ("settled", "thresholds")),
)
"""Every protocol there is; each goes out only from those before it."""
