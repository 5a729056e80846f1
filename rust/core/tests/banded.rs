//! The band of the transition matrix against the whole of it: the same histories, whatever the road.

// A test stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use pavefem_core::error::Error;
use pavefem_core::pavement::{Bed, Contact, Ends, Foundation, Mesh, Section, Strip, Weights};
use pavefem_core::response::banded::Road;
use pavefem_core::response::{Envelope, Hold, Keep, Loads, Record, Stepper};
use pavefem_core::transition::{Form, Transition};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const fn contact(weights: Weights, print: f64) -> Contact {
    Contact { weights, print }
}

/// The paper's first.
const SCHEMES: [(Contact, Hold); 4] = [
    (contact(Weights::Linear, 0.0), Hold::Zero),
    (contact(Weights::Linear, 0.3), Hold::First),
    (contact(Weights::Hermite, 0.7), Hold::Zero),
    (contact(Weights::Hermite, 0.0), Hold::First),
];

/// The paper's pavement at 20 degC, or a softer, lighter one on a stiffer bed.
fn section(length: f64, soft: bool) -> Section {
    let (bending_stiffness, mass, bed) =
        if soft { (4e4, 1600.0, 2e8) } else { (197_334.0, 2000.0, 8.65e7) };
    Section {
        length,
        bending_stiffness,
        bending_damping: 1750.0,
        mass,
        bed: Bed { stiffness: bed, damping: 280e3, mass: 355.0 / 1.5 },
    }
}

/// A truck of three axles that crosses, its forces going up and down.
#[derive(Debug, Clone)]
struct Passage {
    dt: f64,
    positions: Vec<f64>,
    forces: Vec<f64>,
}

impl Passage {
    fn new(length: f64, speed: f64, dt: f64) -> Self {
        let steps = ((length + 7.0) / (speed * dt)) as usize;
        let time = |step: usize| step as f64 * dt;
        let axles = [(0.0, 38_925.0), (4.55, 76_335.0), (5.85, 80_938.0)];
        let vary = |k: usize, x: f64| 1.0 + 0.3 * (60.0 * time(k) + x).sin();
        let rows = |of: &dyn Fn(usize, (f64, f64)) -> f64| -> Vec<f64> {
            (0..=steps).flat_map(|k| axles.map(|axle| of(k, axle))).collect()
        };
        let positions = rows(&|k, (x, _)| speed * time(k) - x);
        Self { dt, positions, forces: rows(&|k, (x, force)| force * vary(k, x)) }
    }

    fn loads(&self) -> Loads<'_> {
        Loads { axles: 3, positions: &self.positions, forces: &self.forces }
    }

    fn banded(&self, mesh: Mesh, scheme: (Contact, Hold), keep: &Keep) -> Record {
        let road = Road::new(mesh, self.dt, scheme, keep.clone(), &mut |_, _| true).unwrap();
        road.run(&self.loads(), &mut |_, _| true).unwrap()
    }

    fn whole(&self, mesh: Mesh, scheme: (Contact, Hold), keep: &Keep) -> Record {
        let strip = Strip::of(mesh).unwrap();
        let system = strip.system().clone();
        let transition =
            Transition::new(system, self.dt, Form::Integral, &mut |_, _| true).unwrap();
        let stepper = Stepper::new(strip, transition, scheme, keep, &mut |_, _| true).unwrap();
        stepper.run(&self.loads(), &mut |_, _| true).unwrap()
    }
}

/// Largest difference of two records, as a part of the largest deflection.
fn difference(found: &Record, expected: &Record) -> f64 {
    let values = |record: &Record| {
        let Envelope { lowest, highest, passes, .. } = &record.envelope;
        let envelope = lowest.iter().chain(highest).chain(passes);
        envelope.chain(&record.history).copied().collect::<Vec<f64>>()
    };
    let (found, expected) = (values(found), values(expected));
    assert_eq!(found.len(), expected.len());
    let peak = expected.iter().fold(0.0_f64, |peak, w| peak.max(w.abs()));
    assert!(peak > 0.0);
    let pairs = found.iter().zip(&expected);
    pairs.fold(0.0, |largest, (a, b)| f64::max(largest, (a - b).abs() / peak))
}

