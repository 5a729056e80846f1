//! International roughness index (IRI): the golden car over a profile.
//!
//! The golden car is a quarter car at 80 km/h (Sayers, "On the calculation of international
//! roughness index from longitudinal road profile", Transportation Research Record 1501, 1995; ASTM
//! E1926). Per unit of sprung mass, with the slopes `z_s'` and `z_u'` of its masses' paths as the
//! unknowns and the slope `z'` of the road as the input,
//!
//! ```text
//! [1 0; 0 0.15] u'' + 6 [1 -1; -1 1] u' + [63.3 -63.3; -63.3 716.3] u = [0; 653] z',
//! IRI = mean |z_s' - z_u'|.
//! ```
//!
//! Between two samples the slope is constant, which `Phi` and `Gamma` of [`Transition`] follow
//! exactly.

use crate::error::{Result, Watch, check, check_count, diverged, go_on, invalid, unwatched};
use crate::linalg::DMatrix;
use crate::transition::{Form, System, Transition};

/// Speed of the golden car, m/s.
pub const SPEED: f64 = 80.0 / 3.6;

/// Base of the moving average, m, and the coarsest spacing of samples that the index is meant for.
pub const BASE: f64 = 0.25;

/// Distance over which the mean slope of the road gives the car its initial state, m.
pub const START: f64 = 11.0;

// Stiffness of the tire and of the suspension, 1/s^2, its damping, 1/s, and the unsprung mass, each
// per unit of sprung mass.
const TIRE: f64 = 653.0;
const SPRING: f64 = 63.3;
const DAMPER: f64 = 6.0;
const UNSPRUNG: f64 = 0.15;

/// The index is in m/km.
const PER_KM: f64 = 1e3;

/// The golden car for one spacing of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct GoldenCar {
    /// `Phi` over one spacing, row by row, for the state `(z_s', z_s'', z_u', z_u'')`.
    pub phi: [[f64; 4]; 4],
    /// The state that a constant unit slope of the road leaves after one spacing.
    pub gamma: [f64; 4],
}

impl GoldenCar {
    /// The car over samples `spacing` apart, m.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) unless the spacing is 1e-6 m to [`START`].
    pub fn new(spacing: f64) -> Result<Self> {
        check("spacing", spacing, "m", "1e-6 to 11 m", |s| (1e-6..=START).contains(&s))?;
        let rows = |values: [f64; 4]| DMatrix::from_row_slice(2, 2, &values);
        let system = System::from_dense(
            &rows([1.0, 0.0, 0.0, UNSPRUNG]),
            &rows([DAMPER, -DAMPER, -DAMPER, DAMPER]),
            &rows([SPRING, -SPRING, -SPRING, SPRING + TIRE]),
        )?;
        // Two unknowns: done before anyone could ask.
        let transition = Transition::new(system, spacing / SPEED, Form::Integral, &mut unwatched)?;
        let (phi, gamma) = (transition.phi().to_dense(), transition.gamma());
        // The transition has both slopes first, then their rates.
        let order = [0, 2, 1, 3];
        Ok(Self {
            phi: order.map(|i| order.map(|j| phi[(i, j)])),
            gamma: order.map(|i| TIRE * gamma[(i, 1)]),
        })
    }

    fn step(&self, state: [f64; 4], slope: f64) -> [f64; 4] {
        std::array::from_fn(|i| {
            let row = &self.phi[i];
            (row[0] * state[0] + row[1] * state[1])
                + (row[2] * state[2] + row[3] * state[3])
                + self.gamma[i] * slope
        })
    }
}

/// IRI of a profile, m/km: of the whole or, from its start on, of each segment of a length, m.
///
/// The samples are `elevations`, m, every `spacing` m. With `moving_average`, the slope at a sample
/// is that of the chord to the sample [`BASE`] further on (to the nearest number of samples, 1 or
/// more), which is the slope of the averaged profile; without it, to the next sample.
/// The car starts with the slope of the first [`START`] m, or of a shorter profile's whole. (The
/// Fortran that comes with E1926 divides the rise over that distance by one spacing more, which gives
/// a plane road on a grade an index.)
///
/// A step counts for the segment in which it starts, and the car goes on from one segment to the
/// next. The last one may be shorter than the others; a rest too short for a base is none.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) for a spacing outside 1e-6 m to [`START`], an elevation that is not finite, a
/// profile shorter than the base, or a segment shorter than the spacing; [`Error::Diverged`](crate::error::Error::Diverged) where
/// the elevations are too large for a double; [`Error::Stopped`](crate::error::Error::Stopped).
pub fn iri(
    elevations: &[f64],
    spacing: f64,
    moving_average: bool,
    segment: Option<f64>,
    watch: &mut Watch<'_>,
) -> Result<Vec<f64>> {
    let car = GoldenCar::new(spacing)?;
    let base = if moving_average { samples(BASE, spacing) } else { 1 };
    let needed = format!("at least {}, more than the base of the slope", base + 1);
    check_count("samples of the profile", elevations.len(), &needed, |n| n > base)?;
    if let Some(i) = elevations.iter().position(|z| !z.is_finite()) {
        return Err(invalid(format!("elevation {i}"), format!("{:?} m", elevations[i]), "finite"));
    }
    let steps = elevations.len() - base;
    let segment = match segment {
        Some(length) => check("segment", length, "m", "the spacing or longer", |l| l >= spacing)?,
        None => f64::INFINITY,
    };
    // A segment's first step is the first that does not start ahead of it, but for rounding.
    let first = |number: usize| (number as f64 * segment / spacing - 1e-6).ceil() as usize;

    let lead = samples(START, spacing).min(elevations.len() - 1);
    let start = (elevations[lead] - elevations[0]) / (lead as f64 * spacing);
    let mut state = [start, 0.0, start, 0.0];
    let (mut found, mut step) = (Vec::new(), 0);
    while step < steps {
        let (from, to) = (step, first(found.len() + 1).min(steps));
        let mut sum = 0.0;
        while step < to {
            if step % 1024 == 0 {
                go_on(watch, step, steps)?;
            }
            let rise = elevations[step + base] - elevations[step];
            state = car.step(state, rise / (base as f64 * spacing));
            sum += (state[0] - state[2]).abs();
            step += 1;
        }
        if !f64::is_finite(sum) {
            return Err(diverged("golden car's slope", step, spacing / SPEED));
        }
        found.push(PER_KM * sum / (to - from) as f64);
    }
    Ok(found)
}

/// Number of spacings nearest to a length, at least 1; halves go up, whatever a spacing's rounding.
fn samples(length: f64, spacing: f64) -> usize {
    ((length / spacing * (1.0 + 1e-6)).round() as usize).max(1)
}
