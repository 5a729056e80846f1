//! The moving window against the same method on the whole road, and against the transition matrix.

// A test stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use nalgebra::DVector;
use pavefem_core::error::Error;
use pavefem_core::pavement::{Bed, Contact, Ends, Foundation, Mesh, Section, Strip, Weights};
use pavefem_core::response::window::Road;
use pavefem_core::response::{Hold, Keep, Loads, Record, Stepper};
use pavefem_core::transition::Transition;

const SPEED: f64 = 65.0 / 3.6;
const AXLES: [f64; 3] = [0.0, 4.55, 5.85];
const FORCES: [f64; 3] = [38_925.0, 76_335.0, 80_938.0];

/// The paper's pavement at 20 degC, and one twice as stiff on a softer bed.
fn section(length: f64, stiff: bool) -> Section {
    let (bending, bed) = if stiff { (4e5, 6e7) } else { (197_334.0, 8.65e7) };
    Section {
        length,
        bending_stiffness: bending,
        bending_damping: 1750.0,
        mass: 2000.0,
        bed: Bed { stiffness: bed, damping: 280e3, mass: 355.0 / 1.5 },
    }
}

/// A truck that crosses, its forces going up and down.
fn passage(length: f64, dt: f64) -> (Vec<f64>, Vec<f64>) {
    let steps = ((length + 7.0) / (SPEED * dt)) as usize;
    let time = |step: usize| step as f64 * dt;
    let positions = (0..=steps).flat_map(|k| AXLES.map(|x| SPEED * time(k) - x)).collect();
    let vary = |k: usize, axle: usize| 1.0 + 0.2 * (60.0 * time(k) + axle as f64).sin();
    let forces =
        (0..=steps).flat_map(|k| [0, 1, 2].map(|axle| FORCES[axle] * vary(k, axle))).collect();
    (positions, forces)
}

struct Case {
    sections: Vec<Section>,
    h: f64,
    foundation: Foundation,
    ends: Ends,
    scheme: (Contact, Hold),
    keep: Keep,
}

impl Case {
    fn mesh(&self) -> Mesh {
        Mesh::new(&self.sections, self.h, self.foundation, self.ends).unwrap()
    }

    fn length(&self) -> f64 {
        self.sections.iter().map(|section| section.length).sum()
    }

    fn window(&self, dt: f64, (positions, forces): &(Vec<f64>, Vec<f64>)) -> Record {
        let road = Road::new(self.mesh(), dt, self.scheme, self.keep.clone()).unwrap();
        road.run(&Loads { axles: 3, positions, forces }, &mut |_, _| true).unwrap()
    }

    fn dense(&self, dt: f64, (positions, forces): &(Vec<f64>, Vec<f64>)) -> Record {
        let strip = Strip::of(self.mesh()).unwrap();
        let transition = Transition::of(strip.system(), dt, &mut |_, _| true).unwrap();
        let stepper =
            Stepper::new(strip, transition, self.scheme, &self.keep, &mut |_, _| true).unwrap();
        stepper.run(&Loads { axles: 3, positions, forces }, &mut |_, _| true).unwrap()
    }

    /// The same two stages on the whole road, by dense matrices: displacements of all nodes.
    fn whole(&self, dt: f64, (positions, forces): &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
        let strip = Strip::of(self.mesh()).unwrap();
        let system = strip.system();
        let [m, c, k] = [&system.mass, &system.damping, &system.stiffness].map(|a| a.to_dense());
        let n = system.len();
        let g = 1.0 - 0.5_f64.sqrt();
        let lu = (&m + &c * (g * dt) + &k * (g * dt).powi(2)).lu();
        let load = |step: usize, part: f64| {
            let mut load = DVector::zeros(n);
            let part = if self.scheme.1 == Hold::Zero { 0.0 } else { part };
            for axle in 0..3 {
                let along = |values: &[f64]| {
                    let (a, b) = (values[3 * step + axle], values[3 * (step + 1) + axle]);
                    a + part * (b - a)
                };
                // The mean over a print, by so many points of what of it is on the road.
                let Contact { weights, print } = self.scheme.0;
                let x = along(positions);
                let rear = (x - 0.5 * print).max(0.0);
                let front = (x + 0.5 * print).min(self.length());
                let (points, part) =
                    if print > 0.0 { (500, (front - rear) / print) } else { (1, 1.0) };
                let share = 0.5 * along(forces) * part.max(0.0) / f64::from(points);
                for i in 0..points {
                    let at = rear + (front - rear) * (f64::from(i) + 0.5) / f64::from(points);
                    let at = if print > 0.0 { at } else { x };
                    let Some(shares) = strip.shares(at, weights) else { continue };
                    for (unknown, weight) in shares.unknowns.into_iter().zip(shares.weights) {
                        if let Some(unknown) = unknown {
                            load[unknown] -= share * weight;
                        }
                    }
                }
            }
            load
        };
        let (mut u, mut v) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
        let mut out = Vec::new();
        for step in 0..positions.len() / 3 {
            let at = |node: usize| strip.shares(strip.nodes()[node], Weights::Hermite).unwrap();
            out.extend((0..strip.nodes().len()).map(|node| at(node).read(u.as_slice())));
            if 3 * (step + 1) == positions.len() {
                break;
            }
            // Accelerations of both stages.
            let stage = |u: &DVector<f64>, v: &DVector<f64>, f: DVector<f64>| {
                lu.solve(&(f - &c * v - &k * (u + v * (g * dt)))).unwrap()
            };
            let a1 = stage(&u, &v, load(step, g));
            let v1 = &v + &a1 * (g * dt);
            let (u2, v2) = (&u + &v1 * ((1.0 - g) * dt), &v + &a1 * ((1.0 - g) * dt));
            let a2 = stage(&u2, &v2, load(step, 1.0));
            v = v2 + a2 * (g * dt);
            u = u2 + &v * (g * dt);
        }
        out
    }
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn peak(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, |peak, w| f64::max(peak, w.abs()))
}