fn everything() -> Keep {
    Keep::deflection(true, &[10.21, 12.5, 24.9], 1)
}

#[test]
fn a_band_is_the_whole_matrix() {
    let uniform = |length: f64| vec![section(length, false)];
    let mixed = || vec![section(33.2, false), section(6.1, true), section(40.7, false)];
    for (sections, h) in [(uniform(25.0), 0.5), (uniform(100.0), 0.5), (mixed(), 0.5)] {
        for foundation in [Foundation::Bars, Foundation::Winkler] {
            for (ends, scheme) in
                [Ends::Clamped, Ends::Pinned, Ends::Free, Ends::Free].into_iter().zip(SCHEMES)
            {
                let mesh = Mesh::new(&sections, h, foundation, ends).unwrap();
                let length = sections.iter().map(|section| section.length).sum();
                let passage = Passage::new(length, 65.0 / 3.6, 1e-3);
                let found = passage.banded(mesh.clone(), scheme, &everything());
                let expected = passage.whole(mesh, scheme, &everything());
                let error = difference(&found, &expected);
                assert!(error < 1e-8, "{length} m {foundation:?} {ends:?} {scheme:?}: {error:.1e}");
            }
        }
    }
}

/// Where nothing damps the pavement the window is the whole road, and the band is what it is.
#[test]
fn without_damping_too() {
    let mut elastic = section(60.0, false);
    (elastic.bending_damping, elastic.bed.damping) = (0.0, 0.0);
    let mesh = Mesh::new(&[elastic], 0.5, Foundation::Bars, Ends::Pinned).unwrap();
    let passage = Passage::new(60.0, 20.0, 1e-3);
    let [found, expected] = [Passage::banded, Passage::whole]
        .map(|run| run(&passage, mesh.clone(), SCHEMES[0], &everything()));
    let error = difference(&found, &expected);
    assert!(error < 1e-8, "{error:.1e}");
}

