//! Tire forces of a fleet: 1000 five-axle trucks over ten kilometres, 1 ms, statistics of every axle.
//!
//! `cargo bench -p pavefem-core --bench fleet` prints vehicle-seconds simulated a second on one
//! thread and on two, the error of the same runs, and the same with a force kept at each station.

// A bench stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::num::NonZero;
use std::time::Instant;

use pavefem_core::error::unwatched;
use pavefem_core::vehicle::{
    Body, Interpolation, Keep, Passage, Point, Profile, Record, Run, Spring, Tire, Vehicle, fleet,
};

const LENGTH: f64 = 10_000.0;
const DT: f64 = 1e-3;
const TRUCKS: usize = 1000;

/// A tractor with a steer axle and two drive axles, and a semitrailer with two, 8 unknowns.
fn semitrailer(number: usize) -> Vehicle {
    let part = number as f64 / TRUCKS as f64;
    let axles = [0.0, 4.0, 5.3, 10.6, 11.9];
    let frame = |mass, inertia, x, pin| Body { mass, inertia, x, pin };
    let mut bodies = vec![
        frame(5500.0, 2.5e4, 1.4, None),
        frame(18_000.0 + 8000.0 * part, 2.5e5, 7.6, Some((0, 4.4))),
    ];
    bodies.extend(axles.iter().enumerate().map(|(axle, &x)| {
        let mass = if axle == 0 { 600.0 } else { 900.0 };
        Body { mass, inertia: 0.0, x, pin: None }
    }));
    let point = |body, axle: usize| Point { body, x: axles[axle] };
    let spring = |axle: usize| {
        let (body, stiffness) = [(0, 4e5), (0, 8e5), (0, 8e5), (1, 8e5), (1, 8e5)][axle];
        Spring::between(point(body, axle), point(2 + axle, axle), stiffness, 2e4)
    };
    let tire = |axle| Tire::at(point(2 + axle, axle), if axle == 0 { 1.8e6 } else { 3.6e6 }, 2e3);
    let springs: Vec<_> = (0..5).map(spring).collect();
    let tires: Vec<_> = (0..5).map(tire).collect();
    Vehicle::new(&bodies, &springs, &tires).unwrap()
}

/// A truck with a cab, a steer axle and two drive axles, 6 unknowns.
fn truck(number: usize) -> Vehicle {
    let part = number as f64 / TRUCKS as f64;
    let axles = [0.0, 3.8, 5.1];
    let body = |mass, inertia, x| Body { mass, inertia, x, pin: None };
    let point = |body, x| Point { body, x };
    let mut bodies = vec![body(9000.0 + 6000.0 * part, 4e4, 2.6), body(900.0, 0.0, 0.3)];
    bodies.extend(axles.iter().map(|&x| body(700.0, 0.0, x)));
    let mut springs = vec![Spring::between(point(1, 0.3), point(0, 0.3), 1e5, 6e3)];
    let between = |(axle, &x)| Spring::between(point(0, x), point(2 + axle, x), 6e5, 1.5e4);
    springs.extend(axles.iter().enumerate().map(between));
    let tire = |(axle, &x)| Tire::at(point(2 + axle, x), 2e6, 2e3);
    let tires: Vec<_> = axles.iter().enumerate().map(tire).collect();
    Vehicle::new(&bodies, &springs, &tires).unwrap()
}

/// A road of class B or so: waves of 0.5 to 60 m, as high as long by the root.
fn road() -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..=40_000).map(|i| 0.25 * f64::from(i)).collect();
    let waves: Vec<_> = (0..60)
        .map(|i| {
            let length = 0.5 * 1.084_f64.powi(i);
            (std::f64::consts::TAU / length, 1.6e-4 * length.powf(0.9), f64::from(i * i) * 2.4)
        })
        .collect();
    let height = |x: &f64| waves.iter().map(|(n, a, phase)| a * (n * x + phase).sin()).sum();
    let z = x.iter().map(height).collect();
    (x, z)
}

/// 60 to 90 km/h.
fn passage(vehicle: &Vehicle, number: usize, dt: f64) -> Passage<'_> {
    let speed = (60.0 + 30.0 * (number * 7 % TRUCKS) as f64 / TRUCKS as f64) / 3.6;
    let steps = (LENGTH / (speed * dt)) as usize;
    Passage {
        vehicle,
        run: Run { speed, dt, start: 0.0, skip: 0, steps, lift_off: false, tolerance: 1e-4 },
    }
}

fn main() {
    // Not when tests only ask whether the bench runs.
    let trucks = if std::env::args().any(|argument| argument == "--bench") { TRUCKS } else { 64 };
    let vehicles: Vec<_> = (0..trucks).map(semitrailer).collect();
    let passages = |dt| -> Vec<_> {
        vehicles.iter().enumerate().map(|(i, vehicle)| passage(vehicle, i, dt)).collect()
    };
    let (x, z) = road();
    let profile = Profile::new(&x, &z, Interpolation::Linear).unwrap();
    let statistics = Keep::default();
    let run = |passages: &[Passage<'_>], keep: &Keep, threads| -> Vec<Record> {
        fleet(passages, &profile, keep, NonZero::new(threads).unwrap(), &mut unwatched).unwrap()
    };
    let whole = passages(DT);
    let stations = Keep { every: None, stations: x[400..39_000].to_vec() };
    let lighter: Vec<_> = (0..trucks.min(200)).map(truck).collect();
    let lighter: Vec<_> = lighter.iter().enumerate().map(|(i, v)| passage(v, i, DT)).collect();
    // A station's force takes 8 bytes an axle.
    let fifth = &whole[..trucks.min(200)];
    let cases = [
        ("five axles, statistics", &whole[..], &statistics, 1),
        ("five axles, statistics", &whole[..], &statistics, 2),
        ("five axles, statistics and 38 600 stations", fifth, &stations, 2),
        ("three axles, statistics", &lighter[..], &statistics, 1),
    ];
    for (what, some, keep, threads) in cases {
        let steps: usize = some.iter().map(|passage| passage.run.steps).sum();
        let start = Instant::now();
        black_box(run(some, keep, threads));
        let taken = start.elapsed().as_secs_f64();
        println!(
            "fleet: {} trucks over {} km, {what}, {threads} thread(s): {taken:.2} s, \
             {:.0} vehicle-seconds a second, {:.1} ns a vehicle and step",
            some.len(),
            LENGTH / 1e3,
            steps as f64 * DT / taken,
            1e9 * taken / steps as f64,
        );
    }
    let few = 8.min(trucks);
    let coarse = run(&whole[..few], &statistics, 2);
    let fine = run(&passages(DT / 16.0)[..few], &statistics, 2);
    let deviations = |records: &[Record]| -> Vec<f64> {
        records.iter().flat_map(|record| record.axles.iter().map(|axle| axle.deviation)).collect()
    };
    let errors = deviations(&coarse).into_iter().zip(deviations(&fine));
    let worst = errors.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    println!(
        "fleet: standard deviations are within {:.2} % of a step 16 times shorter",
        1e2 * worst
    );
}
