//! What must hold whatever the numbers: orders of convergence, reciprocity, superposition, energy,
//! equal answers by blocks and by single steps, the truck's closed-form frequency response, and
//! no panic and no NaN for any input.

// A test says what went wrong by failing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use nalgebra::{Complex, DVector, SymmetricEigen};
use pavefem_core::asphalt;
use pavefem_core::error::{Error, Result};
use pavefem_core::linalg::DMatrix;
use pavefem_core::pavement::{Bed, Ends, Foundation, Section, Strip, Weights};
use pavefem_core::response::{Hold, Keep, Loads, Record, Stepper};
use pavefem_core::roughness::{BASE, START, iri};
use pavefem_core::transition::{Form, System, Transition};
use pavefem_core::vehicle::{
    Body, Friction, GRAVITY, Interpolation, Point, Profile, Run, Spring, Tire, Vehicle,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const BOTH: [Hold; 2] = [Hold::Zero, Hold::First];

/// The paper's pavement.
fn section(length: f64) -> Section {
    let bed = Bed { stiffness: 8.65e7, damping: 2.8e5, mass: 355.0 / 1.5 };
    Section { length, bending_stiffness: 1.97335e5, bending_damping: 1750.0, mass: 2000.0, bed }
}

fn strip(length: f64, foundation: Foundation, ends: Ends) -> Strip {
    Strip::new(&[section(length)], 0.5, foundation, ends).unwrap()
}

fn transition(system: &System, dt: f64) -> Transition {
    Transition::new(system.clone(), dt, Form::Integral, &mut |_, _| true).unwrap()
}

/// Axle forces along a road, row by row of instants.
struct Passage {
    axles: usize,
    positions: Vec<f64>,
    forces: Vec<f64>,
}

impl Passage {
    /// Places and forces by time.
    fn of(dt: f64, instants: usize, axles: &[&dyn Fn(f64) -> (f64, f64)]) -> Self {
        let rows =
            (0..instants).flat_map(|step| axles.iter().map(move |axle| axle(step as f64 * dt)));
        let (positions, forces) = rows.unzip();
        Self { axles: axles.len(), positions, forces }
    }

    fn run(&self, strip: &Strip, dt: f64, scheme: (Weights, Hold), keep: &Keep) -> Record {
        let stepper = Stepper::new(
            strip.clone(),
            transition(strip.system(), dt),
            scheme,
            keep,
            &mut |_, _| true,
        );
        let Self { axles, positions, forces } = self;
        let loads = Loads { axles: *axles, positions, forces };
        stepper.unwrap().run(&loads, &mut |_, _| true).unwrap()
    }
}

fn stations(stations: &[f64]) -> Keep {
    Keep::deflection(false, stations, 1)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |largest, (a, b)| (a - b).abs().max(largest))
}

