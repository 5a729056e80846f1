//! The moving window: the paper's case, and what a vehicle-second costs by mesh and on roads of 25 m to
//! 100 km; and the same by the band of the transition matrix.
//!
//! `cargo bench -p pavefem-core --bench window`. Each time stands beside the error of the same run.

// A bench stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::Instant;

use pavefem_core::asphalt;
use pavefem_core::pavement::{Bed, Ends, Foundation, Mesh, Section, Strip, Weights};
use pavefem_core::response::{Hold, Keep, Loads, Record, Stepper, banded, window};
use pavefem_core::transition::Transition;

const SPEED: f64 = 65.0 / 3.6;
const DT: f64 = 1e-3;
const AXLES: [f64; 3] = [0.0, 4.55, 5.85];
const FORCES: [f64; 3] = [38_925.0, 76_335.0, 80_938.0];
const ENVELOPE: Keep =
    Keep { quantities: Vec::new(), nodes: false, stations: Vec::new(), every: 1 };

type Scheme = (f64, Foundation, (Weights, Hold));

const PAPER: Scheme = (0.5, Foundation::Bars, (Weights::Linear, Hold::Zero));
const CONVERGED: Scheme = (0.125, Foundation::Winkler, (Weights::Hermite, Hold::First));

/// Table I, from the asphalt on.
fn section(length: f64) -> Section {
    let time = asphalt::loading_time(SPEED).unwrap();
    let binder = asphalt::binder_stiffness(time, 20.0, 60.0, -1.0).unwrap();
    let modulus = asphalt::mix_modulus(binder, 25.0).unwrap();
    let bar = 1.0 / (1.0 / 1.9e8 + 1.0 / 56e6);
    Section {
        length,
        bending_stiffness: modulus * 4.5e-5,
        bending_damping: 1750.0,
        mass: 2000.0,
        bed: Bed { stiffness: bar / 0.5, damping: 280e3, mass: 355.0 / 1.5 },
    }
}

fn passage(length: f64, dt: f64) -> (Vec<f64>, Vec<f64>) {
    let steps = ((length + AXLES[2]) / (SPEED * dt)) as usize;
    let place = |step: usize| AXLES.map(|axle| SPEED * dt * step as f64 - axle);
    ((0..=steps).flat_map(place).collect(), FORCES.repeat(steps + 1))
}

fn mesh(length: f64, (h, foundation, _): Scheme) -> Mesh {
    Mesh::new(&[section(length)], h, foundation, Ends::Clamped).unwrap()
}

fn windowed(length: f64, scheme: Scheme, dt: f64) -> impl Fn() -> Record {
    let (positions, forces) = passage(length, dt);
    move || {
        let road = window::Road::new(mesh(length, scheme), dt, scheme.2, ENVELOPE).unwrap();
        let loads = Loads { axles: 3, positions: &positions, forces: &forces };
        road.run(&loads, &mut |_, _| true).unwrap()
    }
}

/// A band, and what finding it took in seconds.
fn band(length: f64, scheme: Scheme, dt: f64) -> (impl Fn() -> Record, f64) {
    let start = Instant::now();
    let mesh = mesh(length, scheme);
    let road = banded::Road::new(mesh, dt, scheme.2, ENVELOPE, &mut |_, _| true).unwrap();
    let taken = start.elapsed().as_secs_f64();
    let (positions, forces) = passage(length, dt);
    let run = move || {
        let loads = Loads { axles: 3, positions: &positions, forces: &forces };
        road.run(&loads, &mut |_, _| true).unwrap()
    };
    (run, taken)
}

fn dense(length: f64, scheme: Scheme, dt: f64) -> impl Fn() -> Record {
    let (positions, forces) = passage(length, dt);
    move || {
        let strip = Strip::of(mesh(length, scheme)).unwrap();
        let transition = Transition::of(strip.system(), dt, &mut |_, _| true).unwrap();
        let stepper =
            Stepper::new(strip, transition, scheme.2, &ENVELOPE, &mut |_, _| true).unwrap();
        let loads = Loads { axles: 3, positions: &positions, forces: &forces };
        stepper.run(&loads, &mut |_, _| true).unwrap()
    }
}

/// Seconds of the fastest of some runs.
fn fastest(runs: usize, work: &impl Fn() -> Record) -> f64 {
    let time = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64()
    };
    (0..runs).map(time).fold(f64::INFINITY, f64::min)
}

fn largest(record: &Record) -> f64 {
    -record.envelope.lowest.iter().copied().fold(0.0, f64::min)
}

