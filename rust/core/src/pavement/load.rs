//! Axle forces as nodal forces (the paper's Fig. 6).

use super::element::Weights;
use super::mesh::Mesh;
use super::strip::Strip;
use crate::error::{Error, Result, check, check_count};

/// Gauss points of a stretch from -1 to 1: `1 / sqrt 3`.
const GAUSS: f64 = 0.577_350_269_189_625_8;

/// Share of an axle's force that one wheel track carries: the vehicle is symmetric left to right.
pub const TRACK_SHARE: f64 = 0.5;

/// Shortest tire print that is not a point, m: what is left of its ends at large `x` after rounding is
/// a small part of it.
const SHORTEST_PRINT: f64 = 1e-3;

/// How an axle force comes onto the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// How a force between two nodes is shared.
    pub weights: Weights,
    /// Length of road over which the force is evenly spread, about the axle's place, m; 0 is a
    /// point. What of it lies off the road loads nothing.
    pub print: f64,
}

impl From<Weights> for Contact {
    /// In a point.
    fn from(weights: Weights) -> Self {
        Self { weights, print: 0.0 }
    }
}

impl Contact {
    pub(crate) fn check(&self) -> Result<()> {
        let allowed = format!("0, a point, or at least {SHORTEST_PRINT} m");
        let holds = |print: f64| print == 0.0 || print >= SHORTEST_PRINT;
        check("tire print", self.print, "m", &allowed, holds).map(|_| ())
    }

    /// Shares of a unit force at `x` on the unknowns `(w_1, theta_1, w_2, theta_2)` of each element
    /// that it stands on: the weights, or their mean over the print.
    #[inline(always)]
    pub(crate) fn share(&self, mesh: &Mesh, x: f64, mut put: impl FnMut(usize, [f64; 4])) {
        if self.print == 0.0 {
            if let Some(place) = mesh.place(x) {
                put(place.element, place.weights(self.weights));
            }
        } else {
            self.spread(mesh, x, put);
        }
    }

    /// The integrals over the print. Two Gauss points in each element are exact, as the weights are
    /// cubic.
    fn spread(&self, mesh: &Mesh, x: f64, mut put: impl FnMut(usize, [f64; 4])) {
        let rear = (x - 0.5 * self.print).max(0.0);
        let front = (x + 0.5 * self.print).min(mesh.length());
        let Some(place) = mesh.place(rear).filter(|_| rear < front) else { return };
        let mut from = rear;
        for element in place.element..mesh.elements() {
            let (start, end) = (mesh.node(element), mesh.node(element + 1));
            let (h, to) = (end - start, front.min(end));
            let (middle, half) = (0.5 * (from + to) - start, 0.5 * (to - from));
            let at = |point: f64| self.weights.at(h, (middle + point * half) / h);
            let (a, b) = (at(-GAUSS), at(GAUSS));
            let part = half / self.print;
            put(element, std::array::from_fn(|k| part * (a[k] + b[k])));
            if front <= end {
                break;
            }
            from = end;
        }
    }
}

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
        contact: Contact,
        instant: usize,
    ) {
        let row = instant * loads.axles..(instant + 1) * loads.axles;
        let axles = loads.positions[row.clone()].iter().zip(&loads.forces[row]);
        self.0.clear();
        for (&x, &force) in axles {
            contact.share(strip.mesh(), x, |element, weights| {
                for (unknown, weight) in strip.unknowns(element).into_iter().zip(weights) {
                    if let (Some(unknown), true) = (unknown, weight != 0.0) {
                        self.0.push((unknown, -TRACK_SHARE * force * weight));
                    }
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pavement::{Bed, Ends, Foundation, Section};

    /// Two sections whose elements are 0.5 and 0.4 m long.
    fn mesh() -> Result<Mesh> {
        let bed = Bed { stiffness: 1e8, damping: 0.0, mass: 0.0 };
        let section = |length| Section {
            length,
            bending_stiffness: 2e5,
            bending_damping: 0.0,
            mass: 2e3,
            bed,
        };
        Mesh::new(&[section(1.0), section(0.8)], 0.5, Foundation::Winkler, Ends::Free)
    }

    fn shares(mesh: &Mesh, contact: Contact, x: f64) -> Vec<f64> {
        let mut sum = vec![0.0; 2 * mesh.len()];
        contact.share(mesh, x, |element, weights| {
            for (k, weight) in weights.into_iter().enumerate() {
                sum[2 * element + k] += weight;
            }
        });
        sum
    }

    /// Over elements, sections and both ends: the mean of many points, what is off the road lost.
    #[test]
    fn a_print_is_the_mean_of_its_points() -> Result<()> {
        let mesh = mesh()?;
        for (weights, print) in [
            (Weights::Linear, 0.3),
            (Weights::Hermite, 0.3),
            (Weights::Hermite, 1.3),
            (Weights::Linear, 4.0),
        ] {
            for x in [-0.2, -0.15, 0.0, 0.07, 0.31, 0.5, 0.93, 1.0, 1.2, 1.7, 1.8, 1.94, 1.95, 5.0]
            {
                let found = shares(&mesh, Contact { weights, print }, x);
                let points = 4000;
                let mut mean = vec![0.0; found.len()];
                for i in 0..points {
                    let away = print * ((f64::from(i) + 0.5) / f64::from(points) - 0.5);
                    for (mean, share) in
                        mean.iter_mut().zip(shares(&mesh, weights.into(), x + away))
                    {
                        *mean += share / f64::from(points);
                    }
                }
                for (found, mean) in found.iter().zip(&mean) {
                    let cut = 2.0 / f64::from(points); // a point more or less at an end of the road
                    assert!((found - mean).abs() < cut, "{x}: {found} for {mean}");
                }
                let force: f64 = found.iter().step_by(2).sum();
                let on_road = ((x + print / 2.0).min(1.8) - (x - print / 2.0).max(0.0)).max(0.0);
                assert!((force - on_road / print).abs() < 1e-14, "{x}: {force}");
            }
        }
        Ok(())
    }

    /// Work of the shares on a cubic is that of the force on it, over its print.
    #[test]
    fn hermite_shares_do_the_work_of_the_print() -> Result<()> {
        let mesh = mesh()?;
        let (print, x) = (0.7, 0.9);
        let found = shares(&mesh, Contact { weights: Weights::Hermite, print }, x);
        let work: f64 = (0..mesh.len())
            .map(|node| {
                let x = mesh.node(node);
                found[2 * node] * x.powi(3) + found[2 * node + 1] * 3.0 * x * x
            })
            .sum();
        let integral = |x: f64| x.powi(4) / 4.0;
        let expected = (integral(x + print / 2.0) - integral(x - print / 2.0)) / print;
        assert!((work - expected).abs() < 1e-14, "{work} for {expected}");
        Ok(())
    }

    #[test]
    fn a_short_print_is_a_point() -> Result<()> {
        let mesh = mesh()?;
        for x in [0.0, 0.2, 0.5, 1.0, 1.75] {
            let point = shares(&mesh, Weights::Hermite.into(), x);
            let short =
                shares(&mesh, Contact { weights: Weights::Hermite, print: SHORTEST_PRINT }, x);
            let on_road = if x == 0.0 { 0.5 } else { 1.0 };
            for (short, point) in short.iter().zip(&point) {
                assert!((short - on_road * point).abs() < 1e-3, "{x}: {short} for {point}");
            }
        }
        for print in [-0.1, 1e-4, f64::NAN, f64::INFINITY] {
            assert!(Contact { weights: Weights::Linear, print }.check().is_err(), "{print}");
        }
        Ok(())
    }
}
