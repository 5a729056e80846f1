//! What a run costs: the paper's case by its parts, cold and warm, and a truck over ten kilometres.
//!
//! `cargo bench -p pavefem-core --bench paper`. The last line sets the speed of the paper's case
//! beside the error of the same run.

// A bench stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use pavefem_core::asphalt;
use pavefem_core::pavement::{Bed, Ends, Foundation, Section, Strip, Weights};
use pavefem_core::response::{Hold, Keep, Loads, Record, Stepper};
use pavefem_core::transition::{Form, Transition};
use pavefem_core::vehicle::{Body, Interpolation, Point, Profile, Run, Spring, Tire, Vehicle};

const SPEED: f64 = 65.0 / 3.6;
const LENGTH: f64 = 25.0;
const DT: f64 = 1e-3;
const STEPS: usize = 1708;
const AXLES: [f64; 3] = [0.0, 4.55, 5.85];
const FORCES: [f64; 3] = [38_925.0, 76_335.0, 80_938.0];
const PAPER: (Weights, Hold) = (Weights::Linear, Hold::Zero);

/// Table I, from the asphalt on.
fn section() -> Section {
    let time = asphalt::loading_time(SPEED).unwrap();
    let binder = asphalt::binder_stiffness(time, 20.0, 60.0, -1.0).unwrap();
    let modulus = asphalt::mix_modulus(binder, 25.0).unwrap();
    let bar = 1.0 / (1.0 / 1.9e8 + 1.0 / 56e6);
    Section {
        length: LENGTH,
        bending_stiffness: modulus * 4.5e-5,
        bending_damping: 1750.0,
        mass: 2000.0,
        bed: Bed { stiffness: bar / 0.5, damping: 280e3, mass: 355.0 / 1.5 },
    }
}

fn road() -> Strip {
    Strip::new(&[section()], 0.5, Foundation::Bars, Ends::Clamped).unwrap()
}

fn transition(strip: &Strip, dt: f64, form: Form) -> Transition {
    Transition::new(strip.system().clone(), dt, form, &mut |_, _| true).unwrap()
}

fn stepper(strip: Strip, dt: f64, scheme: (Weights, Hold)) -> Stepper {
    let transition = transition(&strip, dt, Form::Stiffness);
    let keep = Keep::deflection(false, &[0.5 * LENGTH], 1);
    Stepper::new(strip, transition, scheme, &keep, &mut |_, _| true).unwrap()
}

/// Places and forces of the axles at each instant.
fn passage(dt: f64, steps: usize) -> (Vec<f64>, Vec<f64>) {
    let place = |step: usize| AXLES.map(|axle| SPEED * dt * step as f64 - axle);
    ((0..=steps).flat_map(place).collect(), FORCES.repeat(steps + 1))
}

fn run(stepper: &Stepper, (positions, forces): &(Vec<f64>, Vec<f64>)) -> Record {
    stepper.run(&Loads { axles: 3, positions, forces }, &mut |_, _| true).unwrap()
}

fn parts(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("paper");
    let strip = road();
    let loads = passage(DT, STEPS);
    group.bench_function("assembly", |bencher| bencher.iter(road));
    // Phi and, in each of its three forms, Gamma; the series and squarings are common to two.
    for form in [Form::Stiffness, Form::State, Form::Integral] {
        group.bench_function(BenchmarkId::new("Phi and Gamma", format!("{form:?}")), |bencher| {
            bencher.iter(|| transition(black_box(&strip), DT, form));
        });
    }
    let ready = transition(&strip, DT, Form::Stiffness);
    group.bench_function("blocks of Phi", |bencher| bencher.iter(|| black_box(&ready).phi()));
    let keep = Keep::deflection(false, &[0.5 * LENGTH], 1);
    group.bench_function("stepper", |bencher| {
        bencher.iter_batched(
            || (strip.clone(), ready.clone()),
            |(strip, transition)| Stepper::new(strip, transition, PAPER, &keep, &mut |_, _| true),
            BatchSize::SmallInput,
        );
    });
    group.bench_function("cold", |bencher| {
        bencher.iter(|| run(&stepper(road(), DT, PAPER), &loads));
    });
    let warm = stepper(strip, DT, PAPER);
    // Its throughput is that of single steps.
    group.throughput(Throughput::Elements(STEPS as u64));
    group.bench_function("warm", |bencher| bencher.iter(|| run(&warm, black_box(&loads))));
    group.finish();
}

