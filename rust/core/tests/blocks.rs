//! Runs in blocks: the same numbers as in one piece, and the same errors.

// A test stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use pavefem_core::error::Error;
use pavefem_core::pavement::{Bed, Ends, Foundation, Mesh, Section, Weights};
use pavefem_core::response::window::{Block, Lead, Road};
use pavefem_core::response::{Hold, Keep, Loads};
use pavefem_core::vehicle::{
    Body, Friction, Interpolation, Passage, Point, Profile, Run, Spring, Tire, Vehicle, in_blocks,
};

const SPEED: f64 = 18.0;

/// A quarter car, its spring with dry friction or without.
fn quarter_car(friction: Option<Friction>) -> Vehicle {
    let body = |mass| Body { mass, inertia: 0.0, x: 0.0, pin: None };
    let point = |body| Point { body, x: 0.0 };
    let spring = Spring { friction, ..Spring::between(point(0), point(1), 4e5, 8e3) };
    let tire = Tire::at(point(1), 1.5e6, 1e3);
    Vehicle::new(&[body(4000.0), body(500.0)], &[spring], &[tire]).unwrap()
}

fn rough() -> (Vec<f64>, Vec<f64>) {
    let wave = |x: f64| 4e-3 * (2.1 * x).sin() + 2e-3 * (7.7 * x).cos();
    (0..400).map(|i| 0.11 * f64::from(i)).map(|x| (x, wave(x))).unzip()
}

/// In blocks, the tire forces are those of a run in one piece to the last bit: linear vehicles, tires
/// that leave the road, springs that rub.
#[test]
fn tire_forces_in_blocks_are_the_same_numbers() {
    let (x, z) = rough();
    let friction = Some(Friction { force: 3e3, travel: 1e-3 });
    let cases = [
        (quarter_car(None), false, Interpolation::Linear),
        (quarter_car(None), false, Interpolation::Staircase),
        (quarter_car(None), true, Interpolation::Linear),
        (quarter_car(friction), false, Interpolation::Linear),
    ];
    for (vehicle, lift_off, interpolation) in cases {
        let profile = Profile::new(&x, &z, interpolation).unwrap();
        let (steps, tolerance) = (1500, 1e-4);
        let run = Run { speed: SPEED, dt: 1e-3, start: 0.4, skip: 70, steps, lift_off, tolerance };
        let whole = vehicle.tire_forces(&profile, &run, &mut |_, _| true).unwrap();
        assert_eq!(whole.len(), 1501);
        let passage = Passage { vehicle: &vehicle, run };
        for instants in [1, 7, 500, 1501, 4000] {
            let mut blocks = Vec::new();
            let mut take = |forces: &[f64]| {
                blocks.push(forces.to_vec());
                true
            };
            in_blocks(&passage, &profile, instants, &mut take, &mut |_, _| true).unwrap();
            assert!(blocks.iter().rev().skip(1).all(|block| block.len() == instants));
            assert_eq!(blocks.concat(), whole, "blocks of {instants}, lift-off {lift_off}");
        }
    }
}

#[test]
fn a_run_ends_when_its_forces_are_not_wanted() {
    let (x, z) = rough();
    let profile = Profile::new(&x, &z, Interpolation::Linear).unwrap();
    let vehicle = quarter_car(None);
    for lift_off in [false, true] {
        let (steps, tolerance) = (1500, 1e-4);
        let run = Run { speed: SPEED, dt: 1e-3, start: 0.0, skip: 0, steps, lift_off, tolerance };
        let passage = Passage { vehicle: &vehicle, run };
        let mut taken = 0;
        let mut take = |_: &[f64]| {
            taken += 1;
            taken < 3
        };
        let outcome = in_blocks(&passage, &profile, 100, &mut take, &mut |_, _| true);
        assert_eq!(outcome, Err(Error::Stopped { step: 299, steps: 1500 }));
        assert_eq!(taken, 3);
    }
}

/// Two sections, one twice as stiff on a softer bed.
fn road(keep: Keep, damping: f64) -> Road {
    let section = |length, bending_stiffness, stiffness| Section {
        length,
        bending_stiffness,
        bending_damping: 0.00625 * damping,
        mass: 2000.0,
        bed: Bed { stiffness, damping, mass: 237.0 },
    };
    let sections = [section(60.0, 2e5, 8.65e7), section(45.3, 4e5, 6e7)];
    let mesh = Mesh::new(&sections, 0.25, Foundation::Winkler, Ends::Clamped).unwrap();
    Road::new(mesh, 1e-3, (Weights::Hermite, Hold::First), keep).unwrap()
}

/// Two axles that cross, their forces going up and down.
fn crossing(steps: usize) -> (Vec<f64>, Vec<f64>) {
    let loads = |k: usize| {
        let time = 1e-3 * k as f64;
        let force = |phase: f64| 6e4 * (1.0 + 0.3 * (60.0 * time + phase).sin());
        [(SPEED * time, force(0.0)), (SPEED * time - 4.5, force(1.0))]
    };
    (0..=steps).flat_map(loads).unzip()
}

