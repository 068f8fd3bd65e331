"""An argument of another type, or out of range, is one clear line, before anything is computed with
it."""

import math

import numpy as np
import pytest

import analytic
import compare
import mjsim
from analytic import characteristic_slope, eigenmodes_SR, mean_slope, simulate_many, solution
from analytic.bifurcation.diagram import number_of_folds
from analytic.flowmeter import response
from analytic.slipping import slip_bounds, slip_stability
from analytic.stationary.slipping_branch import hopf_places
from compare.testing import assert_settles, read
from mjsim import ContactSettings, RigidContacts
from mjsim import simulate_many as many
from model import Case, Flow, InputError, Parameters, State, storage
from model.drag import LAWS
from model.kinematics import full_state

P, AT_REST, WORDS = Parameters.named("reference"), [0] * 6, {"mu": 0.2}
ROUGH, LEANS = P.replace(eta=0.6), Parameters.named("high-wall-friction")
SLOW, FAST = P.replace(omega_0=9.0), P.replace(omega_0=35.0)
BLUNT, BAD = P.replace(nu_f=5e-5, drag=LAWS[1]), (0, 5000, 1.5, math.nan)
TOO_FAST = "omega_c = 20 rad s-1 cannot be rolled at both points: it takes .* is 1"
EVERY, NU_F = (
    "every run needs parameters, a start and a flow",
    "needs the Reynolds number: nu_f in m2 s-1 ",
)


def runs(**given):
    return analytic.simulate(**{"p": P, "x0": [0, 0, 10.0, 0, 0, 0], "t_end": 0.1} | given)


def moves(**given):
    return mjsim.simulate(**{"p": P, "x0": [0, 0, 1, 0, 0, 0], "t_end": 1.0} | given)


