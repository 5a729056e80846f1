//! One vehicle's run over a profile.

use super::model::Vehicle;
use crate::error::{Result, check, check_count, positive};

/// Farthest place from the origin of stations, m: a micrometre is lost in rounding beyond.
pub(super) const FARTHEST: f64 = 1e9;

/// Most steps of a run.
pub(super) const LONGEST: usize = 1_000_000_000;

/// Steps between two looks at the watcher.
pub(super) const WATCHED: usize = 1024;

/// How near a sample counts as the sample, m, in steps of length `reach`.
#[inline(always)]
pub(super) fn nudge(reach: f64) -> f64 {
    1e-6 * reach
}

/// One run over a profile at constant speed.
///
/// The vehicle starts at rest, at equilibrium on the level of the profile's first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Speed, m/s.
    pub speed: f64,
    /// Time step, s.
    pub dt: f64,
    /// Station of the front axle when the run starts, m.
    pub start: f64,
    /// Steps before the first one that is kept.
    pub skip: usize,
    /// Steps that are kept, along with the instant they start from.
    pub steps: usize,
    /// Whether a tire that would pull at the road leaves it.
    pub lift_off: bool,
    /// Error that a step may add to a tire force where lift-off or dry friction act, as a part of
    /// the static load: 1e-8 to 0.1.
    pub tolerance: f64,
}

impl Run {
    /// All steps.
    #[inline(always)]
    pub(crate) fn total(&self) -> usize {
        self.skip.saturating_add(self.steps)
    }

    /// Place of the front axle at a step, m.
    #[inline(always)]
    pub(super) fn place(&self, step: usize) -> f64 {
        self.start + self.speed * self.dt * step as f64
    }

    /// Length of a step, m.
    #[inline(always)]
    pub(super) fn reach(&self) -> f64 {
        self.speed * self.dt
    }

    /// How near a sample counts as the sample, m.
    #[inline(always)]
    pub(super) fn nudge(&self) -> f64 {
        nudge(self.reach())
    }

    pub(super) fn check(&self) -> Result<()> {
        positive("speed", self.speed, "m/s")?;
        positive("time step dt", self.dt, "s")?;
        let allowed = "1e-8 to 0.1 of the static load";
        check("tolerance", self.tolerance, "", allowed, |part| (1e-8..=0.1).contains(&part))?;
        check_count("steps", self.total(), "at most 1e9", |steps| steps <= LONGEST)?;
        for (name, place) in [("start", self.start), ("end", self.place(self.total()))] {
            let allowed = "within a million km of 0";
            check(name, place, "m", allowed, |place| place.abs() <= FARTHEST)?;
        }
        Ok(())
    }
}

/// A vehicle and its run.
#[derive(Debug, Clone, Copy)]
pub struct Passage<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Its run.
    pub run: Run,
}

impl Passage<'_> {
    pub(crate) fn is_linear(&self) -> bool {
        !self.run.lift_off && self.vehicle.frictions.is_empty()
    }
}