/// The paper's case from its constants, against the dense stepper and against a step 16 times shorter.
fn paper_case() {
    for (name, scheme) in [("paper", PAPER), ("converged", CONVERGED)] {
        let (window, whole) = (windowed(25.0, scheme, DT), dense(25.0, scheme, DT));
        let (fast, slow) = (fastest(50, &window), fastest(10, &whole));
        let exact = (scheme.0, scheme.1, (scheme.2.0, Hold::First));
        let fine = largest(&windowed(25.0, exact, DT / 16.0)());
        println!(
            "{name}: 25 m cold in {:.3} ms, dense {:.2} ms, {:.1} times; largest deflection \
             {:+.2} %, dense {:+.2} %, from a step 16 times shorter",
            1e3 * fast,
            1e3 * slow,
            slow / fast,
            100.0 * (largest(&window()) / fine - 1.0),
            100.0 * (largest(&whole()) / fine - 1.0),
        );
    }
}

/// The banded transition against the dense one: the same numbers, and what they cost.
fn banded_case(length: f64) {
    for (name, scheme) in [("paper", PAPER), ("converged", CONVERGED)] {
        let ((run, cold), whole) = (band(length, scheme, DT), dense(length, scheme, DT));
        let seconds = length / SPEED;
        let ((found, expected), warm) = ((run(), whole()), fastest(5, &run));
        let pairs = found.envelope.lowest.iter().zip(&expected.envelope.lowest);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest(&expected);
        println!(
            "{name}: {length} m, band found in {:.0} ms, then {:.3} ms a vehicle-second; its \
             envelope within {error:.1e} of that of the dense matrix",
            1e3 * cold,
            1e3 * warm / seconds,
        );
    }
}

fn road_lengths(lengths: &[f64]) {
    type Make = fn(f64) -> Box<dyn Fn() -> Record>;
    let methods: [(&str, Make); 4] = [
        ("paper", |length| Box::new(windowed(length, PAPER, DT))),
        ("converged", |length| Box::new(windowed(length, CONVERGED, DT))),
        ("paper, banded", |length| Box::new(band(length, PAPER, DT).0)),
        ("converged, banded", |length| Box::new(band(length, CONVERGED, DT).0)),
    ];
    for (name, make) in methods {
        let mut costs = Vec::new();
        for &length in lengths {
            let work = make(length);
            let seconds = length / SPEED;
            let taken = fastest(if length < 5e3 { 5 } else { 1 }, &work);
            costs.push((length.ln(), (taken / seconds).ln()));
            println!(
                "{name}: {:>6} m, {:.3} ms a vehicle-second, {:.0} times real time",
                length,
                1e3 * taken / seconds,
                seconds / taken
            );
        }
        // From 250 m on, where the window is shorter than the road.
        let long: Vec<_> = costs.into_iter().filter(|(length, _)| *length > 200_f64.ln()).collect();
        let count = long.len() as f64;
        let (x, y) = long.iter().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / count, y + b / count));
        let slope = long.iter().map(|(a, b)| (a - x) * (b - y)).sum::<f64>()
            / long.iter().map(|(a, _)| (a - x).powi(2)).sum::<f64>();
        println!("{name}: exponent of the cost of a vehicle-second in the length {slope:+.3}");
    }
}

/// What a finer mesh costs, and what it leaves of the error.
fn meshes(sizes: &[f64]) {
    let (length, seconds) = (500.0, 500.0 / SPEED);
    let run = |h: f64| windowed(length, (h, CONVERGED.1, CONVERGED.2), DT);
    // Elements this short leave no error beside those above them.
    let fine = largest(&run(1.0 / 32.0)());
    for &h in sizes {
        let work = run(h);
        let taken = fastest(5, &work);
        println!(
            "elements of {h:>6} m: {:.3} ms a vehicle-second, {:.3} us an element of it; largest \
             deflection {:+.3} %",
            1e3 * taken / seconds,
            1e6 * taken / seconds / (length / h),
            100.0 * (largest(&work()) / fine - 1.0),
        );
    }
}

fn main() {
    // Not when tests only ask whether the bench runs.
    if std::env::args().any(|argument| argument == "--bench") {
        paper_case();
        meshes(&[0.5, 0.25, 0.125, 0.0625]);
        banded_case(100.0);
        road_lengths(&[25.0, 250.0, 2.5e3, 25e3, 100e3]);
    } else {
        meshes(&[0.5]);
        road_lengths(&[25.0, 250.0, 500.0]);
    }
}
