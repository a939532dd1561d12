//! Problems that no method was developed on. Their protocol is
//! `docs/decisions/0032-held-out-inverse-problems.md`.

use std::f64::consts::TAU;

use gp_bayesopt::{Bounds, Design};

use crate::bayesopt::{Chart, Problem};

const SEEDS: usize = 50;

/// Both problems.
pub fn held_out() -> Vec<Problem> {
    vec![frame(), wall()]
}

/// Truths drawn uniformly between limits.
fn truths(lower: &[f64], upper: &[f64], seed: u64) -> Vec<Vec<f64>> {
    let bounds = Bounds::new(lower, upper).expect("a box");
    Design::LatinHypercube.points(&bounds, SEEDS, seed).expect("a design")
}

/// Stiffness losses of a six-storey frame from its frequency response.
///
/// Unit masses on springs `k₀·(1 − 0.9·x_i)`, 2 % modal-like damping
/// (complex stiffness), harmonic force at the top; thirty log amplitudes of
/// the top and third floors between 0.05 and 1 times the highest frequency of
/// the sound frame.
fn frame() -> Problem {
    let bounds = Bounds::unit(6).expect("a cube");
    let nominal = vec![0.05; 6];
    Problem {
        name: "frame",
        simulate: frame_response,
        truths: truths(&[0.02; 6], &[0.3; 6], 101),
        near: vec![(2.0, 0.5); 6],
        chart: Chart::identity(&bounds, &nominal),
        nominal,
        bounds,
    }
}

/// A complex number.
type Complex = (f64, f64);