fn cases() -> Vec<Case> {
    let all = Keep::deflection(true, &[], 1);
    let uniform = || vec![section(80.0, false)];
    let mixed = || vec![section(37.3, false), section(9.1, true), section(33.7, false)];
    let case = |sections: Vec<Section>, h, foundation, ends, scheme: (Weights, Hold)| Case {
        sections,
        h,
        foundation,
        ends,
        scheme: (scheme.0.into(), scheme.1),
        keep: all.clone(),
    };
    let spread = |print: f64, case: Case| {
        let contact = Contact { print, ..case.scheme.0 };
        Case { scheme: (contact, case.scheme.1), ..case }
    };
    // The bed damps a tenth, the beam nothing; and nothing at all is damped.
    let lightly = || {
        let mut light = section(80.0, false);
        (light.bending_damping, light.bed.damping) = (0.0, 28e3);
        vec![light]
    };
    let undamped = || {
        let mut elastic = section(40.0, false);
        (elastic.bending_damping, elastic.bed.damping) = (0.0, 0.0);
        vec![elastic]
    };
    let (paper, converged) = ((Weights::Linear, Hold::Zero), (Weights::Hermite, Hold::First));
    vec![
        case(uniform(), 0.5, Foundation::Bars, Ends::Clamped, paper),
        case(mixed(), 0.5, Foundation::Bars, Ends::Pinned, paper),
        case(uniform(), 0.25, Foundation::Winkler, Ends::Clamped, converged),
        case(mixed(), 0.25, Foundation::Winkler, Ends::Free, (Weights::Linear, Hold::First)),
        case(lightly(), 0.5, Foundation::Winkler, Ends::Clamped, converged),
        case(undamped(), 0.5, Foundation::Bars, Ends::Clamped, paper),
        spread(0.3, case(mixed(), 0.25, Foundation::Winkler, Ends::Free, converged)),
        spread(0.7, case(mixed(), 0.25, Foundation::Bars, Ends::Pinned, paper)),
    ]
}

#[test]
fn a_window_is_the_whole_road() {
    for case in cases() {
        let loads = passage(case.length(), 2e-3);
        let (found, expected) = (case.window(2e-3, &loads), case.whole(2e-3, &loads));
        let error = largest_difference(&found.history, &expected) / peak(&expected);
        assert!(error < 1e-6, "{:?} {:?}: {error:.1e}", case.foundation, case.ends);
        // The envelope is that of the histories.
        let nodes = found.envelope.lowest.len();
        let bound = 1e-6 * peak(&expected);
        for node in 0..nodes {
            let along: Vec<f64> = expected.iter().skip(node).step_by(nodes).copied().collect();
            let turns = turning_points(&along, case.scheme.1 == Hold::First);
            let low = turns.iter().map(|(low, _)| *low).fold(0.0, f64::min);
            let high = turns.iter().map(|(_, high)| *high).fold(0.0, f64::max);
            assert!((found.envelope.lowest[node] - low).abs() < bound, "node {node}");
            assert!((found.envelope.highest[node] - high).abs() < bound, "node {node}");
            let step = found.envelope.lowest_step[node];
            assert!((turns[step].0 - low).abs() < bound);
            // And that of each axle, while it is nearer than the others.
            let place = case.length() * node as f64 / (nodes - 1) as f64;
            if case.sections.len() > 1 {
                continue;
            }
            for axle in 0..3 {
                let nearest = |step: usize| {
                    let middle =
                        |a: usize| 0.5 * (loads.0[3 * step + a] + loads.0[3 * step + a + 1]);
                    (axle == 0 || middle(axle - 1) > place) && (axle == 2 || middle(axle) <= place)
                };
                let passing = turns.iter().enumerate().filter(|(step, _)| nearest(*step));
                let low = passing.map(|(_, (low, _))| *low).fold(0.0, f64::min);
                let found = found.envelope.passes[axle * nodes + node];
                assert!((found - low).abs() < bound, "axle {axle}, node {node}: {found} {low}");
            }
        }
    }
}