TAKE_A_SET = (
    analytic.attractors,
    analytic.thresholds,
    analytic.stationary_solutions,
    *(analytic.operating_range, analytic.reading_range, analytic.mean_slope, analytic.slope_jump),
    lambda p: assert_settles([0, 1], [1, 1], p, rtol=0.1),
    lambda p: analytic.vector_field("RR", State(), p),
    lambda p: analytic.simulate(p, AT_REST, 1.0),
    lambda p: mjsim.simulate(p, AT_REST, 1.0),
    lambda p: many([p], [AT_REST], 1.0),
)
REFUSED = [
    # of another type
    *((lambda f=f: f(WORDS), "^p must be Parameters, not dict$") for f in TAKE_A_SET),
    (lambda: analytic.slowest_time_constant(P), "^of must be StationarySolution, not Parameters$"),
    (lambda: read(([0, 1], [1j, 1])), "omega_c must be a column of real numbers$"),
    (lambda: analytic.simulate(P, "rest", 1.0), "^a state must be numbers, not 'rest'$"),
    (lambda: analytic.simulate(P, AT_REST, 1.0, 25.0), "^flow must be Flow, not float$"),
    (lambda: runs(settings="fast"), "^settings must be Settings, not str$"),
    (lambda: simulate_many([P, WORDS], AT_REST, 1.0), "^parameters must be Parameters, not dict$"),
    (lambda: simulate_many(P, AT_REST, 1.0, [25.0]), "^flow must be Flow, not float$"),
    (lambda: analytic.attractors(P, "many"), "^a state must be numbers, not 'many'$"),
    (lambda: mjsim.simulate(P, "rest", 1.0), "^a state must be numbers, not 'rest'$"),
    (lambda: mjsim.simulate(P, AT_REST, 1.0, 25.0), "^flow must be Flow, not float$"),
    (lambda: moves(settings=""), "^settings must be RigidContacts or ContactSettings, not str$"),
    (lambda: many(P, [AT_REST], 1.0), "^parameters must be Sequence, not Parameters$"),
    (lambda: many([P], [AT_REST], 1.0, [0.0]), "^flow must be Flow, not float$"),
    (lambda: compare.validate("no", sets={"mine": WORDS}), "^sets must be Parameters, not dict$"),
    (
        lambda: Flow.steady("fast"),
        "^omega_0 of flow sample 0 = 'fast' must be a number in rad s-1$",
    ),
    (lambda: compare.validate("no", level="quick"), "^level must be Level, not str$"),
    (lambda: compare.validate("no", engine="mujoco"), "^engine must be Engine, not str$"),
    (lambda: compare.validate("no", sets=[P]), "^sets must be Mapping, not list$"),
    (lambda: storage.save("run", "no.h5"), "^run must be Trajectory, not str$"),
    (lambda: moves(x0=[[1], [2, 3]]), r"^a state must be numbers, not \[\[1\], \[2, 3\]\]$"),
    (lambda: Flow.sines(1, [(1, 2)]), "^each wave needs an amplitude, a frequency and a phase$"),
    # out of range: model
    *((lambda law=law: P.replace(drag=law), f"^drag = '{law}' {NU_F}") for law in LAWS[1:]),
    (
        lambda: P.replace(drag="quadratics"),
        r"^drag = 'quadratics' must be one of .* \(did you mean 'quadratic'\?\)$",
    ),
    (lambda: P.replace(density_ratio=1.5), r"^density_ratio = 1\.5 .* floats"),
    (lambda: P.replace(omega0=3.0), "did you mean 'omega_0'"),
    (lambda: Parameters.named("referense"), "did you mean 'reference'"),
    (lambda: full_state(np.zeros(7)), "6 entries"),
    (lambda: full_state(3.0), "6 entries"),
    (lambda: full_state([0, 0, np.nan, 0, 0, 0]), "omega_c = nan rad s-1 must be finite"),
    (lambda: full_state([0, np.inf, 0, 0, 0, 0, 0, 0]), "v_y = inf m s-1 must be finite"),
    (lambda: State.one(np.zeros((3, 8))), r"one state is needed, not an array of shape \(3, 8\)"),
    (lambda: Flow.steady(math.nan), "omega_0 of flow sample 0 = nan rad s-1 must be finite"),
    (lambda: Flow.ramp(1, 2, 0), "duration = 0 s"),
    (lambda: Flow.ramp(1, 2, 1, t_start=-1), "t_start = -1 s"),
    (lambda: Flow.staircase([1, 2], 0), "hold = 0 s"),
    (lambda: Flow.sampled([0, 1], [1]), "2 times but 1"),
    (lambda: Flow.sampled([0, 1, 1], [1, 2, 3]), "times must increase, but sample 2 is at 1 s"),
    (lambda: Flow.sampled([0, 1], [1.0, math.nan]), "omega_0 of flow sample 1 = nan"),
    (lambda: Flow.sine(1, 1, 0), "frequency of wave 0 = 0 Hz is out of range: must be > 0"),
    (lambda: Flow.sines(1, [(1, 1, 0), (math.nan, 1, 0)]), "amplitude of wave 1 = nan"),
    (lambda: Flow.from_mapping({"kind": "steady"}), "not a flow"),
    (lambda: Flow.from_mapping(Flow.steady(1.0).to_mapping() | {"waves": [1]}), "not a flow"),
    # analytic
    (lambda: number_of_folds(P.replace(eta=0.0)), "SS has a branch from RR"),
    (lambda: number_of_folds(P.replace(mu=0.0)), "SS has a branch from RR"),
    (lambda: number_of_folds(P.replace(c=0.0)), "SS has a branch from RR"),
    (lambda: number_of_folds(ROUGH), "SS has a branch from RR to SR for"),
    (lambda: hopf_places(ROUGH), r"eta = 0\.6 is out of range: SS has no whole branch"),
    (lambda: mean_slope(LEANS), r"eta = 0\.6 is out of range"),
    (
        lambda: solution(SLOW, Case.NR),
        r"case NR has no stable stationary solution at omega_0 = 9 rad s-1 \(mu",
    ),
    (lambda: solution(SLOW, Case.SS), "case SS has no stable stationary solution"),
    (lambda: solution(SLOW, Case.RR, stable=False), "case RR has no unstable stationary solution"),
    (lambda: solution(FAST, Case.NN), "case NN has no stable"),
    (lambda: eigenmodes_SR(LEANS.replace(omega_0=0.0)), "SR has no stationary solution that leans"),
    (lambda: eigenmodes_SR(LEANS.replace(mu=0.0)), "SR has no stationary solution that leans"),
    (
        lambda: characteristic_slope(FAST),
        "several branches at omega_0 = 35 rad s-1: choose SR, SS, NR",
    ),
    (
        lambda: characteristic_slope(P.replace(c=0.0)),
        "no motion follows the flow at omega_0 = 12 rad s-1 with c = 0",
    ),
    (lambda: response.ramp_coefficient(P.replace(eta=0.02)), "there is no fold"),
    (lambda: response.transfer(P, Case.SS, 1.0), "case SS has no stable"),
    (lambda: response.rolling_rate(BLUNT), "at one rate with Stokes' drag only"),
    (
        lambda: slip_stability.gamma(Case.RR, Case.SS, [0, 0, 1.0, 1.0, 0, 0], [0, 0, 1.0], P),
        "slip_x = 1 .* must be 0",
    ),
    (lambda: slip_bounds.gamma_nr(0.0, [0.1, 0, 9.0, 0, 0, 1.0], P), "slip_z = 1"),
    (
        lambda: slip_bounds.filippov_share(Case.SS, 9.0, P),
        "RR divides the states of RS and SR only",
    ),
    (lambda: analytic.contact_forces(Case.RR, [0, 0, 20.0, 0, 0, 0], P, 20.0), TOO_FAST),
    (
        lambda: analytic.vector_field(Case.RR, AT_REST, P, math.nan),
        "omega_0 = nan rad s-1 must be finite",
    ),
    (lambda: runs(x0=[-1e-3, 0, 0, 0, 0, 0]), "y = -0.001 m .* above the floor it must be >= 0"),
    (
        lambda: runs(x0=[*AT_REST, -1e-3, 0]),
        "h = -0.001 m .* between wall and axis it must be >= 0 and < 0.05",
    ),
    (lambda: runs(x0=[*AT_REST, 0, -0.2]), "v_h = -0.2 m s-1 .* wall"),
    (lambda: runs(x0=np.zeros((2, 6))), r"one state is needed, not .* \(2, "),
    (lambda: runs(t_end=0.0), "t_end = 0 s"),
    (lambda: runs(t_end=math.inf), "t_end = inf"),
    (lambda: runs(sample_interval=1e-12), "sample_interval = 1e-12 s .* samples"),
    (lambda: runs(theta_0=math.nan), "theta_0 = nan"),
    (
        lambda: runs(rtol=1e-16),
        r"rtol = 1e-16 is out of range: must be >= 2\.22\d*e-14 and <= 0\.01",
    ),
    (lambda: runs(restitution=1.5), "restitution = 1.5 .* <= 1"),
    (lambda: runs(timestep="fast"), "timestep = 'fast' must be a number"),
    (lambda: runs(method="events"), "method = 'events' .*did you mean 'event'"),
    (lambda: runs(leave_rolling="never"), "leave_rolling = 'never'"),
    (lambda: runs(initial_impact=1), "initial_impact = 1"),
    (lambda: runs(restituton=0.5), "unknown setting 'restituton' .*did you mean 'restitution'"),
    (lambda: simulate_many([P, P], np.zeros((3, 6)), 0.1), "2 parameter sets, 3 starts"),
    (lambda: simulate_many(P, [[-0.01, 0, 0, 0, 0, 0]], 0.1), "y = -0.01 m"),
    *((lambda n=n: simulate_many(P, AT_REST, 0.1, threads=n), f"threads = {n:g}") for n in BAD),
    (lambda: analytic.attractors(P, [[-1e-3, 0, 20, 0, 0, 0]]), "above the floor"),
    (lambda: analytic.attractors(P, [[0, 0, 20, 0, 0, 0, 1.0, 0]]), "h = 1 m"),
    (lambda: analytic.attractors(P, 0), "starts = 0"),
    (lambda: analytic.attractors(P, AT_REST, lasting=-1.0), "lasting = -1"),
    # no time constant to take it from
    (lambda: analytic.attractors(P.replace(c=0.0), 1), "lasting"),
    # mjsim
    (lambda: moves(x0=[-1, 0, 1, 0, 0, 0]), "y = -1 m is out of range"),
    (
        lambda: moves(x0=[0, 0, 1, 0, 0, 0, 0.06, 0]),
        r"h = 0.06 m is out of range: .* must be .*< 0.05",
    ),
    (lambda: moves(t_end=-1.0), "t_end = -1 s"),
    (lambda: moves(t_end=math.nan), "t_end"),
    (lambda: moves(t_end=1e300), r"t_end = 1e\+300 s .* for at most 1e\+15 steps it must"),
    (lambda: moves(settings=RigidContacts(timestep=0.5), sample_interval=0.01), "^timestep = 0.5"),
    (lambda: analytic.attractors(P, 1, seed=-1), "^seed = -1 is out of range"),
    (lambda: many([P], [[0, np.nan, 0, 0, 0, 0]], 1.0), "^v_y = nan m s-1 must be finite$"),
    (lambda: moves(sample_interval=1e-5), "sample_interval = 1e-05 s"),
    *((lambda n=n: many([P], [AT_REST], 0.1, threads=n), "^threads = ") for n in (*BAD, "2")),
    (lambda: many([P], [], 0.1), EVERY),
    (lambda: many([P] * 3, [AT_REST] * 3, 0.1, [Flow.steady(1.0)] * 2), EVERY),
    (lambda: RigidContacts(timestep=0.0), r"timestep = 0 s is out of range: must be > 0"),
    *(
        (lambda given=given: ContactSettings(**given), says)
        for given, says in (
            ({"timestep": 0.0}, r"timestep = 0 s is out of range: must be > 0"),
            (
                {"timestep": 2e-3},
                "timestep = 0.002 s is too large for the contact settings: .* at most 0.001 s",
            ),
            ({"solimp": 1.0}, r"solimp = 1 is out of range"),
            ({"impratio": 1e9}, r"impratio = 1e\+09"),
            ({"solref": (0.1,)}, r"solref = .* must be two numbers"),
            ({"cone": "eliptic"}, r"cone = 'eliptic' must be one of .*did you mean 'elliptic'"),
            ({"integrator": "RK4"}, r"integrator = 'RK4' must be one of"),
        )
    ),
    (
        lambda: ContactSettings.at(1e-3, solimpp=0.1),
        "unknown contact setting 'solimpp' .did you mean 'solimp'",
    ),
]


@pytest.mark.parametrize(("call", "says"), REFUSED)
def test_an_argument_of_another_type_or_out_of_range(call, says):
    with pytest.raises(InputError, match=says) as caught:
        call()
    assert "\n" not in str(caught.value)