fn root_mean_square(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// The observed orders of errors at halved steps.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

// --- the pavement ---------------------------------------------------------------------------

/// Histories at all common instants, not their peaks: these shift with the step, and a peak between
/// two instants is missed by the second order anyhow.
#[test]
fn order_of_each_hold() {
    let road = strip(8.0, Foundation::Winkler, Ends::Clamped);
    // It passes five nodes; it grows from nothing and is gone before the end.
    let axle = |t: f64| (1.3 + 18.0 * t, 4e4 * (1.0 - (20.0 * std::f64::consts::PI * t).cos()));
    let history = |hold: Hold, every: usize| {
        let dt = 1e-3 / every as f64;
        let keep = Keep::deflection(false, &[2.0, 2.2, 3.0, 4.1], every);
        let passage = Passage::of(dt, 150 * every + 1, &[&axle]);
        passage.run(&road, dt, (Weights::Hermite, hold), &keep).history
    };
    let exact = history(Hold::First, 32);
    for (hold, order) in [(Hold::Zero, 1.0), (Hold::First, 2.0)] {
        let errors = [1, 2, 4].map(|every| root_mean_square(&history(hold, every), &exact));
        for found in orders(&errors) {
            assert!((found - order).abs() < 0.1, "{hold:?}: order {found} of {errors:?}");
        }
    }
}

/// Maxwell and Betti, for the motion too: `M`, `C` and `K` are symmetric.
#[test]
fn reciprocity() {
    let road = strip(7.0, Foundation::Winkler, Ends::Pinned);
    let bars = strip(7.0, Foundation::Bars, Ends::Clamped);
    let (a, b) = (1.83, 4.4);
    let knock = |t: f64| 3e4 * (900.0 * t).sin() * (200.0 * t).cos();
    for road in [road, bars] {
        for hold in BOTH {
            let deflection = |at: f64, from: f64| {
                let passage = Passage::of(1e-3, 300, &[&|t| (from, knock(t))]);
                passage.run(&road, 1e-3, (Weights::Hermite, hold), &stations(&[at])).history
            };
            let (here, there) = (deflection(a, b), deflection(b, a));
            assert!(largest(&here) > 1e-7);
            assert!(largest_difference(&here, &there) < 1e-12 * largest(&deflection(a, a)));
        }
    }
}

#[test]
fn superposition_and_linearity() {
    let road = strip(10.0, Foundation::Bars, Ends::Clamped);
    let front = |t: f64| (18.0 * t, 4e4 + 1e4 * (30.0 * t).sin());
    let rear = |t: f64| (18.0 * t - 1.3, 7e4);
    let both_scaled = |t: f64| (18.0 * t, -2.5 * (4e4 + 1e4 * (30.0 * t).sin()));
    let keep = Keep::deflection(true, &[3.3], 1);
    for scheme in [(Weights::Linear, Hold::Zero), (Weights::Hermite, Hold::First)] {
        let history = |axles: &[&dyn Fn(f64) -> (f64, f64)]| {
            Passage::of(1e-3, 640, axles).run(&road, 1e-3, scheme, &keep).history
        };
        let together = history(&[&front, &rear]);
        let (front, rear) = (history(&[&front]), history(&[&rear]));
        let sum: Vec<f64> = front.iter().zip(&rear).map(|(a, b)| a + b).collect();
        assert!(largest_difference(&together, &sum) < 1e-13 * largest(&sum));
        let scaled: Vec<f64> = front.iter().map(|w| -2.5 * w).collect();
        assert!(largest_difference(&history(&[&both_scaled]), &scaled) < 1e-13 * largest(&scaled));
    }
}

#[test]
fn the_matrices_are_symmetric_and_positive() {
    for foundation in [Foundation::Bars, Foundation::Winkler] {
        for ends in [Ends::Clamped, Ends::Pinned, Ends::Free] {
            let mut soft = section(2.0);
            soft.bending_stiffness *= 0.1;
            soft.bed.stiffness *= 3.0;
            let road = Strip::new(&[section(3.0), soft], 0.45, foundation, ends).unwrap();
            let System { mass, damping, stiffness } = road.system();
            for (name, matrix) in [("M", mass), ("C", damping), ("K", stiffness)] {
                let matrix = matrix.to_dense();
                assert_eq!(matrix, matrix.transpose(), "{name}");
                assert!(matrix.cholesky().is_some(), "{name}, {foundation:?}, {ends:?}");
            }
        }
    }
}

/// The unknowns of a road at each instant, by `Phi`, `Gamma` and the response to a ramp, and the
/// nodal forces that move it.
struct StepByStep {
    states: Vec<DVector<f64>>,
    forces: Vec<DVector<f64>>,
}

fn step_by_step(
    road: &Strip,
    dt: f64,
    (weights, hold): (Weights, Hold),
    passage: &Passage,
) -> StepByStep {
    let transition = transition(road.system(), dt);
    let (phi, gamma, ramp) = (transition.phi().to_dense(), transition.gamma(), transition.ramp());
    let n = road.system().len();
    let rows = passage.positions.chunks_exact(passage.axles);
    let forces: Vec<DVector<f64>> = rows
        .zip(passage.forces.chunks_exact(passage.axles))
        .map(|(positions, forces)| {
            let mut nodal = DVector::zeros(n);
            for (x, force) in positions.iter().zip(forces) {
                let Some(shares) = road.shares(*x, weights) else { continue };
                for (unknown, weight) in shares.unknowns.into_iter().zip(shares.weights) {
                    if let Some(unknown) = unknown {
                        nodal[unknown] -= 0.5 * force * weight;
                    }
                }
            }
            nodal
        })
        .collect();
    let mut states = vec![DVector::zeros(2 * n)];
    for pair in forces.windows(2) {
        let mut next = &phi * &states[states.len() - 1] + &gamma * &pair[0];
        if hold == Hold::First {
            next += &ramp * (&pair[1] - &pair[0]);
        }
        states.push(next);
    }
    StepByStep { states, forces }
}

#[test]
fn blocks_of_steps_equal_single_steps() {
    let dt = 1e-3;
    // Axles that come, go and turn back between nodes and beyond both ends.
    let axles: [&dyn Fn(f64) -> (f64, f64); 3] = [
        &|t| (40.0 * t - 0.7, 4e4 * (1.0 + 0.3 * (90.0 * t).sin())),
        &|t| (3.0 + 4.0 * (11.0 * t).sin(), 6e4 * (37.0 * t).cos()),
        &|_| (0.9, 5e4),
    ];
    for (length, foundation, ends) in [
        (1.0, Foundation::Bars, Ends::Clamped),
        (1.0, Foundation::Winkler, Ends::Free),
        (1.5, Foundation::Winkler, Ends::Pinned),
        (6.5, Foundation::Bars, Ends::Clamped),
        (17.5, Foundation::Winkler, Ends::Free),
    ] {
        let road = strip(length, foundation, ends);
        let extra: Vec<f64> = [0.0, 0.31, 0.5, 0.77, 1.0].map(|part| part * length).into();
        for (weights, hold) in [
            (Weights::Linear, Hold::Zero),
            (Weights::Hermite, Hold::Zero),
            (Weights::Linear, Hold::First),
            (Weights::Hermite, Hold::First),
        ] {
            for instants in [1, 2, 3, 4, 5, 7, 8, 255, 256, 257, 258, 260, 513, 600] {
                if instants > 5 && instants != 257 && length > 10.0 {
                    continue;
                }
                let passage = Passage::of(dt, instants, &axles);
                let keep = Keep::deflection(true, &extra, 1);
                let record = passage.run(&road, dt, (weights, hold), &keep);
                let single = step_by_step(&road, dt, (weights, hold), &passage);
                let places = || road.nodes().iter().chain(&extra);
                let expected: Vec<f64> = single
                    .states
                    .iter()
                    .flat_map(|state| {
                        places().map(|x| {
                            road.shares(*x, Weights::Hermite).unwrap().read(state.as_slice())
                        })
                    })
                    .collect();
                let error = largest_difference(&record.history, &expected);
                assert!(
                    error <= 1e-12 * largest(&expected),
                    "{length} m, {weights:?}, {hold:?}, {instants} instants: {error:.1e}"
                );
            }
        }
    }
}

#[test]
fn what_is_kept() {
    let road = strip(8.0, Foundation::Bars, Ends::Clamped);
    let passage = Passage::of(
        1e-3,
        571,
        &[&|t| (18.0 * t, 8e4), &|t| (18.0 * t - 1.3, 6e4 * (40.0 * t).sin())],
    );
    let scheme = (Weights::Linear, Hold::Zero);
    let full = passage.run(&road, 1e-3, scheme, &Keep::deflection(true, &[], 1));
    let nodes = road.nodes().len();
    let instants = 571;
    assert_eq!(full.history.len(), nodes * instants);
    // The envelope is that of the full history.
    for node in 0..nodes {
        let of_node: Vec<f64> = full.history.iter().skip(node).step_by(nodes).copied().collect();
        let lowest = of_node.iter().copied().fold(0.0, f64::min);
        let highest = of_node.iter().copied().fold(0.0, f64::max);
        assert_eq!(full.envelope.lowest[node], lowest);
        assert_eq!(full.envelope.highest[node], highest);
        assert_eq!(of_node[full.envelope.lowest_step[node]], lowest);
        let first = of_node.iter().position(|w| *w == lowest).unwrap();
        assert_eq!(full.envelope.lowest_step[node], first);
    }
    // Every n-th instant, the first included; stations in the order given, each by itself.
    let places = [3.3, 0.0, 7.5, 3.3];
    let dense = passage.run(&road, 1e-3, scheme, &stations(&places));
    for every in [1, 2, 3, 4, 100, 570, 571, 5000] {
        for with_nodes in [false, true] {
            let keep = Keep::deflection(with_nodes, &places, every);
            let thin = passage.run(&road, 1e-3, scheme, &keep);
            assert_eq!(thin.envelope, full.envelope);
            let width = places.len() + if with_nodes { nodes } else { 0 };
            assert_eq!(thin.history.len(), instants.div_ceil(every) * width);
            for (row, kept) in thin.history.chunks_exact(width).enumerate() {
                let step = row * every;
                let expected = &dense.history[step * places.len()..(step + 1) * places.len()];
                // The same sum, but for the place in the product that a probe has.
                let scale = 1e-14 * largest(&dense.history);
                assert!(largest_difference(&kept[width - places.len()..], expected) <= scale);
                if with_nodes {
                    let expected = &full.history[step * nodes..(step + 1) * nodes];
                    assert!(largest_difference(&kept[..nodes], expected) <= scale);
                }
            }
        }
    }
    let nothing = Keep::deflection(false, &[], 1);
    let bare = passage.run(&road, 1e-3, scheme, &nothing);
    assert!(bare.history.is_empty());
    assert_eq!(bare.envelope, full.envelope);
}

/// The work of the force less the energy held and lost, over the work.
fn energy_defect(road: &Strip, dt: f64, seconds: f64) -> f64 {
    let instants = (seconds / dt).round() as usize + 1;
    let axle = |t: f64| (1.2 + 18.0 * t, 4e4 * (1.0 - (60.0 * t).cos()));
    let passage = Passage::of(dt, instants, &[&axle]);
    let single = step_by_step(road, dt, (Weights::Hermite, Hold::Zero), &passage);
    let n = road.system().len();
    let System { mass, damping, stiffness } = road.system();
    let [mass, damping, stiffness] = [mass, damping, stiffness].map(|m| m.to_dense());
    let form = |matrix: &DMatrix<f64>, x: &DVector<f64>| x.dot(&(matrix * x));
    let part = |state: &DVector<f64>, from: usize| state.rows(from, n).into_owned();
    let (mut work, mut lost) = (0.0, 0.0);
    for (pair, force) in single.states.windows(2).zip(&single.forces) {
        // The force and its place stand still within a step: its work is exact.
        work += force.dot(&(part(&pair[1], 0) - part(&pair[0], 0)));
        let power = |state: &DVector<f64>| form(&damping, &part(state, n));
        lost += 0.5 * dt * (power(&pair[0]) + power(&pair[1]));
    }
    let end = &single.states[instants - 1];
    let held = 0.5 * (form(&mass, &part(end, n)) + form(&stiffness, &part(end, 0)));
    assert!(work > 0.0 && held > 1e-3 * work);
    (work - held - lost) / work
}

#[test]
fn energy_balance() {
    // Without damping it is exact, whatever the step.
    let mut free = section(6.0);
    free.bending_damping = 0.0;
    free.bed.damping = 0.0;
    let road = Strip::new(&[free], 0.5, Foundation::Winkler, Ends::Clamped).unwrap();
    for dt in [4e-3, 1e-3, 1e-4] {
        let defect = energy_defect(&road, dt, 0.1);
        assert!(defect.abs() < 1e-11, "dt {dt}: {defect:.1e}");
    }
    // With it, the rule that sums what is lost errs with the square of the step.
    let road = strip(6.0, Foundation::Winkler, Ends::Clamped);
    let defects = [4e-4, 2e-4, 1e-4].map(|dt| energy_defect(&road, dt, 0.1).abs());
    assert!(defects[2] < 1e-3, "{defects:?}");
    for order in orders(&defects) {
        assert!((order - 2.0).abs() < 0.2, "order {order} of {defects:?}");
    }
}

// --- the vehicle ----------------------------------------------------------------------------

const AXLES: [f64; 3] = [0.0, 4.55, 5.85];
const PIVOT: f64 = 5.22174;
const CENTRE: f64 = 4.21102;

/// The paper's truck.
fn truck() -> Vehicle {
    truck_with(AXLES, PIVOT)
}

/// A truck like it: sprung mass, steer axle, tandem axles, equalizing beam.
fn truck_with(axles: [f64; 3], pivot: f64) -> Vehicle {
    let body = |mass, inertia, x, pin| Body { mass, inertia, x, pin };
    let bodies = [
        body(17_400.0, 8e4, CENTRE, None),
        body(600.0, 0.0, axles[0], None),
        body(1000.0, 0.0, axles[1], None),
        body(1000.0, 0.0, axles[2], None),
        body(0.0, 100.0, pivot, Some((0, pivot))),
    ];
    let spring = |upper, axle: usize, stiffness, damping| {
        let x = axles[axle];
        let (upper, lower) = (Point { body: upper, x }, Point { body: axle + 1, x });
        Spring::between(upper, lower, stiffness, damping)
    };
    let springs = [spring(0, 0, 1e6, 1e4), spring(4, 1, 2e6, 5e4), spring(4, 2, 2e6, 5e4)];
    let tires = [0, 1, 2].map(|axle| {
        let point = Point { body: axle + 1, x: axles[axle] };
        Tire::at(point, if axle == 0 { 1.75e6 } else { 3.5e6 }, 1e4)
    });
    Vehicle::new(&bodies, &springs, &tires).unwrap()
}

/// Romero Navarrete et al., section IV and Table II. The printed loads add up to 2 N less than the
/// weight of 20 t, and the last digit of the pivot's place is worth 1 N.
#[test]
fn static_loads_and_modes_of_the_papers_truck() {
    let truck = truck();
    for (load, expected) in truck.static_loads().iter().zip([38_925.0, 76_335.0, 80_938.0]) {
        assert!((load - expected).abs() < 1.5, "{load} against {expected}");
    }
    let total: f64 = truck.static_loads().iter().sum();
    assert!((total - 20_000.0 * GRAVITY).abs() < 1e-7, "{total}");
    // K x = omega^2 M x, made symmetric by the Cholesky factor of M.
    let lower = truck.system().mass.to_dense().cholesky().unwrap().l();
    let inverse = lower.try_inverse().unwrap();
    let stiffness = &inverse * truck.system().stiffness.to_dense() * inverse.transpose();
    let mut hertz: Vec<f64> = SymmetricEigen::new(stiffness)
        .eigenvalues
        .iter()
        .map(|square| square.sqrt() / std::f64::consts::TAU)
        .collect();
    hertz.sort_by(f64::total_cmp);
    for (found, expected) in hertz.iter().zip([2.0700, 2.1335, 8.8021, 10.8981, 11.9158, 22.1452]) {
        assert!((found - expected).abs() < 1e-4, "{hertz:?}");
    }
}

/// `M`, `C`, `K` written out by hand for `(z_s, theta_s, z_F, z_TF, z_TR, theta_e)`.
fn truck_by_hand() -> [DMatrix<f64>; 3] {
    let mass = DMatrix::from_diagonal(&DVector::from_vec(vec![
        17_400.0, 8e4, 600.0, 1000.0, 1000.0, 100.0,
    ]));
    let pivot = PIVOT - CENTRE;
    // What stretches each spring: three suspensions, three tires.
    let rows = [
        [1.0, AXLES[0] - CENTRE, -1.0, 0.0, 0.0, 0.0],
        [1.0, pivot, 0.0, -1.0, 0.0, AXLES[1] - PIVOT],
        [1.0, pivot, 0.0, 0.0, -1.0, AXLES[2] - PIVOT],
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    ];
    let sum = |factors: [f64; 6]| {
        let mut matrix = DMatrix::zeros(6, 6);
        for (row, factor) in rows.iter().zip(factors) {
            let row = DVector::from_row_slice(row);
            matrix += &row * row.transpose() * factor;
        }
        matrix
    };
    [mass, sum([1e4, 5e4, 5e4, 1e4, 1e4, 1e4]), sum([1e6, 2e6, 2e6, 1.75e6, 3.5e6, 3.5e6])]
}

#[test]
fn matrices_of_the_papers_truck() {
    let truck = truck();
    let System { mass, damping, stiffness } = truck.system();
    for (found, expected) in [mass, damping, stiffness].iter().zip(truck_by_hand()) {
        assert!((found.to_dense() - &expected).amax() < 1e-15 * expected.amax());
    }
}

/// A sine of the road makes sines of the tire forces: amplitude and phase by the complex stiffness
/// matrix `K + i omega C - omega^2 M`.
#[test]
fn frequency_response_of_the_truck() {
    let [mass, damping, stiffness] = truck_by_hand().map(|m| m.map(Complex::from));
    let truck = truck();
    let (speed, dt) = (20.0, 1e-3);
    let amplitude = 2e-3;
    for wavelength in [1.7, 5.0, 9.5] {
        // Every axle is half way between two samples at each instant: both the elevation and the
        // slope of the chord then err by the second order.
        let spacing = 0.01;
        let number = std::f64::consts::TAU / wavelength;
        let omega = Complex::new(0.0, number * speed);
        let seconds = 30.0;
        let samples = (speed * seconds / spacing) as usize + 10;
        let x: Vec<f64> = (0..samples).map(|i| i as f64 * spacing).collect();
        let z: Vec<f64> = x.iter().map(|x| amplitude * (number * x).sin()).collect();
        let profile = Profile::new(&x, &z, Interpolation::Linear).unwrap();
        let steps = 2000;
        let skip = (seconds / dt) as usize - steps;
        let run =
            Run { speed, dt, start: 0.5 * spacing, skip, steps, lift_off: false, tolerance: 1e-4 };
        let forces = truck.tire_forces(&profile, &run, &mut |_, _| true).unwrap();

        let tires = [1.75e6, 3.5e6, 3.5e6].map(|k| Complex::from(k) + omega * 1e4);
        let road = AXLES.map(|x| Complex::new(0.0, -number * x).exp() * amplitude);
        let mut right = DVector::from_element(6, Complex::from(0.0));
        for axle in 0..3 {
            right[2 + axle] = tires[axle] * road[axle];
        }
        let dynamic = &stiffness + &damping * omega + &mass * (omega * omega);
        let motion = dynamic.lu().solve(&right).unwrap();
        for axle in 0..3 {
            let response = tires[axle] * (road[axle] - motion[2 + axle]);
            let mut error = 0.0_f64;
            for kept in 0..=steps {
                let place = run.start + speed * dt * (skip + kept) as f64;
                // A sine is the imaginary part of the rotating pointer.
                let expected = (response * Complex::new(0.0, number * place).exp()).im;
                let found = forces[3 * kept + axle] - truck.static_loads()[axle];
                error = error.max((found - expected).abs() / response.norm());
            }
            // Chords in space and in time, (pi length / wavelength)^2 / 6 of a sine and less of a
            // force, which near a resonance the truck amplifies a few times.
            let chord = (std::f64::consts::PI * speed * dt / wavelength).powi(2) / 6.0;
            assert!(error < 5.0 * chord, "wavelength {wavelength}, axle {axle}: {error:.2e}");
        }
    }
}

/// A rough road, 0.3 m between its kinks, by a sum of sines without a common period.
fn rough(samples: usize, spacing: f64) -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..samples).map(|i| i as f64 * spacing).collect();
    let z = x
        .iter()
        .map(|x| 4e-3 * (0.9 * x).sin() + 2e-3 * (2.3 * x + 1.0).sin() + 1e-3 * (7.1 * x).cos())
        .collect();
    (x, z)
}