/// What a history goes down and up to about each instant: itself, or the vertex of the parabola
/// through it and those beside it.
fn turning_points(history: &[f64], between: bool) -> Vec<(f64, f64)> {
    let turn = |i: usize| {
        let is = history[i];
        if !between || i == 0 || i + 1 == history.len() {
            return (is, is);
        }
        let (left, right) = (history[i - 1], history[i + 1]);
        let (slope, bend) = ((right - left) / 2.0, right - 2.0 * is + left);
        let vertex = is - slope * slope / (2.0 * bend);
        let turns = (slope / bend).abs() <= 0.5;
        // Where a history only goes on, half a step of its bend is below what it turns to later.
        let bound = |sign: f64| is - sign * (sign * bend).max(0.0) / 8.0;
        if turns { (vertex.min(is), vertex.max(is)) } else { (bound(1.0), bound(-1.0)) }
    };
    (0..history.len()).map(turn).collect()
}

/// A vertex depends less on where an axle stands at the steps beside it.
#[test]
fn extremes_lie_between_steps() {
    let case = Case { sections: vec![section(20.0, false)], ..cases().remove(2) };
    let nodes = case.mesh().nodes().len();
    let inside = nodes / 4..3 * nodes / 4;
    let lowest = |dt: f64| {
        let loads = passage(case.length(), dt);
        let record = case.dense(dt, &loads);
        let samples = |node: usize| record.history.iter().skip(node).step_by(nodes).copied();
        let sampled: Vec<f64> = (0..nodes).map(|node| samples(node).fold(0.0, f64::min)).collect();
        [sampled, record.envelope.lowest]
    };
    let [_, fine] = lowest(1.25e-4);
    let error = |low: &[f64]| largest_difference(&low[inside.clone()], &fine[inside.clone()]);
    let [sampled, found] = lowest(1e-3).map(|low| error(&low) / peak(&fine));
    assert!(found < 0.5 * sampled, "{sampled:.1e} {found:.1e}");
}

/// Against the transition matrix, which follows linear forces exactly: second order in the step. (At
/// a free end, where an axle comes on from one instant to the next, it is the first.)
#[test]
fn second_order_against_the_transition_matrix() {
    let case = Case {
        sections: vec![section(40.0, false)],
        h: 0.25,
        foundation: Foundation::Winkler,
        ends: Ends::Clamped,
        scheme: (Weights::Hermite.into(), Hold::First),
        keep: Keep::deflection(true, &[], 1),
    };
    let error = |dt: f64| {
        let loads = passage(case.length(), dt);
        let exact = case.dense(dt, &loads).history;
        largest_difference(&case.window(dt, &loads).history, &exact) / peak(&exact)
    };
    let errors = [2e-3, 1e-3, 5e-4].map(error);
    let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    assert!(errors[1] < 1e-3, "{errors:?}");
    assert!(orders.iter().all(|order| (1.9..2.1).contains(order)), "{orders:?} of {errors:?}");
}

