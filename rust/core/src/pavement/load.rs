//! Axle forces as nodal forces (the paper's Fig. 6).

use super::element::Weights;
use super::strip::Strip;
use crate::error::{Error, Result, check_count};

/// Share of an axle's force that one wheel track carries: the vehicle is symmetric left to right.
pub const TRACK_SHARE: f64 = 0.5;

/// Axle forces along the road: `instants x axles`, row by row.
#[derive(Debug, Clone, Copy)]
pub struct Loads<'a> {
    /// Number of axles.
    pub axles: usize,
    /// Place of each axle at each instant, m; off the road it loads nothing.
    pub positions: &'a [f64],
    /// Force of each axle at each instant, N, positive pressing on the road.
    pub forces: &'a [f64],
}

impl<'a> Loads<'a> {
    /// Places of the axles at an instant, m.
    #[inline(always)]
    pub(crate) fn places(&self, instant: usize) -> &'a [f64] {
        &self.positions[instant * self.axles..(instant + 1) * self.axles]
    }

    /// Mean speed of the first axle, m/s.
    pub(crate) fn speed(&self, dt: f64) -> f64 {
        let steps = self.positions.len() / self.axles - 1;
        let way = self.positions[steps * self.axles] - self.positions[0];
        if steps > 0 { way.abs() / (steps as f64 * dt) } else { 0.0 }
    }

    /// Largest distance between two axles at an instant, m.
    pub(crate) fn span(&self) -> f64 {
        let span = |row: &[f64]| {
            let extremes = |(low, high): (f64, f64), &x: &f64| (low.min(x), high.max(x));
            let (low, high) = row.iter().fold((f64::INFINITY, f64::NEG_INFINITY), extremes);
            high - low
        };
        self.positions.chunks_exact(self.axles).map(span).fold(0.0, f64::max)
    }

    /// The number of instants, if all fits.
    pub(crate) fn check(&self) -> Result<usize> {
        check_count("number of axles", self.axles, "at least 1", |axles| axles >= 1)?;
        let instants = self.positions.len() / self.axles;
        let expected = (instants.max(1), self.axles);
        for (name, values) in [("axle positions", self.positions), ("axle forces", self.forces)] {
            if values.len() != expected.0 * expected.1 {
                return Err(Error::Shape { name, got: (values.len(), 1), expected });
            }
            if let Some(at) = values.iter().position(|value| !value.is_finite()) {
                let (row, column) = (at / self.axles, at % self.axles);
                return Err(Error::NonFinite { name, value: values[at], row, column });
            }
        }
        Ok(instants)
    }
}

/// Forces on the unknowns of the road at one instant, up positive, few of them not zero.
#[derive(Debug, Default)]
pub(crate) struct NodalForces(pub(crate) Vec<(usize, f64)>);

impl NodalForces {
    /// What the axles do at `instant` (Fig. 6); a share on a held unknown goes into its support.
    pub(crate) fn set(
        &mut self,
        strip: &Strip,
        loads: &Loads<'_>,
        weights: Weights,
        instant: usize,
    ) {
        let row = instant * loads.axles..(instant + 1) * loads.axles;
        let axles = loads.positions[row.clone()].iter().zip(&loads.forces[row]);
        self.0.clear();
        for (&x, &force) in axles {
            let Some(shares) = strip.shares(x, weights) else { continue };
            for (unknown, weight) in shares.unknowns.into_iter().zip(shares.weights) {
                if let (Some(unknown), true) = (unknown, weight != 0.0) {
                    self.0.push((unknown, -TRACK_SHARE * force * weight));
                }
            }
        }
    }
}