/// Tire forces at every n-th instant of steps that are as much shorter.
fn forces(
    truck: &Vehicle,
    profile: &Profile<'_>,
    (speed, dt): (f64, f64),
    every: usize,
    steps: usize,
) -> Vec<f64> {
    let run = Run {
        speed,
        dt: dt / every as f64,
        start: 0.0,
        skip: 0,
        steps: steps * every,
        lift_off: false,
        tolerance: 1e-4,
    };
    let all = truck.tire_forces(profile, &run, &mut |_, _| true).unwrap();
    all.chunks_exact(3).step_by(every).flatten().copied().collect()
}

#[test]
fn order_of_the_tire_forces_in_the_step() {
    let (x, z) = rough(400, 0.3);
    for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        // Speeds at which kinks and jumps fall anywhere within the steps, and their errors average.
        let mut errors = [0.0; 4];
        for speed in [17.123, 18.677, 20.331, 21.939] {
            let history = |every| forces(&truck(), &profile, (speed, 4e-3), every, 1000);
            let exact = history(64);
            for (error, every) in errors.iter_mut().zip([1, 2, 4, 8]) {
                *error += root_mean_square(&history(every), &exact).powi(2);
            }
        }
        let errors = errors.map(f64::sqrt);
        let orders = orders(&errors);
        let mean = orders.iter().sum::<f64>() / orders.len() as f64;
        assert!((1.8..2.3).contains(&mean), "{interpolation:?}: {orders:?} of {errors:?}");
    }
}