/// The paper's truck.
fn truck() -> Vehicle {
    let (centre, pivot) = (4.21102, 5.22174);
    let body = |mass, inertia, x, pin| Body { mass, inertia, x, pin };
    let bodies = [
        body(17_400.0, 8e4, centre, None),
        body(600.0, 0.0, AXLES[0], None),
        body(1000.0, 0.0, AXLES[1], None),
        body(1000.0, 0.0, AXLES[2], None),
        body(0.0, 100.0, pivot, Some((0, pivot))),
    ];
    let spring = |upper, axle: usize, stiffness, damping| {
        let x = AXLES[axle];
        let (upper, lower) = (Point { body: upper, x }, Point { body: axle + 1, x });
        Spring::between(upper, lower, stiffness, damping)
    };
    let springs = [spring(0, 0, 1e6, 1e4), spring(4, 1, 2e6, 5e4), spring(4, 2, 2e6, 5e4)];
    let tire =
        |axle: usize, stiffness| Tire::at(Point { body: axle + 1, x: AXLES[axle] }, stiffness, 1e4);
    let tires = [tire(0, 1.75e6), tire(1, 3.5e6), tire(2, 3.5e6)];
    Vehicle::new(&bodies, &springs, &tires).unwrap()
}

fn ten_kilometres(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("truck");
    let x: Vec<f64> = (0..40_001).map(|i| 0.25 * f64::from(i)).collect();
    let z: Vec<f64> = x.iter().map(|x| 4e-3 * (0.9 * x).sin() + 1e-3 * (2.3 * x).cos()).collect();
    let steps = (10_000.0 / (SPEED * DT)) as usize;
    let run =
        Run { speed: SPEED, dt: DT, start: 0.0, skip: 0, steps, lift_off: false, tolerance: 1e-4 };
    let truck = truck();
    group.throughput(Throughput::Elements(steps as u64));
    for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        group.bench_function(BenchmarkId::new("10 km", format!("{interpolation:?}")), |bencher| {
            bencher.iter(|| truck.tire_forces(&profile, &run, &mut |_, _| true));
        });
    }
    group.finish();
}

/// Seconds of the fastest of some runs.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    let time = |()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    std::iter::repeat_n((), runs).map(time).fold(f64::INFINITY, f64::min)
}

/// Speed and error of one and the same run, in one line.
///
/// The error in time is against a sixteenth of the step at second order, on the same mesh; the error
/// of the model is against a continuous bed in elements of an eighth of a metre.
fn real_time() {
    let loads = passage(DT, STEPS);
    let warm = stepper(road(), DT, PAPER);
    let seconds = fastest(50, || {
        black_box(run(&warm, &loads));
    });
    let cold = fastest(10, || {
        black_box(run(&stepper(road(), DT, PAPER), &loads));
    });
    let simulated = DT * STEPS as f64;
    let lowest = |record: &Record| -record.history.iter().copied().fold(0.0, f64::min);
    let found = lowest(&run(&warm, &loads));
    let (dt, steps) = (DT / 16.0, 16 * STEPS);
    let refined = stepper(road(), dt, (Weights::Linear, Hold::First));
    let refined = lowest(&run(&refined, &passage(dt, steps)));
    let bed = Strip::new(&[section()], 0.125, Foundation::Winkler, Ends::Clamped).unwrap();
    let bed = stepper(bed, DT / 4.0, (Weights::Hermite, Hold::First));
    let bed = lowest(&run(&bed, &passage(DT / 4.0, 4 * STEPS)));
    println!(
        "paper: {simulated:.3} s in {:.3} ms warm, {:.3} ms cold: {:.0} and {:.0} times real time; \
         mid-point {:.6} mm, {:+.2} % from a step 16 times shorter, {:+.1} % from a continuous bed",
        1e3 * seconds,
        1e3 * cold,
        simulated / seconds,
        simulated / cold,
        1e3 * found,
        100.0 * (found / refined - 1.0),
        100.0 * (found / bed - 1.0),
    );
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    parts(&mut criterion);
    ten_kilometres(&mut criterion);
    criterion.final_summary();
    // Not when tests only ask whether the bench runs.
    if std::env::args().any(|argument| argument == "--bench") {
        real_time();
    }
}
