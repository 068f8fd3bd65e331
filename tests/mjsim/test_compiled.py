"""The compiled corrections are those of the source, whatever a run goes through."""

import numpy as np
import pytest

import mjsim
from mjsim import ContactSettings, backend
from model import Flow, Parameters
from model.drag import LAWS

P = Parameters.named("reference").replace(omega_0=12.0)
SETS = [P.replace(drag=law, nu_f=1e-4) for law in LAWS]
STARTS = [[0.02, -0.2, 12.0, 30, -10, 20, 0, 0], [0, 0, 12.0, -2, 1, 6, 0, 0], [0.01, 0, 10.0, 1, 2, 3, 0.002, -0.3]]
"""A landing, slip at both contacts, and a landing on the wall."""


@pytest.mark.parametrize("changes", [{}, {"servo": 0.0}, {"memory": False, "order": 1}])
def test_compiled_gives_the_same_run(monkeypatch: pytest.MonkeyPatch, changes: dict[str, object]) -> None:
    """For all laws of drag in one batch; not to the bit everywhere: numpy and numba may round a cosine in two ways."""
    pytest.importorskip("numba")
    settings, flow = ContactSettings.at(1e-3, **changes), Flow.ramp(12.0, 25.0, 0.2)

    def runs() -> list[np.ndarray]:
        together = mjsim.simulate_many(SETS, STARTS, 0.3, flow, settings, sample_interval=2e-3)
        alone = [mjsim.simulate(p, x0, 0.3, flow, settings) for p, x0 in zip(SETS, STARTS, strict=True)]
        return [run.x for run in (*together, *alone)]

    fast = runs()
    monkeypatch.setattr(backend, "compiled", lambda: None)
    for x, exact in zip(fast, runs(), strict=True):
        np.testing.assert_allclose(x, exact, rtol=0, atol=1e-9)