/// Where kinks and jumps fall on instants, the input is linear within each step, and the transition
/// matrix is exact: the step leaves no trace. (All numbers are whole parts of a power of two.)
#[test]
fn kinks_and_jumps_on_instants_cost_nothing() {
    let truck = truck_with([0.0, 4.5, 5.75], 5.125);
    let (x, z) = rough(400, 0.25);
    for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        let history = |every| forces(&truck, &profile, (16.0, 1.0 / 64.0), every, 300);
        let coarse = history(1);
        let error = largest_difference(&coarse, &history(16));
        assert!(error < 1e-10 * largest(&coarse), "{interpolation:?}: {error:.1e}");
    }
}

#[test]
fn a_level_road_feels_the_static_loads() {
    let (x, z) = ([0.0, 3.0, 50.0], [0.7; 3]);
    for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        let forces = forces(&truck(), &profile, (22.0, 1e-3), 1, 3000);
        for row in forces.chunks_exact(3) {
            assert_eq!(row, truck().static_loads());
        }
    }
}

/// A ramp of the road lifts the truck at a constant rate in the end: no spring feels it.
#[test]
fn on_a_long_ramp_the_forces_settle() {
    let (x, z) = ([0.0, 10.0, 1000.0], [0.0, 0.0, 20.0]);
    let profile = Profile::new(&x, &z, Interpolation::Linear).unwrap();
    let forces = forces(&truck(), &profile, (20.0, 1e-3), 1, 30_000);
    for (force, load) in forces[forces.len() - 3..].iter().zip(truck().static_loads()) {
        assert!((force - load).abs() < 1e-6 * load, "{force} against {load}");
    }
}