/// Of blocks of any length, warmed up as long as the pavement remembers: within 1e-8 of the peak.
#[test]
fn blocks_of_a_road_make_the_whole_run() {
    let keep = Keep::deflection(false, &[30.0, 60.2, 99.9], 3);
    let road = road(keep, 280e3);
    let (positions, forces) = crossing(6100);
    let loads = |rows: std::ops::Range<usize>| Loads {
        axles: 2,
        positions: &positions[2 * rows.start..2 * rows.end],
        forces: &forces[2 * rows.start..2 * rows.end],
    };
    let whole = road.run(&loads(0..6101), &mut |_, _| true).unwrap();
    let peak = -whole.envelope.lowest.iter().copied().fold(0.0, f64::min);
    let warm_up = road.warm_up(SPEED).unwrap() as usize;
    assert!((50..1000).contains(&warm_up), "{warm_up}");
    for length in [97, 1024, 2501, 6100, 9000] {
        let mut history = Vec::new();
        let nodes = whole.envelope.lowest.len();
        let (mut lowest, mut highest, mut when) =
            (vec![0.0; nodes], vec![0.0; nodes], vec![0; nodes]);
        let mut passes = vec![0.0; 2 * nodes];
        let mut firsts = Vec::new();
        for from in (0..6101_usize).step_by(length) {
            let begin = from.saturating_sub(warm_up);
            let lead = Lead { before: begin, warm_up: from - begin };
            let loads = loads(begin..(from + length).min(6101));
            let Block { first_node, record } =
                road.run_block(&loads, lead, &mut |_, _| true).unwrap();
            history.extend(record.history);
            firsts.push(first_node);
            for (at, &low) in record.envelope.lowest.iter().enumerate() {
                let node = first_node + at;
                if low < lowest[node] {
                    (lowest[node], when[node]) = (low, record.envelope.lowest_step[at]);
                }
                highest[node] = f64::max(highest[node], record.envelope.highest[at]);
                for axle in 0..2 {
                    let pass = record.envelope.passes[axle * record.envelope.lowest.len() + at];
                    passes[axle * nodes + node] = f64::min(passes[axle * nodes + node], pass);
                }
            }
        }
        assert!(firsts.is_sorted(), "{firsts:?}");
        assert!(length > 2501 || *firsts.last().unwrap() > 200, "{firsts:?}");
        assert_eq!(when, whole.envelope.lowest_step);
        for (found, expected) in [
            (lowest, &whole.envelope.lowest),
            (highest, &whole.envelope.highest),
            (passes, &whole.envelope.passes),
            (history, &whole.history),
        ] {
            assert_eq!(found.len(), expected.len());
            let error = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-8 * peak, "blocks of {length}: {:.1e}", error / peak);
        }
    }
}

#[test]
fn a_block_is_refused_a_warm_up_that_the_pavement_outlasts() {
    let (positions, forces) = crossing(3000);
    let loads = Loads { axles: 2, positions: &positions, forces: &forces };
    let message = |damping, lead| {
        road(Keep::envelope(), damping)
            .run_block(&loads, lead, &mut |_, _| true)
            .unwrap_err()
            .to_string()
    };
    let lead = Lead { before: 10, warm_up: 3 };
    assert!(message(280e3, lead).contains("warm_up = 3: must be at least "));
    assert!(message(0.0, Lead { before: 10, warm_up: 2000 }).contains("at least inf instants"));
    let all = Lead { before: 0, warm_up: 3001 };
    assert_eq!(message(280e3, all), "warm_up = 3001: must be below the 3001 instants of the loads");
    assert!(road(Keep::envelope(), 0.0).warm_up(SPEED).unwrap().is_infinite());
}

/// A window of very many nodes is looked after as often as a small one.
#[test]
fn a_wide_window_is_watched_by_its_work() {
    let bed = Bed { stiffness: 8e7, damping: 0.0, mass: 0.0 };
    let section =
        Section { length: 3e4, bending_stiffness: 2e5, bending_damping: 0.0, mass: 2000.0, bed };
    let mesh = Mesh::new(&[section], 0.3, Foundation::Winkler, Ends::Clamped).unwrap();
    let road = Road::new(mesh, 1e-3, (Weights::Hermite, Hold::First), Keep::envelope()).unwrap();
    let (positions, forces) = crossing(40);
    let loads = Loads { axles: 2, positions: &positions, forces: &forces };
    let mut seen = Vec::new();
    let mut watch = |step, _| {
        seen.push(step);
        step < 20
    };
    assert!(matches!(road.run(&loads, &mut watch), Err(Error::Stopped { step: 20, .. })));
    assert_eq!(seen, (0..=20).collect::<Vec<_>>());
}
