//! Two-way coupling: tires feel the deflection that they cause.
//!
//! Vehicle and pavement take each step together. Tire forces at its end follow from the deflection
//! under the axles there, and that from the forces: the deflection of before is carried on, then
//! vehicle and pavement step in turn until the forces no longer change. What an iteration leaves is the
//! part that a step's deflection under a force is of the tire's own, a hundredth or less, however
//! soft the pavement and however lightly the vehicle is damped. (Whole runs in turn, as waveform
//! relaxation has it, do without such steps; but axles that hop at little damping take them through
//! changes of many times the static load first.)
//!
//! A tire feels the deflection as it does the profile: its damper the rate at its moving place,
//! `dw/dt + v dw/dx`. Both wheel tracks carry half of an axle's force and sink alike, so that an axle
//! feels the deflection of one.

use crate::error::{Error, Result, Watch, diverged, go_on, reserve};
use crate::response::Loads;
use crate::response::window::{Follower, Road};
use crate::vehicle::{Passage, Profile, Rolling, State};

/// Change of a tire force at which it counts as found, as a part of its static load.
const SETTLED: f64 = 1e-9;

/// The same for a vehicle whose steps are divided, as a part of what they may add to an error.
const SETTLED_DIVIDED: f64 = 1e-3;

/// Most iterations of a step.
const ITERATIONS: usize = 40;

/// Steps between two looks at the watcher.
const WATCHED: usize = 256;

/// A vehicle and a road that feel each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupled {
    /// Force of each axle at each instant, N: `instants x axles`, row by row.
    pub forces: Vec<f64>,
    /// Deflection under each axle, m, up positive, in the same order; 0 off the road.
    pub under_axles: Vec<f64>,
    /// Most iterations that a step took.
    pub iterations: usize,
}

/// Tire forces over a road that gives way under them; `positions` are the places of the axles on the
/// road at each instant that is kept, m, row by row.
///
/// # Errors
/// As [`fleet`](crate::vehicle::fleet) and [`Road::run`]; [`Error::Uncoupled`].
pub fn two_way(
    passage: &Passage<'_>,
    profile: &Profile<'_>,
    road: &Road,
    positions: &[f64],
    watch: &mut Watch<'_>,
) -> Result<Coupled> {
    let run = &passage.run;
    let axles = passage.vehicle.static_loads().len();
    let size = (run.steps + 1).saturating_mul(axles);
    let (mut forces, mut under_axles) = (Vec::new(), Vec::new());
    reserve(&mut forces, size)?;
    reserve(&mut under_axles, size)?;
    forces.resize(size, 0.0);
    let pavement = Follower::new(road, &Loads { axles, positions, forces: &forces })?;
    let vehicle = Rolling::new(passage, profile)?;
    let state = vehicle.rest();
    let under = vec![[0.0; 2]; axles];
    let mut pair = Pair { passage, vehicle, state, pavement, positions, under };
    for step in 0..run.skip {
        if step % WATCHED == 0 {
            go_on(watch, step, run.total())?;
        }
        pair.state = pair.vehicle.advance(&pair.state, step, [&pair.under; 2])?;
    }
    pair.vehicle.forces(&pair.state, run.skip, &pair.under, &mut forces[..axles]);
    let mut iterations = 0;
    for instant in 0..run.steps {
        if instant % WATCHED == 0 {
            go_on(watch, run.skip + instant, run.total())?;
        }
        under_axles.extend(pair.under.iter().map(|[deflection, _]| deflection));
        iterations = iterations.max(pair.step(instant, &mut forces)?);
    }
    under_axles.extend(pair.under.iter().map(|[deflection, _]| deflection));
    go_on(watch, run.total(), run.total())?;
    Ok(Coupled { forces, under_axles, iterations })
}

/// A vehicle and the window of road under it, at one instant.
struct Pair<'a> {
    passage: &'a Passage<'a>,
    vehicle: Rolling<'a>,
    state: State,
    pavement: Follower<'a>,
    positions: &'a [f64],
    /// Deflection under each axle, m, and its rate, m/s.
    under: Vec<[f64; 2]>,
}

impl Pair<'_> {
    /// Go from an instant to the next, whose forces are found; the iterations it took.
    fn step(&mut self, instant: usize, forces: &mut [f64]) -> Result<usize> {
        let Passage { vehicle, run } = *self.passage;
        let loads = vehicle.static_loads();
        let (axles, positions) = (loads.len(), self.positions);
        let (now, next) = (instant * axles, (instant + 1) * axles..(instant + 2) * axles);
        let step = run.skip + instant;
        let is_linear = self.passage.is_linear();
        let settled = if is_linear { SETTLED } else { SETTLED_DIVIDED * run.tolerance };
        self.pavement.begin(&Loads { axles, positions, forces }, instant);
        // At first as if the deflection went on at its rate.
        let ahead = |&[w, rate]: &[f64; 2]| [w + run.dt * rate, rate];
        let mut after: Vec<_> = self.under.iter().map(ahead).collect();
        let mut found = vec![0.0; axles];
        let mut iterations = 0;
        loop {
            let state = self.vehicle.advance(&self.state, step, [&self.under, &after])?;
            self.vehicle.forces(&state, step + 1, &after, &mut found);
            if !found.iter().all(|force| force.is_finite()) {
                return Err(diverged("tire force", step + 1, run.dt));
            }
            let changes = found.iter().zip(&forces[next.clone()]).zip(loads);
            let change = changes.map(|((a, b), load)| (a - b).abs() / load).fold(0.0, f64::max);
            forces[next.clone()].copy_from_slice(&found);
            let exhausted = iterations == ITERATIONS;
            // Where a step is divided one way or the other, there may be no force in between.
            let limit = if exhausted && !is_linear { run.tolerance } else { settled };
            if iterations > 0 && change <= limit {
                (self.state, self.under) = (state, after);
                return Ok(iterations);
            }
            if exhausted {
                let place = positions[now];
                return Err(Error::Uncoupled { place, step: run.dt, iterations, change });
            }
            self.pavement.step(&Loads { axles, positions, forces }, instant)?;
            for (under, x) in after.iter_mut().zip(&positions[next.clone()]) {
                *under = self.pavement.under(*x, run.speed);
            }
            iterations += 1;
        }
    }
}
