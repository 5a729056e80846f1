//! Vehicles whose tires may leave the road and whose springs rub.
//!
//! What is not linear enters as forces beside the linear vehicle: a tire that would pull is held
//! back by as much, and dry friction resists the stretch of its spring. They go linearly through a
//! step, from their values at its beginning to those at its end, which depend on the state there:
//! a few equations, solved by iteration. A step on which nothing acts but the linear vehicle is a
//! linear step and costs no more. On any other, the tire forces at the end are compared with those
//! after two steps of half the length, and the step is divided until they agree.

mod rolling;

use nalgebra::DVector;
use pulp::Scalar;

use super::contact::{Profile, Wheel};
use super::model::Tire;
use super::record::{Keep, Keeper, Outlet, Record, Sums};
use super::run::{Passage, WATCHED};
use crate::error::{Error, Result, Watch, diverged, go_on, unwatched};
use crate::linalg::DMatrix;
use crate::transition::{Form, Transition};

use rolling::Ground;
pub(crate) use rolling::Rolling;

/// How often a step may be halved.
const HALVINGS: usize = 16;

/// Iterations after which the forces at the end of a step count as not found.
const ITERATIONS: usize = 40;

/// The change of a force at which the iteration stops, as a part of the tolerance.
const SETTLED: f64 = 1e-3;

/// A step of one length: what the state and forces at its beginning make of it.
struct Length {
    dt: f64,
    phi: DMatrix<f64>,
    /// The state that a unit force on each row leaves, held or growing to a unit.
    held: Vec<DVector<f64>>,
    growing: Vec<DVector<f64>>,
    /// What a unit of force on row `j` at the end adds to what row `i` is asked for there.
    coupling: DMatrix<f64>,
}

/// A vehicle with its rows: those of the tires, then those of the dry frictions.
struct Model<'a> {
    passage: &'a Passage<'a>,
    /// `R`: tire forces but for the road's part, then stretches.
    asked: Vec<DVector<f64>>,
    lengths: Vec<Length>,
    /// Largest error of a tire force that a step may leave, N.
    tolerances: Vec<f64>,
    least: f64,
}

/// State, and the forces of dry friction.
#[derive(Clone)]
pub(crate) struct State {
    y: DVector<f64>,
    friction: Vec<f64>,
}

/// What a step, undivided, comes to.
struct Step {
    state: State,
    /// Tire forces at its end, with the road as it was before there.
    forces: Vec<f64>,
    /// Whether anything acted but the linear vehicle.
    acted: bool,
}

/// What the road does to a tire during a step.
struct Excitation {
    /// Elevation through the step, which dampers and springs feel.
    begin: f64,
    end: f64,
    mean_velocity: f64,
    /// Elevation and velocity that the force is of, at its beginning and end.
    at_begin: (f64, f64),
    at_end: (f64, f64),
}

impl Excitation {
    /// Let the ground give way by so much, m, at such a rate, m/s, at both ends of the step.
    fn sink(&mut self, before: [f64; 2], after: [f64; 2], dt: f64) {
        self.begin += before[0];
        self.end += after[0];
        self.mean_velocity += (after[0] - before[0]) / dt;
        for (at, [deflection, rate]) in [(&mut self.at_begin, before), (&mut self.at_end, after)] {
            at.0 += deflection;
            at.1 += rate;
        }
    }
}

