"""Times the peers on the chirp of 0.5 s, one thread, minimum over runs, and prints milliseconds.

    python time_peers.py [--runs 3] [--tsv] [ID ...]

The case: surface command 5 mrad * sin(2 pi * 15 t^2), EMA-48 with its position and speed cascade
at 10 kHz and its current loop, controller noise and digitisation off. The peers have neither dry
friction nor backlash, so they do less work than the project's simulator on the same command.
Only the simulation is timed: no import, no construction, no writing. A peer that is not
installed is a line that says so. --tsv prints case, version and least CPU time alone.
"""

import argparse
import cmath
import math
import os
import time
from importlib import metadata
from types import SimpleNamespace

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    from motulator.common.control import ControlSystem
    from motulator.drive import model
    from motulator.drive.utils import SynchronousMachinePars
except ImportError:
    ControlSystem = object
try:
    from progpy.models import ESC, DCMotor, Powertrain
    from progpy.models.esc import commutation
except ImportError:
    pass

# EMA-48: crates/ema-sim/src/presets.rs
RESISTANCE_OHM, INDUCTANCE_HENRY = 1.065, 360e-6
BACK_EMF_V_S_PER_RAD = 0.0376
TORQUE_CONSTANT = 2 * BACK_EMF_V_S_PER_RAD
POLE_PAIRS, GEAR, BUS_V = 4, 500.0, 48.0
INERTIA_KG_M2, VISCOUS = 2.5e-5 + 0.2 / GEAR**2, 3e-5
LOAD_N_M = 0.5 / GEAR / 0.85
DURATION_S, CASCADE_S, CARRIER_HZ = 0.5, 1e-4, 20e3
CURRENT_BANDWIDTH = 2 * math.pi * 1000.0


class Cascade:
    """Position and speed loop of EMA-48 with rigid gear; keeps the extremes as evidence."""

    def __init__(self):
        bandwidth = 2 * math.pi * 60.0
        self.gain = INERTIA_KG_M2 * bandwidth / TORQUE_CONSTANT
        self.integral_step = self.gain * bandwidth / 5.0 * CASCADE_S
        self.integral = self.peak_current = self.peak_error = self.peak_speed = 0.0

    def step(self, time_s, motor_rad, speed):
        error = 5e-3 * math.sin(2 * math.pi * 15.0 * time_s * time_s) - motor_rad / GEAR
        reference = max(-600.0, min(600.0, 60.0 * GEAR * error))
        wanted = self.gain * (reference - speed) + self.integral
        if abs(wanted) < 20.0:
            self.integral += self.integral_step * (reference - speed)
        current = max(-20.0, min(20.0, wanted))
        self.peak_current = max(self.peak_current, abs(current))
        self.peak_error = max(self.peak_error, abs(error))
        self.peak_speed = max(self.peak_speed, abs(speed))
        return current


class SixStepLoop:
    """Current loop of the six-step drive: voltage over half the bus, -1 to 1."""

    PERIOD_S = 1 / CARRIER_HZ

    def __init__(self):
        self.integral = 0.0

    def step(self, reference, current):
        error = reference - current
        wanted = 2 * INDUCTANCE_HENRY * CURRENT_BANDWIDTH * error + self.integral
        if abs(wanted) < BUS_V:
            self.integral += 2 * RESISTANCE_OHM * CURRENT_BANDWIDTH * self.PERIOD_S * error
        return max(-1.0, min(1.0, wanted / BUS_V))


def progpy_motor():
    return DCMotor(
        R=RESISTANCE_OHM, L=INDUCTANCE_HENRY, M=0.0, K=BACK_EMF_V_S_PER_RAD, B=VISCOUS,
        Po=2 * POLE_PAIRS, J=INERTIA_KG_M2,
    )


def progpy(advance, x, step_s):
    """Closed loop around ProgPy: `advance(x, voltage)` makes one step."""
    cascade, loop = Cascade(), SixStepLoop()
    per_period = round(SixStepLoop.PERIOD_S / step_s)
    electrical_rad, last, reference = 0.0, 0.0, 0.0
    for tick in range(round(DURATION_S / SixStepLoop.PERIOD_S)):
        theta = float(x["theta"])
        electrical_rad += (theta - last + math.pi) % (2 * math.pi) - math.pi
        last = theta
        if tick % 2 == 0:
            time_s = tick * SixStepLoop.PERIOD_S
            reference = cascade.step(time_s, electrical_rad / POLE_PAIRS, float(x["v_rot"]))
        pattern = commutation(theta)
        currents = (float(x["i_a"]), float(x["i_b"]), float(x["i_c"]))
        current = 0.5 * sum(s * i for s, i in zip(pattern, currents, strict=True))
        voltage = loop.step(reference, current)
        for _ in range(per_period):
            x = advance(x, voltage)
    return cascade


def progpy_carrier(step_s=1e-6):
    """Powertrain as shipped, carrier resolved by 50 Euler steps a period."""
    train = Powertrain(ESC(sawtooth_freq=CARRIER_HZ), progpy_motor(), c_q=0.0)
    u = train.InputContainer({"duty": 0.0, "v": 0.0})

    def advance(x, voltage):
        u["duty"], u["v"] = abs(voltage), math.copysign(0.5 * BUS_V, voltage)
        return train.next_state(x, u, step_s)

    x = train.initialize()
    return lambda: progpy(advance, x, step_s)