// --- roughness ------------------------------------------------------------------------------

fn index(z: &[f64], spacing: f64, moving_average: bool, segment: Option<f64>) -> Vec<f64> {
    iri(z, spacing, moving_average, segment, &mut |_, _| true).unwrap()
}

#[test]
fn a_plane_road_has_no_index_on_any_grade() {
    for (spacing, moving_average) in [(0.05, true), (0.05, false), (0.25, true), (0.3048, true)] {
        let z: Vec<f64> = (0..2000).map(|i| 583.0 - 0.08 * spacing * f64::from(i)).collect();
        let found = index(&z, spacing, moving_average, None)[0];
        assert!(found < 1e-7, "{found} m/km every {spacing} m");
    }
}

/// Segments of unequal numbers of steps, a shorter one at the end, average to the whole.
#[test]
fn segments_average_to_the_whole_and_scale_with_the_elevations() {
    let (spacing, segment) = (0.07, 10.0);
    let (_, z) = rough(1501, spacing);
    let base = 4;
    let (whole, found) =
        (index(&z, spacing, true, None)[0], index(&z, spacing, true, Some(segment)));
    assert_eq!(found.len(), 11);
    let steps = z.len() - base;
    let of = |number: f64| ((number * segment / spacing).ceil() as usize).min(steps);
    let count = |number: usize| of(number as f64 + 1.0) - of(number as f64);
    let mean = found.iter().enumerate().map(|(i, one)| count(i) as f64 * one).sum::<f64>();
    assert!((mean / steps as f64 / whole - 1.0).abs() < 1e-12);
    let double: Vec<f64> = z.iter().map(|z| -2.0 * z).collect();
    let doubled = index(&double, spacing, true, Some(segment));
    for (one, two) in found.iter().zip(doubled) {
        assert!((two / one - 2.0).abs() < 1e-12);
    }
}