impl<'a> Model<'a> {
    fn new(passage: &'a Passage<'a>) -> Result<Self> {
        let Passage { vehicle, run } = passage;
        let n = vehicle.system().len();
        let rows: Vec<&DVector<f64>> =
            vehicle.rows.iter().chain(vehicle.frictions.iter().map(|(row, _)| row)).collect();
        let place = |row: &DVector<f64>, k: f64, c: f64| {
            let entries = row.iter().map(|r| k * r).chain(row.iter().map(|r| c * r));
            DVector::from_iterator(2 * n, entries)
        };
        let tires = vehicle.tires.iter().zip(&vehicle.rows);
        let asked: Vec<_> = tires
            .map(|(tire, row)| place(row, -tire.stiffness, -tire.damping))
            .chain(vehicle.frictions.iter().map(|(row, _)| place(row, 1.0, 0.0)))
            .collect();
        // The steps of a linear vehicle are never divided.
        let halvings = if passage.is_linear() { 0 } else { HALVINGS };
        let mut lengths = Vec::with_capacity(halvings + 1);
        for halvings in 0..=halvings {
            let dt = run.dt / (halvings as f64).exp2();
            let system = vehicle.system().clone();
            let transition = Transition::new(system, dt, Form::Integral, &mut unwatched)?;
            let (gamma, ramp) = (transition.gamma(), transition.ramp());
            let growing: Vec<_> = rows.iter().map(|&row| &ramp * row).collect();
            lengths.push(Length {
                dt,
                phi: transition.phi().to_dense(),
                held: rows.iter().map(|&row| &gamma * row).collect(),
                coupling: DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
                    asked[i].dot(&growing[j])
                }),
                growing,
            });
        }
        let tolerance = |load: &f64| load * run.tolerance;
        let tolerances: Vec<f64> = vehicle.static_loads().iter().map(tolerance).collect();
        let least = tolerances.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Self { passage, asked, lengths, tolerances, least })
    }

    /// The road under the tires from `front` on.
    fn roads(
        &self,
        wheels: &mut [Wheel<'_>],
        ground: Option<&Ground<'_>>,
        front: f64,
        dt: f64,
    ) -> Vec<Excitation> {
        let Passage { vehicle, run } = self.passage;
        let (reach, nudge) = (run.speed * dt, run.nudge());
        let road = |(tire, wheel): (&Tire, &mut Wheel<'_>)| {
            let x = front - tire.point.x;
            let begin = wheel.touch(x, nudge);
            let end = wheel.touch(x + reach, -nudge);
            let at_begin = (begin.elevation, run.speed * begin.slope);
            let at_end = (end.elevation, run.speed * end.slope);
            if wheel.jumps() {
                let mean = wheel.mean(x, x + reach);
                return Excitation { begin: mean, end: mean, mean_velocity: 0.0, at_begin, at_end };
            }
            let (begin, end) = (begin.elevation, end.elevation);
            Excitation { begin, end, mean_velocity: (end - begin) / dt, at_begin, at_end }
        };
        let mut roads: Vec<_> = vehicle.tires.iter().zip(wheels).map(road).collect();
        if let Some(ground) = ground {
            for (tire, road) in roads.iter_mut().enumerate() {
                road.sink(ground.at(front, tire), ground.at(front + reach, tire), dt);
            }
        }
        roads
    }

    /// The forces of the tires at a state, N.
    fn forces(&self, state: &State, roads: &[Excitation], forces: &mut [f64]) {
        for (axle, force) in forces.iter_mut().enumerate() {
            let asked = self.asked[axle].dot(&state.y);
            let linear = self.tire_force(axle, roads[axle].at_begin, asked);
            *force = linear + self.held_back(linear);
        }
    }

    /// The force of a linear tire, N.
    fn tire_force(&self, tire: usize, (elevation, velocity): (f64, f64), asked: f64) -> f64 {
        let vehicle = self.passage.vehicle;
        let Tire { stiffness, damping, .. } = vehicle.tires[tire];
        vehicle.static_loads()[tire] + stiffness * elevation + damping * velocity + asked
    }

    /// What holds a tire back whose force would be `linear`, N.
    fn held_back(&self, linear: f64) -> f64 {
        if self.passage.run.lift_off && linear < 0.0 { -linear } else { 0.0 }
    }

    /// One step, undivided; none where the forces at its end are not found.
    fn try_step(&self, state: &State, length: &Length, roads: &[Excitation]) -> Option<Step> {
        let vehicle = self.passage.vehicle;
        let tires = vehicle.tires.len();
        let asked = |y: &DVector<f64>| self.asked.iter().map(|row| row.dot(y)).collect::<Vec<_>>();
        let before = asked(&state.y);
        let mut y = &length.phi * &state.y;
        let mut begin = Vec::with_capacity(before.len());
        for (i, (tire, road)) in vehicle.tires.iter().zip(roads).enumerate() {
            let held_back = self.held_back(self.tire_force(i, road.at_begin, before[i]));
            let held = tire.stiffness * road.begin + tire.damping * road.mean_velocity + held_back;
            y.axpy(held, &length.held[i], 1.0);
            y.axpy(tire.stiffness * (road.end - road.begin) - held_back, &length.growing[i], 1.0);
            begin.push(held_back);
        }
        // Friction pulls the ends of its spring together where it is above 0.
        for (j, &friction) in state.friction.iter().enumerate() {
            y.axpy(-friction, &length.held[tires + j], 1.0);
            y.axpy(friction, &length.growing[tires + j], 1.0);
            begin.push(-friction);
        }
        let base = asked(&y);
        let mut end = begin.clone();
        for _ in 0..ITERATIONS {
            let after = |i: usize| {
                base[i]
                    + end.iter().enumerate().map(|(j, e)| length.coupling[(i, j)] * e).sum::<f64>()
            };
            let next: Vec<f64> = (0..end.len())
                .map(|i| match i.checked_sub(tires) {
                    None => self.held_back(self.tire_force(i, roads[i].at_end, after(i))),
                    Some(j) => -self.rubbed(j, state.friction[j], after(i) - before[i]),
                })
                .collect();
            let change = end.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            end = next;
            if change <= SETTLED * self.least {
                let acted = begin.iter().chain(&end).any(|force| *force != 0.0);
                for (growing, force) in length.growing.iter().zip(&end) {
                    y.axpy(*force, growing, 1.0);
                }
                let after = asked(&y);
                let forces =
                    (0..tires).map(|i| self.tire_force(i, roads[i].at_end, after[i])).collect();
                let friction = end[tires..].iter().map(|force| -force).collect();
                return Some(Step { state: State { y, friction }, forces, acted });
            }
        }
        None
    }

    /// The force of dry friction after a change of stretch.
    fn rubbed(&self, number: usize, before: f64, change: f64) -> f64 {
        let friction = self.passage.vehicle.frictions[number].1;
        let limit = friction.force.copysign(change);
        limit + (before - limit) * (-change.abs() / friction.travel).exp()
    }

    /// A step that starts with the front axle at `front`, divided as often as it takes.
    fn advance(
        &self,
        state: &State,
        wheels: &mut [Wheel<'_>],
        ground: Option<&Ground<'_>>,
        front: f64,
        halvings: usize,
    ) -> Result<State> {
        let whole = &self.lengths[halvings];
        let roads = self.roads(wheels, ground, front, whole.dt);
        let once = self.try_step(state, whole, &roads);
        let once = match once {
            Some(Step { state, acted: false, .. }) => return Ok(state),
            once => once,
        };
        let unsettled = Error::Unsettled {
            quantity: "tire forces",
            place: front,
            step: whole.dt,
            tolerance: self.passage.run.tolerance,
        };
        let Some(half) = self.lengths.get(halvings + 1) else { return Err(unsettled) };
        let middle = front + self.passage.run.speed * half.dt;
        if let Some(once) = &once {
            let first = self.roads(wheels, ground, front, half.dt);
            let second = self.roads(wheels, ground, middle, half.dt);
            if let Some(first) = self.try_step(state, half, &first)
                && let Some(twice) = self.try_step(&first.state, half, &second)
                && self.agree(once, &twice)
            {
                return Ok(twice.state);
            }
        }
        let first = self.advance(state, wheels, ground, front, halvings + 1)?;
        self.advance(&first, wheels, ground, middle, halvings + 1)
    }

    fn agree(&self, once: &Step, twice: &Step) -> bool {
        let mut pairs = once.forces.iter().zip(&twice.forces).zip(&self.tolerances);
        pairs.all(|((once, twice), tolerance)| (once - twice).abs() <= *tolerance)
    }
}

/// Run a vehicle with lift-off, dry friction or both.
pub(super) fn run<'a>(
    passage: &'a Passage<'a>,
    profile: &Profile<'_>,
    keep: &'a Keep,
    outlet: Option<Outlet<'a>>,
    watch: &mut Watch<'_>,
) -> Result<Record> {
    let Passage { vehicle, run } = passage;
    let model = Model::new(passage)?;
    let mut wheels: Vec<_> =
        vehicle.tires.iter().map(|tire| Wheel::new(profile, tire.print)).collect();
    let tires = vehicle.tires.len();
    let mut sums = Sums::new(tires, 1);
    sums.enter(0, vehicle.static_loads(), None);
    let mut keeper = Keeper::new(passage, keep, outlet)?;
    let mut forces = vec![0.0; tires];
    let mut state = State {
        y: DVector::zeros(2 * vehicle.system().len()),
        friction: vec![0.0; vehicle.frictions.len()],
    };
    for step in 0..=run.total() {
        if step % WATCHED == 0 {
            go_on(watch, step, run.total())?;
            if sums.unsound_lane().is_some() {
                return Err(diverged("tire force", step, run.dt));
            }
        }
        let front = run.place(step);
        let roads = model.roads(&mut wheels, None, front, run.dt);
        model.forces(&state, &roads, &mut forces);
        if step == run.skip {
            sums.count(0, true);
        }
        sums.take(Scalar, step as i64, &forces);
        keeper.take(step, |axle| forces[axle])?;
        if step < run.total() {
            state = model.advance(&state, &mut wheels, None, front, 0)?;
        }
    }
    let mut saved = Vec::new();
    sums.save(0, &mut saved);
    keeper.finish(&saved)
}