/// The steps for verification, under constant forces that pass nodes at the ends of steps (in one within
/// which they pass a node, a nodal force is not smooth): third order, against the transition matrix, whose
/// forces are linear in a step, extrapolated to steps of no length.
#[test]
fn third_order_where_asked_for() {
    let h = 0.325;
    let case = Case {
        sections: vec![section(26.0, false)],
        h,
        foundation: Foundation::Winkler,
        ends: Ends::Clamped,
        scheme: (Weights::Hermite.into(), Hold::First),
        keep: Keep::deflection(true, &[], 1),
    };
    let steady = |steps: usize| {
        let dt = h / SPEED / steps as f64;
        let instants = 60 * steps + 1;
        let place = |k: usize| SPEED * dt * k as f64;
        let positions: Vec<f64> = (0..instants).flat_map(|k| AXLES.map(|x| place(k) - x)).collect();
        (dt, (positions, FORCES.repeat(instants)))
    };
    let thin = |record: Record, every: usize| -> Vec<f64> {
        record.history.chunks_exact(81).step_by(every).flatten().copied().collect()
    };
    let [coarse, fine] = [64, 128].map(|steps| {
        let (dt, loads) = steady(steps);
        thin(case.dense(dt, &loads), steps)
    });
    let exact: Vec<f64> = coarse.iter().zip(&fine).map(|(c, f)| f + (f - c) / 3.0).collect();
    let error = |steps: usize| {
        let (dt, (positions, forces)) = steady(steps);
        let road = Road::new(case.mesh(), dt, case.scheme, case.keep.clone()).unwrap();
        let loads = Loads { axles: 3, positions: &positions, forces: &forces };
        let record = road.run_extrapolated(&loads, &mut |_, _| true).unwrap();
        largest_difference(&thin(record, steps), &exact) / peak(&exact)
    };
    let errors = [4, 8, 16].map(error);
    let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    assert!(orders.iter().all(|order| (2.8..3.4).contains(order)), "{orders:?} of {errors:?}");
    assert!(errors[1] < 1.2e-5, "{errors:?}");
}

/// Between nodes a station is read by the element's shape functions, as the dense stepper does.
#[test]
fn stations_lie_between_nodes() {
    for case in cases().into_iter().take(4) {
        let length = case.length();
        let keep = Keep::deflection(false, &[10.21, 37.3, 60.011], 7);
        let case = Case { keep, ..case };
        let loads = passage(length, 2.5e-4);
        let (window, dense) = (case.window(2.5e-4, &loads), case.dense(2.5e-4, &loads));
        let error = largest_difference(&window.history, &dense.history) / peak(&dense.history);
        assert!(error < 5e-3, "{:?}: {error:.1e}", case.foundation);
    }
}

#[test]
fn an_axle_that_goes_back_is_an_error() {
    let case = cases().remove(0);
    let (mut positions, forces) = passage(80.0, 1e-3);
    for x in &mut positions[3 * 4000..] {
        *x -= 60.0;
    }
    let road = Road::new(case.mesh(), 1e-3, case.scheme, case.keep).unwrap();
    let loads = Loads { axles: 3, positions: &positions, forces: &forces };
    let error = road.run(&loads, &mut |_, _| true).err().map(|error| error.to_string());
    assert!(error.as_ref().is_some_and(|e| e.contains("axles only go forward")), "{error:?}");
}

#[test]
fn a_run_stops_when_it_is_told_to() {
    let case = cases().remove(0);
    let (positions, forces) = passage(80.0, 1e-3);
    let road = Road::new(case.mesh(), 1e-3, case.scheme, case.keep).unwrap();
    let loads = Loads { axles: 3, positions: &positions, forces: &forces };
    let mut calls = 0;
    let mut watch = |_, _| {
        calls += 1;
        calls < 3
    };
    assert!(matches!(road.run(&loads, &mut watch), Err(Error::Stopped { .. })));
    assert_eq!(calls, 3);
}

/// Under constant forces every node of a uniform road, far from its ends, goes through the same, a
/// while later.
#[test]
fn two_kilometres_are_uniform() {
    let section = section(2000.0, false);
    let scheme = (Weights::Linear, Hold::Zero);
    let mesh = Mesh::new(&[section], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    let keep = Keep::deflection(false, &[], 1);
    // A step of a whole part of an element: nodes differ by nothing but when axles pass.
    let dt = 0.5 / 25.0 / SPEED;
    let road = Road::new(mesh, dt, scheme, keep).unwrap();
    let steps = (2007.0 / (SPEED * dt)) as usize;
    let axles = [0.0, 4.5, 5.5];
    let positions: Vec<f64> =
        (0..=steps).flat_map(|k| axles.map(|x| SPEED * dt * k as f64 - x)).collect();
    let forces = FORCES.repeat(steps + 1);
    let loads = Loads { axles: 3, positions: &positions, forces: &forces };
    let envelope = road.run(&loads, &mut |_, _| true).unwrap().envelope;
    for extremes in [&envelope.lowest, &envelope.highest] {
        let inner = &extremes[200..3800];
        let error = inner.iter().map(|w| (w / inner[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(error < 1e-6, "{error:.1e}");
    }
    // (Where two equal values follow each other, rounding tells which is the lowest.)
    let passing: Vec<_> = envelope.lowest_step[200..3800].windows(2).map(|s| s[1] - s[0]).collect();
    assert!(passing.iter().all(|steps| (24..=26).contains(steps)));
}