/// E1926 averages by taking the slope of a chord. That is the slope from sample to sample of the
/// mean of as many elevations. The road is level where the car starts, and halves go up: 0.1 m
/// takes 3 samples, also where the spacing is rounded.
#[test]
fn the_chord_is_the_slope_of_the_moving_average() {
    for (spacing, base) in [(0.05, 5), (0.0999999999, 3), (0.1, 3), (0.1000000001, 3), (0.2, 1)] {
        let (_, mut z) = rough(1000, spacing);
        z[..=((START + BASE) / spacing).ceil() as usize].fill(0.0);
        let mean: Vec<f64> =
            z.windows(base).map(|window| window.iter().sum::<f64>() / base as f64).collect();
        let (chord, averaged) =
            (index(&z, spacing, true, None), index(&mean, spacing, false, None));
        assert!((chord[0] / averaged[0] - 1.0).abs() < 1e-11, "{spacing} m");
    }
}

#[test]
fn a_rest_without_a_whole_base_is_no_segment() {
    let (_, z) = rough(2002, 0.05);
    assert_eq!(index(&z, 0.05, true, Some(100.0)).len(), 1);
    assert_eq!(index(&z, 0.05, false, Some(100.0)).len(), 2);
}

#[test]
fn the_golden_car_can_be_stopped() {
    let (_, z) = rough(5000, 0.25);
    let stopped = iri(&z, 0.25, true, Some(100.0), &mut |step, _| step < 2048);
    assert_eq!(stopped, Err(Error::Stopped { step: 2048, steps: 4999 }));
}

// --- any input ------------------------------------------------------------------------------

/// Anything a caller may pass for a number that should be near `size`.
fn wild(size: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        12 => (0.2..5.0_f64).prop_map(move |factor| factor * size),
        1 => prop::sample::select(vec![
            0.0, -0.0, -size, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN,
            f64::MIN_POSITIVE, 5e-324, f64::EPSILON, 1e-160, 1e-30, 1e30, 1e160,
        ]),
        1 => (-320.0..308.0_f64).prop_map(|exponent| 10_f64.powf(exponent)),
    ]
}

fn whole(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|value| value.is_finite())
}

fn wild_section() -> impl Strategy<Value = Section> {
    (wild(2.0), wild(2e5), wild(2e3), wild(2e3), wild(9e7), wild(3e5), wild(240.0)).prop_map(
        |(length, bending_stiffness, bending_damping, mass, stiffness, damping, bed_mass)| {
            Section {
                length,
                bending_stiffness,
                bending_damping,
                mass,
                bed: Bed { stiffness, damping, mass: bed_mass },
            }
        },
    )
}

/// A road of more elements than a test has time for.
fn too_long(sections: &[Section], element_length: f64) -> bool {
    sections.iter().any(|s| (100.0..1.1e7).contains(&(s.length / element_length)))
}

fn wild_matrix(n: usize, size: f64) -> impl Strategy<Value = DMatrix<f64>> {
    prop::collection::vec(wild(size), n * n).prop_map(move |values| {
        DMatrix::from_fn(n, n, |i, j| values[i * n + j] * if i == j { 4.0 } else { 0.3 })
    })
}

