//! Traffic against the same method on the whole road, and against itself cut in other ways.

// A test stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use std::num::NonZero;

use nalgebra::DVector;
use pavefem_core::pavement::{Bed, Contact, Ends, Foundation, Mesh, Section, Strip, Weights};
use pavefem_core::response::Hold;
use pavefem_core::response::traffic::{
    Break, Carriageway, Discretisation, INTERVAL, Inputs, Lane, Outcome, Passage, Precision,
    Surface, Totals, Traffic,
};
use pavefem_core::vehicle::{Body, Interpolation, Point, Spring, Tire, Vehicle};

const DT: f64 = 1e-3;

/// The paper's pavement at 20 degC, its stiffness as at a speed.
fn section(length: f64, stiffness: f64) -> Section {
    Section {
        length,
        bending_stiffness: 197_334.0 * stiffness,
        bending_damping: 1750.0,
        mass: 2000.0,
        bed: Bed { stiffness: 8.65e7 * stiffness.sqrt(), damping: 280e3, mass: 355.0 / 1.5 },
    }
}

/// A body on so many axles.
fn lorry(axles: &[f64], mass: f64) -> Vehicle {
    let point = |body, x| Point { body, x };
    let middle = axles.iter().sum::<f64>() / axles.len() as f64;
    let mut bodies = vec![Body { mass, inertia: mass * 2.0, x: middle, pin: None }];
    let (mut springs, mut tires) = (Vec::new(), Vec::new());
    for (i, &x) in axles.iter().enumerate() {
        bodies.push(Body { mass: 800.0, inertia: 0.0, x, pin: None });
        springs.push(Spring {
            upper: point(0, x),
            lower: vec![point(i + 1, x)],
            stiffness: 1.5e6,
            damping: 3e4,
            friction: None,
        });
        tires.push(Tire { point: point(i + 1, x), print: 0.0, stiffness: 2e6, damping: 5e3 });
    }
    Vehicle::new(&bodies, &springs, &tires).unwrap()
}

fn rough(length: f64) -> Surface {
    let x: Vec<f64> = (0..(length / 0.25) as usize).map(|i| -60.0 + 0.25 * i as f64).collect();
    let z = x.iter().map(|x| 0.004 * (1.3 * x).sin() + 0.003 * (0.41 * x + 1.0).sin());
    Surface { z: z.collect(), x, interpolation: Interpolation::Linear }
}

fn passage(vehicle: usize, lane: usize, time: f64, speed: f64, class: usize) -> Passage {
    Passage {
        vehicle,
        lane,
        share: 1.0,
        run_in: 50.0,
        breaks: vec![Break { time, place: 0.0, speed }],
        classes: vec![class],
        until: f64::INFINITY,
    }
}

struct Case {
    sections: Vec<f64>,
    h: f64,
    foundation: Foundation,
    ends: Ends,
    contact: Contact,
    hold: Hold,
    stiffness: Vec<f64>,
    smooth: bool,
    passages: Vec<Passage>,
}

impl Case {
    fn sections(&self, class: usize) -> Vec<Section> {
        let section = |(i, &length): (usize, &f64)| {
            section(length, self.stiffness[class] * if i % 2 == 1 { 1.7 } else { 1.0 })
        };
        self.sections.iter().enumerate().map(section).collect()
    }

    fn length(&self) -> f64 {
        self.sections.iter().sum()
    }

    fn inputs(&self) -> Inputs {
        let classes: Vec<Vec<Section>> =
            (0..self.stiffness.len()).map(|class| self.sections(class)).collect();
        let mirrored = classes.iter().map(|class| class.iter().rev().copied().collect()).collect();
        let thickness = vec![0.1; self.sections.len()];
        let surface = (!self.smooth).then_some(0);
        Inputs {
            scheme: Discretisation {
                element_length: self.h,
                foundation: self.foundation,
                ends: self.ends,
                contact: self.contact,
                hold: self.hold,
                dt: DT,
                precision: Precision::Double,
            },
            roads: vec![
                Carriageway { classes, thickness: thickness.clone() },
                Carriageway { classes: mirrored, thickness },
            ],
            surfaces: vec![rough(self.length() + 120.0)],
            lanes: vec![
                Lane { road: 0, surface },
                Lane { road: 0, surface },
                Lane { road: 1, surface },
            ],
            vehicles: vec![lorry(&[0.0, 4.5, 5.8], 15e3), lorry(&[0.0, 3.8], 9e3)],
            passages: self.passages.clone(),
            outcome: Outcome {
                powers: vec![1.0, 4.0, 4.5],
                bins: vec![1e-4, 2e-4, 4e-4, 8e-4],
                stations: vec![(0, 0.4 * self.length()), (0, 0.5 * self.length() + 0.1)],
                ticks: 0..i64::MAX,
                part: (0.0, f64::INFINITY),
            },
        }
    }
}