def progpy_averaged(step_s=1e-5):
    """Powertrain as shipped, averaged voltage, the step that its documentation names."""
    train = Powertrain(ESC(sawtooth_freq=CARRIER_HZ), progpy_motor(), c_q=0.0)
    u = train.InputContainer({"duty": 1.0, "v": 0.0})

    def advance(x, voltage):
        u["v"] = 0.5 * BUS_V * voltage
        return train.next_state(x, u, step_s)

    x = train.initialize()
    return lambda: progpy(advance, x, step_s)


def progpy_motor_alone(step_s=1e-5):
    """ProgPy's motor with averaged voltages set by the caller: the least that it can cost."""
    motor = progpy_motor()
    u = motor.InputContainer({"v_a": 0.0, "v_b": 0.0, "v_c": 0.0, "t_l": LOAD_N_M})

    def advance(x, voltage):
        for j, s in enumerate(commutation(float(x.matrix[4, 0]))):
            u.matrix[j, 0] = 0.5 * BUS_V * voltage * s
        return motor.next_state(x, u, step_s)

    x = motor.initialize()
    return lambda: progpy(advance, x, step_s)


class VectorControl(ControlSystem):
    """The cascade with current loops in rotor coordinates, in motulator's control interface."""

    def __init__(self, period_s):
        super().__init__(period_s)
        self.cascade, self.every = Cascade(), round(CASCADE_S / period_s)
        self.tick, self.reference, self.integral = 0, 0.0, 0j

    def get_feedback_signals(self, mdl):
        return SimpleNamespace(
            current=complex(mdl.machine.i_s),
            angle=cmath.phase(mdl.machine.state.exp_j_theta_m),
            motor_rad=mdl.mechanics.meas_position(),
            speed=mdl.mechanics.meas_speed(),
        )

    def output(self, fbk):
        ref = super().output(fbk)
        if self.tick % self.every == 0:
            time_s = self.tick * self.T_s
            self.reference = self.cascade.step(time_s, fbk.motor_rad, fbk.speed)
        error = 1j * self.reference - fbk.current
        voltage = INDUCTANCE_HENRY * CURRENT_BANDWIDTH * error + self.integral
        limit = 0.5 * BUS_V
        if abs(voltage) < limit:
            self.integral += RESISTANCE_OHM * CURRENT_BANDWIDTH * self.T_s * error
        else:
            voltage *= limit / abs(voltage)
        voltage *= cmath.exp(1j * fbk.angle)
        turned = (voltage * cmath.exp(-2j * math.pi / 3 * j) for j in range(3))
        ref.d_abc = [0.5 + v.real / BUS_V for v in turned]
        return ref

    def update(self, fbk, ref):
        super().update(fbk, ref)
        self.tick += 1

    def save(self, **kwargs):
        """Nothing, so that recording costs nothing."""

    def post_process(self):
        """Nothing to do."""


def motulator(period_s, pwm):
    pars = SynchronousMachinePars(
        n_p=POLE_PAIRS, R_s=RESISTANCE_OHM, L_d=INDUCTANCE_HENRY, L_q=INDUCTANCE_HENRY,
        psi_f=TORQUE_CONSTANT / 1.5 / POLE_PAIRS,
    )
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=BUS_V),
        model.SynchronousMachine(pars),
        model.StiffMechanicalSystem(J=INERTIA_KG_M2, B_L=VISCOUS, tau_L=lambda t: LOAD_N_M),
    )
    if pwm is not None:
        drive.pwm = pwm
    control = VectorControl(period_s)
    simulation = model.Simulation(drive, control)

    def run():
        simulation.simulate(t_stop=DURATION_S - 0.5 * period_s)
        return control.cascade

    return run


def motulator_carrier():
    """Carrier of 20 kHz, each edge where it falls; loops at both turning points."""
    return motulator(0.5 / CARRIER_HZ, model.CarrierComparison())


def motulator_averaged():
    """Averaged voltages, held for 50 us: motulator's default."""
    return motulator(1 / CARRIER_HZ, None)


CASES = {
    "progpy/powertrain/carrier/step=1us": progpy_carrier,
    "progpy/powertrain/averaged/step=10us": progpy_averaged,
    "progpy/motor/averaged/step=10us": progpy_motor_alone,
    "motulator/carrier": motulator_carrier,
    "motulator/averaged": motulator_averaged,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--tsv", action="store_true")
    parser.add_argument("ids", nargs="*")
    wanted = parser.parse_args()
    columns = ("case", "ms, least", "CPU ms, least", "ms, all runs")
    evidence = ("peak A", "peak rad/s", "peak error mrad")
    if not wanted.tsv:
        print("| " + " | ".join(columns + evidence) + " |")
        print("|---" * len(columns + evidence) + "|")
    for name, make in CASES.items():
        if wanted.ids and name not in wanted.ids:
            continue
        package = name.split("/")[0]
        try:
            version = metadata.version(package)
        except metadata.PackageNotFoundError:
            print(f"{name}\t-\t-" if wanted.tsv else f"| {name} | not installed |", flush=True)
            continue
        spans, cpu = [], []
        for _ in range(wanted.runs):
            run = make()
            begin, begin_cpu = time.perf_counter(), time.process_time()
            seen = run()
            spans.append(1e3 * (time.perf_counter() - begin))
            cpu.append(1e3 * (time.process_time() - begin_cpu))
        if wanted.tsv:
            print(f"{name}\t{version}\t{min(cpu):.3f}", flush=True)
            continue
        every = " ".join(f"{span:.0f}" for span in spans)
        print(
            f"| {name} | {min(spans):.0f} | {min(cpu):.0f} | {every} | {seen.peak_current:.3f} "
            f"| {seen.peak_speed:.2f} | {1e3 * seen.peak_error:.3f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