fn check_transition(transition: &Transition) {
    assert!(whole(&transition.phi().to_dense()), "Phi");
    assert!(whole(&transition.gamma()), "Gamma");
    assert!(whole(&transition.ramp()), "ramp");
}

fn rubbing() -> impl Strategy<Value = Option<Friction>> {
    let friction = (wild(2e3), wild(1e-3)).prop_map(|(force, travel)| Friction { force, travel });
    prop::option::weighted(0.3, friction)
}

fn wild_truck() -> impl Strategy<Value = (Vec<Body>, Vec<Spring>, Vec<Tire>)> {
    let body =
        (wild(2e3), wild(1e3), wild(2.0), prop::option::weighted(0.2, (0..5_usize, wild(1.0))))
            .prop_map(|(mass, inertia, x, pin)| Body { mass, inertia, x, pin });
    let point = || (0..5_usize, wild(1.0)).prop_map(|(body, x)| Point { body, x });
    let lower = prop::collection::vec(point(), 0..3);
    let spring = (point(), lower, wild(1e6), wild(1e4), rubbing()).prop_map(
        |(upper, lower, stiffness, damping, friction)| Spring {
            upper,
            lower,
            stiffness,
            damping,
            friction,
        },
    );
    let tire = (point(), wild(0.3), wild(1e6), wild(1e4))
        .prop_map(|(point, print, stiffness, damping)| Tire { point, print, stiffness, damping });
    (
        prop::collection::vec(body, 0..4),
        prop::collection::vec(spring, 0..4),
        prop::collection::vec(tire, 0..4),
    )
}

/// A quarter car, some of its numbers wild: most of these can run.
fn wild_quarter_car() -> impl Strategy<Value = (Vec<Body>, Vec<Spring>, Vec<Tire>)> {
    let masses = (wild(4e3), wild(4e2));
    let spring = (wild(2e5), wild(1e4), rubbing());
    let print = prop_oneof![Just(0.0), wild(0.3)];
    (masses, spring, (print, wild(1e6), wild(1e3)), wild(1.0)).prop_map(
        |((sprung, unsprung), (stiffness, damping, friction), tire, x)| {
            let body = |mass| Body { mass, inertia: 0.0, x, pin: None };
            let [upper, point] = [0, 1].map(|body| Point { body, x });
            let spring = Spring { upper, lower: vec![point], stiffness, damping, friction };
            let (print, stiffness, damping) = tire;
            let tire = Tire { point, print, stiffness, damping };
            (vec![body(sprung), body(unsprung)], vec![spring], vec![tire])
        },
    )
}