fn run(inputs: Inputs, threads: usize) -> (Traffic, Vec<f64>) {
    let mut run = Traffic::new(inputs, NonZero::new(threads).unwrap()).unwrap();
    let mut history = Vec::new();
    while !run.is_finished() {
        let before = run.tick();
        let rows = run.advance().unwrap();
        if before >= 0 {
            history.extend(rows);
        }
    }
    (run, history)
}

/// The same two stages on the whole road: the deflections of all nodes at all ticks, of one passage.
fn whole(case: &Case, passage: &Passage, forces: &[Vec<f64>], ticks: usize) -> Vec<DVector<f64>> {
    let sections = case.sections(passage.classes[0]);
    let mesh = Mesh::new(&sections, case.h, case.foundation, case.ends).unwrap();
    let strip = Strip::of(mesh).unwrap();
    let system = strip.system();
    let [m, c, k] = [&system.mass, &system.damping, &system.stiffness].map(|a| a.to_dense());
    let n = system.len();
    let g = (1.0 - 0.5_f64.sqrt()) * DT;
    let lu = (&m + &c * g + &k * (g * g)).lu();
    let offsets: &[f64] = if passage.vehicle == 0 { &[0.0, 4.5, 5.8] } else { &[0.0, 3.8] };
    let Break { time, speed, .. } = passage.breaks[0];
    let load = |tick: usize, part: f64| {
        let part = if case.hold == Hold::Zero { 0.0 } else { part };
        let mut load = DVector::zeros(n);
        for (axle, offset) in offsets.iter().enumerate() {
            let x = speed * ((tick as f64 + part) * DT - time) - offset;
            let force = forces[tick][axle] + part * (forces[tick + 1][axle] - forces[tick][axle]);
            let Some(shares) = strip.shares(x, case.contact.weights) else { continue };
            for (unknown, weight) in shares.unknowns.into_iter().zip(shares.weights) {
                if let Some(unknown) = unknown {
                    load[unknown] -= 0.5 * force * weight;
                }
            }
        }
        load
    };
    let (mut u, mut v) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
    let mut out = Vec::new();
    for tick in 0..ticks {
        let at = |node: usize| strip.shares(strip.nodes()[node], Weights::Hermite).unwrap();
        let nodes = strip.nodes().len();
        out.push(DVector::from_iterator(nodes, (0..nodes).map(|i| at(i).read(u.as_slice()))));
        let stage = |u: &DVector<f64>, v: &DVector<f64>, f: DVector<f64>| {
            lu.solve(&(f - &c * v - &k * (u + v * g))).unwrap()
        };
        let first = 1.0 - 0.5_f64.sqrt();
        let a1 = stage(&u, &v, load(tick, first));
        let v1 = &v + &a1 * g;
        let (late, rest) = (DT - g, &u + &v1 * (DT - g));
        let a2 = stage(&rest, &(&v + &a1 * late), load(tick, 1.0));
        v += &a1 * late + &a2 * g;
        u = rest + &v * g;
    }
    out
}

/// Tire forces of a passage at all ticks, as the core finds them for one vehicle.
fn forces(case: &Case, passage: &Passage, vehicle: &Vehicle, ticks: usize) -> Vec<Vec<f64>> {
    use pavefem_core::vehicle::{Profile, Run};
    let loads = vehicle.static_loads().to_vec();
    if case.smooth {
        return vec![loads; ticks + 1];
    }
    let Break { time, speed, .. } = passage.breaks[0];
    // It starts a whole number of ticks before it comes onto the road.
    let skip = ((50.0 / speed) / DT).ceil() as usize;
    let entry = (time / DT).round() as usize;
    let surface = rough(case.length() + 120.0);
    let profile = Profile::new(&surface.x, &surface.z, surface.interpolation).unwrap();
    let run = Run {
        speed,
        dt: DT,
        start: -(skip as f64) * speed * DT,
        skip,
        steps: ticks - entry,
        lift_off: false,
        tolerance: 1e-4,
    };
    let found = vehicle.tire_forces(&profile, &run, &mut |_, _| true).unwrap();
    let rows = found.chunks_exact(loads.len()).map(<[f64]>::to_vec);
    vec![loads.clone(); entry].into_iter().chain(rows).collect()
}

