//! A vehicle that goes one step at a time, on ground that gives way as is found on the way.

use nalgebra::DVector;

use super::{Model, State};
use crate::error::Result;
use crate::vehicle::contact::{Profile, Wheel};
use crate::vehicle::run::Passage;

/// What the ground under each tire gives way during a step, linear in time: its deflection, m, up
/// positive, and the rate at which the tire feels it change, m/s.
pub(super) struct Ground<'a> {
    /// At the step's beginning and end.
    ends: [&'a [[f64; 2]]; 2],
    /// Where the front axle is when the step begins, and how far it goes, m.
    front: f64,
    reach: f64,
}

impl Ground<'_> {
    /// Under a tire, when the front axle is at a place within the step.
    pub(super) fn at(&self, front: f64, tire: usize) -> [f64; 2] {
        let part = (front - self.front) / self.reach;
        let [before, after] = self.ends.map(|end| end[tire]);
        [0, 1].map(|k| before[k] + part * (after[k] - before[k]))
    }
}

/// A vehicle of any kind on its run; the linear one, too, goes by itself here.
pub(crate) struct Rolling<'a> {
    model: Model<'a>,
    wheels: Vec<Wheel<'a>>,
}

impl<'a> Rolling<'a> {
    /// # Errors
    /// As [`fleet`](crate::vehicle::fleet).
    pub(crate) fn new(passage: &'a Passage<'a>, profile: &'a Profile<'a>) -> Result<Self> {
        passage.run.check()?;
        let wheels = passage.vehicle.tires.iter().map(|tire| Wheel::new(profile, tire.print));
        Ok(Self { model: Model::new(passage)?, wheels: wheels.collect() })
    }

    /// At rest, where the run starts.
    pub(crate) fn rest(&self) -> State {
        let vehicle = self.model.passage.vehicle;
        let friction = vec![0.0; vehicle.frictions.len()];
        State { y: DVector::zeros(2 * vehicle.system().len()), friction }
    }

    /// The state after a step, counted from the start of the run, on ground that gives way by so
    /// much, m, at such a rate, m/s, under each tire at both its ends.
    ///
    /// # Errors
    /// As [`fleet`](crate::vehicle::fleet).
    pub(crate) fn advance(
        &mut self,
        state: &State,
        step: usize,
        ends: [&[[f64; 2]]; 2],
    ) -> Result<State> {
        let run = &self.model.passage.run;
        let front = run.place(step);
        let ground = Ground { ends, front, reach: run.reach() };
        self.model.advance(state, &mut self.wheels, Some(&ground), front, 0)
    }

    /// Tire forces at a step and state, N.
    pub(crate) fn forces(
        &mut self,
        state: &State,
        step: usize,
        ground: &[[f64; 2]],
        forces: &mut [f64],
    ) {
        let run = &self.model.passage.run;
        let front = run.place(step);
        let ground = Ground { ends: [ground; 2], front, reach: run.reach() };
        let roads = self.model.roads(&mut self.wheels, Some(&ground), front, run.dt);
        self.model.forces(state, &roads, forces);
    }
}
