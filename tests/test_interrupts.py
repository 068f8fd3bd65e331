"""Ctrl-C ends every call of the library that may take hours, in whatever compiled loop it is."""

import subprocess
import sys

INTERRUPTED = """
import signal, time
import analytic, mjsim
from model import Flow, Parameters

signal.signal(signal.SIGINT, signal.default_int_handler)
p, hopping, rest = Parameters.named("reference").replace(omega_0=25.0), Parameters.named("hopping"), [0] * 6
rigid = mjsim.ContactSettings.rigid_at(1e-3)
calls = {
    "event": lambda t: analytic.simulate(p, rest, t, Flow.sine(20, 5, 1)),
    "time-stepping": lambda t: analytic.simulate(p, rest, t, method="time-stepping"),
    "many": lambda t: analytic.simulate_many(p, [rest] * 4, t),
    "mjsim": lambda t: mjsim.simulate(p, rest, t),
    "mjsim rigid": lambda t: mjsim.simulate(p, rest, t, settings=rigid),
    "mjsim many": lambda t: mjsim.simulate_many([p] * 64, [rest] * 64, t, threads=2),
    "attractors": lambda t: analytic.attractors(hopping, 1 if t < 1 else 1000, lasting=t),
}
for name, call in calls.items():
    call(0.1)  # is compiled
    begun = []
    press = lambda *_: begun.append(time.process_time()) or signal.raise_signal(signal.SIGINT)
    signal.signal(signal.SIGALRM, press)
    signal.setitimer(signal.ITIMER_REAL, 0.4)
    try:
        call(1e5)
    except KeyboardInterrupt:
        print(name, time.process_time() - begun[0] < 3)
"""
"""Prints of each call whether it ended within 3 s of processor time."""


def test_ctrl_c_ends_every_long_call() -> None:
    """In a process of its own: one that answers while numba makes a result would crash it."""
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    names = ("event", "time-stepping", "many", "mjsim", "mjsim rigid", "mjsim many", "attractors")
    assert done.stdout.splitlines() == [f"{name} True" for name in names]
    assert "Traceback" not in done.stderr