/// The largest difference between what traffic comes to and the sum of all passages on the whole road,
/// as a part of the largest deflection: of the envelope, and of the stations' histories.
fn differences(case: &Case) -> [f64; 2] {
    let inputs = case.inputs();
    let vehicles = inputs.vehicles.clone();
    let (run, history) = run(inputs, 2);
    let ticks = run.tick() as usize;
    let nodes = run.nodes().to_vec();
    let (mut envelope, mut stations, mut peak) = (0.0_f64, 0.0_f64, 0.0_f64);
    for lane in 0..2 {
        let mut sum = vec![DVector::zeros(nodes.len()); ticks];
        for passage in case.passages.iter().filter(|passage| passage.lane == lane) {
            let forces = forces(case, passage, &vehicles[passage.vehicle], ticks);
            for (sum, more) in sum.iter_mut().zip(whole(case, passage, &forces, ticks)) {
                *sum += more;
            }
        }
        let Totals { lowest, highest, .. } = &run.totals()[lane];
        for node in 0..nodes.len() {
            let at: Vec<f64> = sum.iter().map(|row| row[node]).collect();
            let (mut low, mut high) = (0.0_f64, 0.0_f64);
            for three in at.windows(3) {
                let (to, from) = (three[2] - three[1], three[1] - three[0]);
                let (slope, bend) = (to + from, to - from);
                let vertex = 0.125 * slope * slope / bend.abs().max(f64::MIN_POSITIVE);
                let sharp = if case.hold == Hold::Zero { 0.0 } else { 1.0 };
                low = low.min(three[1] - sharp * vertex.min((0.125 * bend).max(0.0)));
                high = high.max(three[1] + sharp * vertex.min((-0.125 * bend).max(0.0)));
            }
            peak = peak.max(-low);
            envelope = envelope.max((low - lowest[node]).abs()).max((high - highest[node]).abs());
        }
        if lane == 0 {
            let at = nodes.iter().position(|x| (x - 0.4 * case.length()).abs() < 1e-9).unwrap();
            for (row, history) in sum.iter().zip(history.chunks_exact(2)) {
                stations = stations.max((row[at] - history[0]).abs());
            }
        }
    }
    [envelope / peak, stations / peak]
}

fn base() -> Case {
    Case {
        sections: vec![60.0],
        h: 0.5,
        foundation: Foundation::Winkler,
        ends: Ends::Clamped,
        contact: Weights::Hermite.into(),
        hold: Hold::First,
        stiffness: vec![1.0],
        smooth: true,
        passages: vec![passage(0, 0, 0.0, 20.0, 0)],
    }
}

#[test]
fn one_vehicle_is_that_on_the_whole_road() {
    let found = differences(&base());
    assert!(found.into_iter().all(|d| d < 1e-6), "{found:?}");
}

#[test]
fn followers_are_added_before_any_extreme() {
    // 9 m and 14 m behind one another, the rear of one beside the front of the next.
    let passages = vec![
        passage(0, 0, 0.2, 20.0, 0),
        passage(1, 0, 0.65, 20.0, 0),
        passage(0, 0, 1.35, 20.0, 0),
        passage(1, 1, 0.5, 24.0, 0),
    ];
    let found = differences(&Case { passages, ..base() });
    assert!(found.into_iter().all(|d| d < 1e-6), "{found:?}");
}

#[test]
fn rough_roads_sections_and_other_schemes() {
    let passages = || {
        vec![
            passage(0, 0, 0.1, 20.0, 0),
            passage(1, 0, 0.6, 20.0, 1),
            passage(0, 0, 1.4, 25.0, 1),
            passage(1, 1, 0.0, 25.0, 0),
        ]
    };
    let stiffness = || vec![1.0, 1.3];
    let sections = || vec![30.0, 20.0, 30.0];
    let rough = Case { passages: passages(), stiffness: stiffness(), smooth: false, ..base() };
    let cut = Case {
        passages: passages(),
        stiffness: stiffness(),
        smooth: false,
        sections: sections(),
        ..base()
    };
    // Between ticks, so that no rounding decides whether an axle is on a free end at one.
    let mut between = passages();
    between.iter_mut().for_each(|passage| passage.breaks[0].time += 0.37 * DT);
    let bars = Case {
        passages: between,
        stiffness: stiffness(),
        sections: sections(),
        foundation: Foundation::Bars,
        contact: Weights::Linear.into(),
        hold: Hold::Zero,
        ends: Ends::Free,
        ..base()
    };
    for (name, case) in [("rough", rough), ("sections", cut), ("bars", bars)] {
        let found = differences(&case);
        assert!(found.into_iter().all(|d| d < 1e-6), "{name}: {found:?}");
    }
}