/// Every n-th instant of the same history, and the same envelope.
#[test]
fn every_nth_instant() {
    let mesh = Mesh::new(&[section(40.0, false)], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    let passage = Passage::new(40.0, 20.0, 2e-3);
    let kept = |nodes, every| {
        let keep = Keep::deflection(nodes, &[12.3], every);
        passage.banded(mesh.clone(), SCHEMES[0], &keep)
    };
    let (all, some) = (kept(true, 1), kept(false, 7));
    let station: Vec<f64> = all.history.chunks_exact(82).map(|row| row[81]).step_by(7).collect();
    assert_eq!(some.history, station);
    assert_eq!(some.envelope, all.envelope);
}

/// Under constant forces every node of a uniform road, far from its ends, goes through the same.
#[test]
fn two_kilometres_are_uniform() {
    let mesh = Mesh::new(&[section(2000.0, false)], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    // A step of a whole part of an element: nodes differ by nothing but when axles pass.
    let dt = 1e-3;
    let steps = 2007 * 50;
    let place = |k: usize| [0.0, 4.5, 5.5].map(|x| 0.02 * k as f64 - x);
    let positions: Vec<f64> = (0..=steps).flat_map(place).collect();
    let forces = [38_925.0, 76_335.0, 80_938.0].repeat(steps + 1);
    let keep = Keep::envelope();
    let envelope = Passage { dt, positions, forces }.banded(mesh, SCHEMES[0], &keep).envelope;
    for extremes in [&envelope.lowest, &envelope.highest] {
        let inner = &extremes[200..3800];
        let error = inner.iter().map(|w| (w / inner[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(error < 1e-8, "{error:.1e}");
    }
}

#[test]
fn an_axle_that_goes_back_is_an_error() {
    let mesh = Mesh::new(&[section(200.0, false)], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    let mut passage = Passage::new(200.0, 20.0, 1e-3);
    for x in &mut passage.positions[3 * 8000..] {
        *x -= 120.0;
    }
    let road = Road::new(mesh, 1e-3, SCHEMES[0], everything(), &mut |_, _| true).unwrap();
    let error = road.run(&passage.loads(), &mut |_, _| true).err().map(|error| error.to_string());
    assert!(error.as_ref().is_some_and(|e| e.contains("axles only go forward")), "{error:?}");
}

/// While the band is looked for, and while it steps.
#[test]
fn it_stops_when_it_is_told_to() {
    let mesh = Mesh::new(&[section(80.0, false)], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    let mut calls = 0;
    let mut watch = |_, _| {
        calls += 1;
        calls < 3
    };
    let new = |watch: &mut dyn FnMut(usize, usize) -> bool| {
        Road::new(mesh.clone(), 1e-3, SCHEMES[0], everything(), watch)
    };
    assert!(matches!(new(&mut watch), Err(Error::Stopped { .. })));
    let road = new(&mut |_, _| true).unwrap();
    let passage = Passage::new(80.0, 20.0, 1e-3);
    let stopped = road.run(&passage.loads(), &mut |step, _| step == 0);
    assert!(matches!(stopped, Err(Error::Stopped { step: 1.., .. })), "{stopped:?}");
}

fn any_section() -> impl Strategy<Value = Section> {
    let log = |low: f64, high: f64| (low.ln()..high.ln()).prop_map(f64::exp);
    let damped = |low, high| prop_oneof![1 => Just(0.0), 4 => log(low, high)];
    let bed = (log(5e6, 1e9), damped(1e3, 1e6), damped(10.0, 1e3));
    let beam = (log(3e3, 1e6), damped(10.0, 1e4), log(200.0, 4e3));
    (2.0..18.0, beam, bed).prop_map(|(length, (bending_stiffness, bending_damping, mass), bed)| {
        let bed = Bed { stiffness: bed.0, damping: bed.1, mass: bed.2 };
        Section { length, bending_stiffness, bending_damping, mass, bed }
    })
}

fn any_road() -> impl Strategy<Value = Mesh> {
    let foundation = prop_oneof![Just(Foundation::Bars), Just(Foundation::Winkler)];
    let ends = prop_oneof![Just(Ends::Clamped), Just(Ends::Pinned), Just(Ends::Free)];
    let sections = proptest::collection::vec(any_section(), 1..4);
    (sections, 0.3..1.0, foundation, ends).prop_map(|(sections, h, foundation, ends)| {
        Mesh::new(&sections, h, foundation, ends).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 48,
        failure_persistence: None,
        // The same cases on every run: a failure says that the code has changed.
        rng_seed: RngSeed::Fixed(20),
        ..Default::default()
    })]

    #[test]
    fn on_any_road(
        mesh in any_road(),
        speed in 3.0..60.0,
        dt in 3e-4..4e-3,
        scheme in 0..4_usize,
    ) {
        let length = *mesh.nodes().last().unwrap();
        let passage = Passage::new(length, speed, dt);
        let keep = Keep::deflection(true, &[0.37 * length], 1);
        let road = Road::new(mesh.clone(), dt, SCHEMES[scheme], keep.clone(), &mut |_, _| true);
        // Refused where steps are long for the waves: then a band is no use.
        if matches!(road, Err(Error::TooWide { .. })) {
            return Err(TestCaseError::reject("too wide"));
        }
        let found = road.unwrap().run(&passage.loads(), &mut |_, _| true).unwrap();
        let error = difference(&found, &passage.whole(mesh, SCHEMES[scheme], &keep));
        prop_assert!(error < 1e-6, "{error:.1e}");
    }
}