fn check_vehicle(
    (bodies, springs, tires): &(Vec<Body>, Vec<Spring>, Vec<Tire>),
) -> Result<Vehicle> {
    let vehicle = Vehicle::new(bodies, springs, tires)?;
    assert!(vehicle.static_loads().iter().all(|load| load.is_finite() && *load > 0.0));
    let System { mass, damping, stiffness } = vehicle.system();
    assert!([mass, damping, stiffness].iter().all(|matrix| whole(&matrix.to_dense())));
    Ok(vehicle)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        failure_persistence: None,
        // The same cases on every run: a failure says that the code has changed.
        rng_seed: RngSeed::Fixed(20),
        ..Default::default()
    })]

    #[test]
    fn any_road(
        sections in prop::collection::vec(wild_section(), 0..3),
        element_length in wild(0.5),
        winkler in any::<bool>(),
        ends in 0..3_usize,
        dt in wild(1e-3),
        form in 0..3_usize,
    ) {
        prop_assume!(!too_long(&sections, element_length));
        let foundation = if winkler { Foundation::Winkler } else { Foundation::Bars };
        let ends = [Ends::Clamped, Ends::Pinned, Ends::Free][ends];
        if let Ok(road) = Strip::new(&sections, element_length, foundation, ends) {
            let System { mass, damping, stiffness } = road.system();
            for (name, matrix) in [("M", mass), ("C", damping), ("K", stiffness)] {
                prop_assert!(whole(&matrix.to_dense()), "{name}");
            }
            prop_assert!(road.nodes().windows(2).all(|pair| pair[0] < pair[1]));
            let form = [Form::Stiffness, Form::State, Form::Integral][form];
            if let Ok(found) = Transition::new(road.system().clone(), dt, form, &mut |_, _| true) {
                check_transition(&found);
            }
        }
    }

    #[test]
    fn any_system(
        mass in wild_matrix(3, 1.0),
        damping in wild_matrix(3, 1.0),
        stiffness in wild_matrix(3, 1.0),
        dt in wild(1.0),
        form in 0..3_usize,
    ) {
        let form = [Form::Stiffness, Form::State, Form::Integral][form];
        let found = System::from_dense(&mass, &damping, &stiffness)
            .and_then(|system| Transition::new(system, dt, form, &mut |_, _| true));
        if let Ok(found) = found {
            check_transition(&found);
        }
    }

    #[test]
    fn any_loads(
        axles in 1..4_usize,
        positions in prop::collection::vec(wild(2.0), 0..24),
        forces in prop::collection::vec(wild(4e4), 0..24),
        even in any::<bool>(),
        places in prop::collection::vec(wild(1.0), 0..3),
        every in 0..4_usize,
        first in any::<bool>(),
        hermite in any::<bool>(),
    ) {
        let road = strip(4.0, Foundation::Bars, Ends::Clamped);
        let length = if even { positions.len().min(forces.len()) } else { usize::MAX };
        let length = if even { length / axles * axles } else { length };
        let positions = &positions[..length.min(positions.len())];
        let forces = &forces[..length.min(forces.len())];
        let hold = if first { Hold::First } else { Hold::Zero };
        let weights = if hermite { Weights::Hermite } else { Weights::Linear };
        let keep = Keep::deflection(hermite, &places, every);
        let transition = transition(road.system(), 1e-3);
        if let Ok(stepper) = Stepper::new(road, transition, (weights, hold), &keep, &mut |_, _| true) {
            let loads = Loads { axles, positions, forces };
            if let Ok(record) = stepper.run(&loads, &mut |_, _| true) {
                let envelope = record.envelope.lowest.iter().chain(&record.envelope.highest);
                prop_assert!(record.history.iter().chain(envelope).all(|w| w.is_finite()));
            }
        }
    }

    #[test]
    fn any_vehicle(vehicle in wild_truck()) {
        let _ = check_vehicle(&vehicle);
    }

    #[test]
    fn any_quarter_car_on_any_road(
        vehicle in wild_quarter_car(),
        x in prop::collection::vec(wild(1.0), 0..6),
        sorted in any::<bool>(),
        z in prop::collection::vec(wild(1e-2), 0..6),
        staircase in any::<bool>(),
        speed in wild(18.0),
        dt in wild(1e-3),
        start in wild(1.0),
        skip in 0..5_usize,
        steps in 0..9_usize,
        lift_off in any::<bool>(),
        tolerance in wild(1e-4),
    ) {
        let mut x = x;
        if sorted {
            x.sort_by(f64::total_cmp);
            x.truncate(z.len());
        }
        let z = if sorted { &z[..x.len()] } else { &z[..] };
        let interpolation =
            if staircase { Interpolation::Staircase } else { Interpolation::Linear };
        let run = Run { speed, dt, start, skip, steps, lift_off, tolerance };
        if let (Ok(vehicle), Ok(profile)) =
            (check_vehicle(&vehicle), Profile::new(&x, z, interpolation))
            && let Ok(forces) = vehicle.tire_forces(&profile, &run, &mut |_, _| true)
        {
            prop_assert_eq!(forces.len(), steps + 1);
            prop_assert!(forces.iter().all(|force| force.is_finite()), "{:?}", forces);
        }
    }

    #[test]
    fn any_index(
        z in prop::collection::vec(wild(1e-2), 0..60),
        spacing in wild(0.2),
        moving_average in any::<bool>(),
        segment in prop::option::of(wild(2.0)),
    ) {
        if let Ok(found) = iri(&z, spacing, moving_average, segment, &mut |_, _| true) {
            prop_assert!(!found.is_empty());
            prop_assert!(found.iter().all(|one| one.is_finite() && *one >= 0.0), "{:?}", found);
        }
    }

    #[test]
    fn any_asphalt(
        time in wild(0.0166),
        temperature in wild(20.0),
        softening in wild(60.0),
        index in wild(-1.0),
        binder in wild(1e7),
        vma in wild(20.0),
        speed in wild(18.0),
    ) {
        for found in [
            asphalt::binder_stiffness(time, temperature, softening, index),
            asphalt::mix_modulus(binder, vma),
            asphalt::loading_time(speed),
        ].into_iter().flatten() {
            prop_assert!(found.is_finite() && found > 0.0, "{}", found);
        }
    }
}

#[test]
fn no_axle_is_an_error() {
    let road = strip(4.0, Foundation::Bars, Ends::Clamped);
    let transition = transition(road.system(), 1e-3);
    let scheme = (Weights::Linear, Hold::Zero);
    let stepper = Stepper::new(road, transition, scheme, &stations(&[]), &mut |_, _| true).unwrap();
    for values in [vec![], vec![1.0], vec![f64::NAN], vec![1.0, 2.0]] {
        let loads = Loads { axles: 0, positions: &values, forces: &values };
        assert!(stepper.run(&loads, &mut |_, _| true).is_err(), "{values:?}");
    }
}

#[test]
fn more_steps_than_memory_holds_are_an_error() {
    let (x, z) = ([0.0, 1.0], [0.0, 0.0]);
    let profile = Profile::new(&x, &z, Interpolation::Linear).unwrap();
    for (skip, steps) in [(0, usize::MAX), (usize::MAX, 1), (0, usize::MAX / 2)] {
        let run =
            Run { speed: 1.0, dt: 1e-3, start: 0.0, skip, steps, lift_off: false, tolerance: 1e-4 };
        assert!(truck().tire_forces(&profile, &run, &mut |_, _| false).is_err());
    }
}

/// A step so small that the place of a far wheel does not change is not a diverging truck.
#[test]
fn far_from_the_origin() {
    let (x, z) = ([0.0, 1.0], [0.0, 0.0]);
    for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        let run = Run {
            speed: 20.0,
            dt: 1e-3,
            start: 1e17,
            skip: 0,
            steps: 3,
            lift_off: false,
            tolerance: 1e-4,
        };
        match truck().tire_forces(&profile, &run, &mut |_, _| true) {
            Ok(forces) => assert!(forces.iter().all(|force| force.is_finite())),
            Err(error) => assert!(matches!(error, Error::Invalid { .. }), "{error}"),
        }
    }
}