/// Every digit of what a run came to; NaN is NaN.
fn shown(run: &Traffic) -> String {
    format!("{:?} {:?}", run.totals(), run.worst())
}

#[test]
fn threads_and_stops_change_no_bit() {
    let passages: Vec<Passage> = (0..30)
        .map(|i| {
            let time = 0.45 * f64::from(i / 3);
            passage(i as usize % 2, i as usize % 3, time, 20.0, (i / 3) as usize % 2)
        })
        .collect();
    let case = Case {
        passages,
        stiffness: vec![1.0, 1.3],
        smooth: false,
        sections: vec![40.0, 30.0],
        ..base()
    };
    let (one, history) = run(case.inputs(), 1);
    let (two, again) = run(case.inputs(), 3);
    assert!(shown(&one) == shown(&two), "of one thread and of three");
    assert_eq!(history, again);
    let mut begun = Traffic::new(case.inputs(), NonZero::<usize>::MIN).unwrap();
    while begun.tick() < 8 * INTERVAL {
        begun.advance().unwrap();
    }
    let mut resumed = Traffic::new(case.inputs(), NonZero::<usize>::MIN).unwrap();
    resumed.restore(&begun.state()).unwrap();
    while !resumed.is_finished() {
        resumed.advance().unwrap();
    }
    assert!(shown(&one) == shown(&resumed), "of a run that was taken up again");
    assert_eq!(one.rides(), resumed.rides());
    let state = begun.state();
    for cut in (0..state.len()).step_by(997) {
        assert!(resumed.restore(&state[..cut]).is_err());
    }
}

#[test]
fn every_axle_passes_every_node_once() {
    let passages = (0..9).map(|i| passage(i % 2, 0, 0.5 * i as f64, 20.0, 0)).collect();
    let (run, _) = run(Case { passages, ..base() }.inputs(), 2);
    let axles = 5 * 3 + 4 * 2;
    let Totals { passes, histogram, force_powers, lowest, .. } = &run.totals()[0];
    assert!(passes.iter().all(|passes| *passes == axles), "{passes:?}");
    for bins in histogram.chunks_exact(5) {
        assert_eq!(bins.iter().sum::<u32>(), axles as u32);
    }
    let vehicles = base().inputs().vehicles;
    let loads = |number: usize| vehicles[number].static_loads().iter();
    let sum: f64 =
        loads(0).map(|load| 5.0 * load / 2.0).chain(loads(1).map(|load| 4.0 * load / 2.0)).sum();
    for powers in force_powers.chunks_exact(3) {
        assert!((powers[0] / sum - 1.0).abs() < 1e-12);
    }
    let deepest = lowest.iter().copied().fold(0.0, f64::min);
    let worst = run.worst().iter().map(|worst| worst.lowest).fold(0.0, f64::min);
    assert_eq!(deepest, worst);
}

#[test]
fn parts_of_time_and_road_come_to_the_whole() {
    let passages = (0..10).map(|i| passage(i % 2, 0, 0.6 * i as f64, 20.0, 0)).collect();
    let case = Case { passages, sections: vec![120.0], smooth: false, ..base() };
    let (all, _) = run(case.inputs(), 2);
    let all = &all.totals()[0];
    let peak = -all.lowest.iter().copied().fold(0.0, f64::min);
    let sums = |parts: &[Inputs]| {
        let found: Vec<Totals> =
            parts.iter().map(|part| run(part.clone(), 2).0.totals()[0].clone()).collect();
        for node in 0..all.lowest.len() {
            let passes: u64 = found.iter().map(|part| part.passes[node]).sum();
            assert_eq!(passes, all.passes[node], "at node {node}");
            let lowest = found.iter().map(|part| part.lowest[node]).fold(0.0, f64::min);
            assert!((lowest - all.lowest[node]).abs() < 1e-6 * peak, "at node {node}");
            for power in 3 * node..3 * (node + 1) {
                let sum: f64 = found.iter().map(|part| part.deflection_powers[power]).sum();
                assert!((sum / all.deflection_powers[power] - 1.0).abs() < 1e-5 || sum == 0.0);
            }
        }
    };
    let time = |ticks: std::ops::Range<i64>| {
        let mut inputs = case.inputs();
        inputs.outcome.ticks = ticks;
        inputs
    };
    sums(&[time(0..4000), time(4000..7777), time(7777..i64::MAX)]);
    let road = |from: f64, to: f64| {
        let mut inputs = case.inputs();
        inputs.outcome.part = (from, to);
        inputs.outcome.stations.clear();
        inputs
    };
    sums(&[road(0.0, 40.0), road(40.0, 77.5), road(77.5, 120.0)]);
}
