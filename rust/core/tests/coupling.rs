//! Tires that feel the deflection they cause.

// A test stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use pavefem_core::coupling::{Coupled, two_way};
use pavefem_core::error::{Error, Result};
use pavefem_core::pavement::{Bed, Ends, Foundation, Mesh, Section, Weights};
use pavefem_core::response::window::Road;
use pavefem_core::response::{Hold, Keep, Loads, Quantity};
use pavefem_core::vehicle::{
    Body, GRAVITY, Interpolation, Passage, Point, Profile, Run, Tire, Vehicle,
};

const LENGTH: f64 = 25.0;
const SPEED: f64 = 25.0;
const DT: f64 = 1e-3;
const STIFFNESS: f64 = 3.5e10 * 1.3901;
const MASS: f64 = 5750.0;
const SPRING: f64 = 1.595e6;

/// A bridge without a bed under it.
fn bridge(dt: f64, stiffness: f64) -> Road {
    let section = Section {
        length: LENGTH,
        bending_stiffness: stiffness,
        bending_damping: 0.0,
        mass: 18_358.0,
        bed: Bed { stiffness: 0.0, damping: 0.0, mass: 0.0 },
    };
    let mesh = Mesh::new(&[section], 1.25, Foundation::Winkler, Ends::Pinned).unwrap();
    let quantities = vec![Quantity::Deflection];
    let keep = Keep { quantities, nodes: false, stations: vec![LENGTH / 2.0], every: 1 };
    Road::new(mesh, dt, (Weights::Hermite, Hold::First), keep).unwrap()
}

/// A mass on a spring on each wheel track, and its run over the bridge.
fn sprung_mass(dt: f64, mass: f64, stiffness: f64) -> (Vehicle, Run) {
    let body = Body { mass: 2.0 * mass, inertia: 0.0, x: 0.0, pin: None };
    let tire = Tire::at(Point { body: 0, x: 0.0 }, 2.0 * stiffness, 0.0);
    let steps = (LENGTH / SPEED / dt).round() as usize;
    let (lift_off, tolerance) = (false, 1e-4);
    let run = Run { speed: SPEED, dt, start: 0.0, skip: 0, steps, lift_off, tolerance };
    (Vehicle::new(&[body], &[], &[tire]).unwrap(), run)
}

/// Let it cross: the deflection of mid-span, and what they do to each other.
fn cross(road: &Road, dt: f64, mass: f64, stiffness: f64) -> Result<(Vec<f64>, Coupled)> {
    let (vehicle, run) = sprung_mass(dt, mass, stiffness);
    let level = Profile::new(&[0.0, 1.0], &[0.0, 0.0], Interpolation::Linear).unwrap();
    let positions: Vec<f64> = (0..=run.steps).map(|step| SPEED * dt * step as f64).collect();
    let passage = Passage { vehicle: &vehicle, run };
    let coupled = two_way(&passage, &level, road, &positions, &mut |_, _| true)?;
    let loads = Loads { axles: 1, positions: &positions, forces: &coupled.forces };
    let record = road.run(&loads, &mut |_, _| true).unwrap();
    Ok((record.history, coupled))
}

/// A sprung mass on a simply supported beam: L 25 m, E 3.5e10 Pa, I 1.3901 m^4, 18 358 kg/m, 5750 kg
/// on 1.595e6 N/m at 25 m/s. Mid-span deflections published with a vehicle-bridge code, whose
/// step was 1 ms: to 0.2 %.
#[test]
fn a_sprung_mass_on_a_simply_supported_beam() {
    let (history, _) = cross(&bridge(DT, STIFFNESS), DT, MASS, SPRING).unwrap();
    for (time, expected) in
        [(0.436, -4.1855e-4), (0.25, -2.5643e-4), (0.50, -3.6733e-4), (0.75, -2.4006e-4)]
    {
        let step = (time / DT).round() as usize;
        let error = history[step] / expected - 1.0;
        assert!(error.abs() < 2e-3, "{error:.1e} at {time} s");
    }
    let lowest = (0..history.len()).min_by(|a, b| history[*a].total_cmp(&history[*b])).unwrap();
    assert!(lowest.abs_diff(436) <= 2, "{lowest}");
}

/// What the mass has in motion, spring and height is what the beam gave: the integral of the force
/// over the way of the deflection.
#[test]
fn the_beam_does_the_work() {
    let (_, Coupled { forces, under_axles, .. }) =
        cross(&bridge(DT, STIFFNESS), DT, MASS, SPRING).unwrap();
    let (mass, spring) = (2.0 * MASS, 2.0 * SPRING);
    let weight = mass * GRAVITY;
    let height: Vec<f64> =
        under_axles.iter().zip(&forces).map(|(w, force)| w - (force - weight) / spring).collect();
    let (mut given, mut largest, mut error) = (0.0, 0.0_f64, 0.0_f64);
    for step in 1..forces.len() - 1 {
        let mean = 0.5 * (forces[step - 1] + forces[step]);
        given += mean * (under_axles[step] - under_axles[step - 1]);
        let speed = (height[step + 1] - height[step - 1]) / (2.0 * DT);
        let stretched = (forces[step].powi(2) - weight.powi(2)) / (2.0 * spring);
        let has = 0.5 * mass * speed * speed + stretched + weight * height[step];
        largest = largest.max(given.abs());
        error = error.max((has - given).abs());
    }
    assert!(error < 2e-4 * largest, "{error} of {largest} J");
}

/// A deflection within one step that exceeds the tire's own lets no iteration settle.
#[test]
fn a_step_that_does_not_settle_is_an_error() {
    let dt = 0.05;
    let error = cross(&bridge(dt, 1e3), dt, MASS, 1e4 * SPRING).err();
    assert!(matches!(error, Some(Error::Uncoupled { iterations: 40, .. })), "{error:?}");
    let message = error.unwrap().to_string();
    assert!(message.contains("use a shorter dt"), "{message}");
}

#[test]
fn positions_are_those_of_the_run() {
    let road = bridge(DT, STIFFNESS);
    let (vehicle, run) = sprung_mass(DT, MASS, SPRING);
    let level = Profile::new(&[0.0, 1.0], &[0.0, 0.0], Interpolation::Linear).unwrap();
    let passage = Passage { vehicle: &vehicle, run };
    let found = two_way(&passage, &level, &road, &[0.0; 7], &mut |_, _| true);
    assert!(matches!(found, Err(Error::Shape { .. })), "{found:?}");
    let positions: Vec<f64> = (0..=run.steps).map(|step| SPEED * DT * step as f64).collect();
    let mut calls = 0;
    let mut watch = |_, _| {
        calls += 1;
        calls < 3
    };
    let found = two_way(&passage, &level, &road, &positions, &mut watch);
    assert!(matches!(found, Err(Error::Stopped { .. })), "{found:?}");
}