fn times(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn over(a: Complex, b: Complex) -> Complex {
    let size = b.0 * b.0 + b.1 * b.1;
    ((a.0 * b.0 + a.1 * b.1) / size, (a.1 * b.0 - a.0 * b.1) / size)
}

fn minus(a: Complex, b: Complex) -> Complex {
    (a.0 - b.0, a.1 - b.1)
}

/// `ln |u|` of two floors at fifteen frequencies.
fn frame_response(loss: &[f64]) -> Vec<f64> {
    let spring: Vec<Complex> = loss
        .iter()
        .map(|x| {
            let k = 1.0 - 0.9 * x;
            (k, 0.04 * k)
        })
        .collect();
    (0..15)
        .flat_map(|i| {
            let omega = 2.0 * (0.05 + 0.95 * f64::from(i) / 14.0);
            let u = floors(&spring, omega * omega);
            [u[5], u[2]].map(|(re, im)| 0.5 * (re * re + im * im).ln())
        })
        .collect()
}

/// Thomas's algorithm on `(K − ω²·I)·u = e_top`.
fn floors(spring: &[Complex], omega2: f64) -> Vec<Complex> {
    let n = spring.len();
    let mut pivot = vec![(0.0, 0.0); n];
    let mut right = vec![(0.0, 0.0); n];
    right[n - 1] = (1.0, 0.0);
    for i in 0..n {
        let above = if i + 1 < n { spring[i + 1] } else { (0.0, 0.0) };
        pivot[i] = (spring[i].0 + above.0 - omega2, spring[i].1 + above.1);
        if i > 0 {
            // off-diagonal −k_i
            let factor = over((-spring[i].0, -spring[i].1), pivot[i - 1]);
            pivot[i] = minus(pivot[i], times(factor, (-spring[i].0, -spring[i].1)));
            right[i] = minus(right[i], times(factor, right[i - 1]));
        }
    }
    let mut u = vec![(0.0, 0.0); n];
    for i in (0..n).rev() {
        let mut rest = right[i];
        if i + 1 < n {
            rest = minus(rest, times((-spring[i + 1].0, -spring[i + 1].1), u[i + 1]));
        }
        u[i] = over(rest, pivot[i]);
    }
    u
}

/// Conduction through a wall of three layers, from temperatures inside it.
///
/// Inputs, on logarithmic scales between a tenth and ten times their middle:
/// three conductivities, the heat transfer at the warm side, and the
/// resistance between the second and third layer. Outside temperature is a step
/// plus a swing; twenty-four temperatures at four depths and six times.
fn wall() -> Problem {
    let bounds = Bounds::unit(5).expect("a cube");
    let nominal = vec![0.5; 5];
    Problem {
        name: "wall",
        simulate: wall_temperatures,
        truths: truths(&[0.2; 5], &[0.8; 5], 102),
        near: vec![(1.0, 1.0); 5],
        chart: Chart::identity(&bounds, &nominal),
        nominal,
        bounds,
    }
}

/// Cells of each layer.
const CELLS: usize = 8;

/// Time steps, implicit Euler over four units of time.
const STEPS: usize = 120;

fn wall_temperatures(u: &[f64]) -> Vec<f64> {
    let n = 3 * CELLS;
    let value: Vec<f64> = u.iter().map(|u| 100_f64.powf(u - 0.5)).collect();
    let dx = 1.0 / n as f64;
    // conductance from cell i − 1 to cell i; the ends are the two sides
    let half = |i: usize| 0.5 * dx / (0.3 * value[i / CELLS]);
    let mut conductance = vec![0.0; n + 1];
    conductance[0] = 1.0 / (half(0) + 0.2 / value[3]);
    for (i, c) in conductance.iter_mut().enumerate().take(n).skip(1) {
        let contact = if i == 2 * CELLS { 0.1 * value[4] } else { 0.0 };
        *c = 1.0 / (half(i - 1) + half(i) + contact);
    }
    conductance[n] = 1.0 / half(n - 1);
    let dt = 4.0 / STEPS as f64;
    let capacity = dx / dt;
    let mut temperature = vec![0.0; n];
    let mut record = Vec::new();
    for step in 1..=STEPS {
        let outside = 1.0 + 0.5 * (TAU * 0.4 * dt * step as f64).sin();
        temperature = implicit_step(&conductance, capacity, &temperature, outside);
        if step % (STEPS / 6) == 0 {
            record.extend([2, 9, 14, 20].map(|cell| temperature[cell]));
        }
    }
    record
}

/// One implicit step, the cold side held at zero.
fn implicit_step(g: &[f64], capacity: f64, before: &[f64], outside: f64) -> Vec<f64> {
    let n = before.len();
    let (mut pivot, mut right) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        pivot[i] = capacity + g[i] + g[i + 1];
        right[i] = capacity * before[i] + if i == 0 { g[0] * outside } else { 0.0 };
        if i > 0 {
            let factor = g[i] / pivot[i - 1];
            pivot[i] -= factor * g[i];
            right[i] += factor * right[i - 1];
        }
    }
    let mut after = vec![0.0; n];
    for i in (0..n).rev() {
        let rest = if i + 1 < n { g[i + 1] * after[i + 1] } else { 0.0 };
        after[i] = (right[i] + rest) / pivot[i];
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The response of one spring and one mass, worked by hand:
    /// |1/(k(1+0.04i) − ω²)|.
    #[test]
    fn law_one_storey() {
        let u = floors(&[(0.8, 0.032)], 0.3);
        let size = u[0].0.hypot(u[0].1);
        assert!((size - 1.0 / 0.5_f64.hypot(0.032)).abs() < 1e-14);
    }

    /// After a long time without a swing the flux is the same everywhere.
    #[test]
    fn law_steady_wall_carries_one_flux() {
        let g = vec![2.0, 1.0, 4.0, 3.0];
        let mut t = vec![0.0; 3];
        for _ in 0..4000 {
            t = implicit_step(&g, 1.0, &t, 1.0);
        }
        let flux = [g[0] * (1.0 - t[0]), g[1] * (t[0] - t[1]), g[2] * (t[1] - t[2]), g[3] * t[2]];
        for f in flux {
            assert!((f - flux[0]).abs() < 1e-12, "{flux:?}");
        }
    }
}
