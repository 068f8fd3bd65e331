"""The viewer's loop, with a window and a clock that are not there, is the study's own."""

from contextlib import nullcontext

import numpy as np

import mjsim
from compare.view import viewer
from mjsim import ContactSettings, recorder
from model import Flow
from model.kinematics import rotated


class Window:
    """Closes after so many pictures, and is the clock: a picture takes 1/64 s, a number without round-off."""

    def __init__(self, pictures: int, takes: float = 1 / 64) -> None:
        self.left, self.takes, self.now = pictures, takes, 0.0

    def is_running(self) -> bool:
        return self.left > 0

    def lock(self) -> nullcontext[None]:
        return nullcontext()

    def sync(self) -> None:
        self.left -= 1
        self.now += self.takes

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        pass


def test_the_loop_is_that_of_a_simulation(reference, monkeypatch):
    p, x0 = reference.replace(omega_0=25.0), [0, 0, 13.0, 0, 0, 0]
    flow, settings = Flow.ramp(20.0, 25.0, 0.3), ContactSettings()
    stepper, window = viewer.start(p, x0, flow, settings), Window(33)
    monkeypatch.setattr(viewer, "time", window)
    steps = viewer.run(window, stepper, flow, settings.timestep, 1.0)
    assert steps == 500  # half a second: the first of the 33 pictures shows the start
    run = mjsim.simulate(p, x0, 0.5, flow, settings, sample_interval=0.5)
    qpos, qvel = np.array(stepper.data.qpos), np.array(stepper.data.qvel)
    place = qpos[:3] - settings.midpoint * settings.timestep * qvel[:3]  # positions are ahead of velocities
    qvel[3:] = rotated(qpos[3:], qvel[3:])
    # Equal but for the round-off of turning one state into the paper's variables, or many at once.
    scale = np.maximum(np.abs(run.x[-1]), [p.r, 1, 1, 60, 60, 60, p.r, 1])
    np.testing.assert_array_less(np.abs(recorder.state(place, qvel, p) - run.x[-1]), 4 * np.finfo(float).eps * scale)


def test_a_slow_machine_does_not_run_after_the_clock(reference, monkeypatch):
    settings = ContactSettings()
    flow, window = Flow.steady(12.0), Window(4, takes=3.0)
    stepper = viewer.start(reference, [0, 0, 12.0, 0, 0, 0], flow, settings)
    monkeypatch.setattr(viewer, "time", window)
    steps = viewer.run(window, stepper, flow, settings.timestep, 1.0)
    assert steps == 3 * round(viewer.BEHIND / settings.timestep)
