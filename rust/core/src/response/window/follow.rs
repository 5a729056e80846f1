//! A window that goes one step at a time, under forces that are found on the way.

use pulp::{Arch, Scalar, Simd, WithSimd};

use super::{Road, TOLERANCE, extent, first_node, window_nodes};
use crate::error::Result;
use crate::pavement::Weights;
use crate::pavement::element::shape_slopes;
use crate::pavement::load::{Contact, Loads};
use crate::response::sdirk::{Notes, Windows};

/// The only window.
const LANE: usize = 0;

/// The window of a road under one vehicle, which may take a step again.
pub(crate) struct Follower<'a> {
    road: &'a Road,
    windows: Windows<f64>,
    /// What the window was when the step began.
    begin: Vec<f64>,
    /// How far behind the axles it goes, m.
    behind: f64,
    first: usize,
}

impl<'a> Follower<'a> {
    /// At rest, ahead of axles that go as those of `loads`.
    ///
    /// # Errors
    /// As [`Road::run`].
    pub(crate) fn new(road: &'a Road, loads: &Loads<'_>) -> Result<Self> {
        loads.check()?;
        let speed = loads.speed(road.dt);
        let (reach, _) = extent(&road.mesh, road.dt, road.contact.print, speed, TOLERANCE)?;
        let nodes = window_nodes(&road.mesh, loads, reach);
        let mut windows = Windows::new(nodes, 1, road.dt, Notes::Steps);
        windows.fill(LANE, &road.mesh, 0);
        let begin = windows.state().to_vec();
        Ok(Self { road, windows, begin, behind: reach[1], first: 0 })
    }

    /// Go to where the step from an instant to the next begins.
    pub(crate) fn begin(&mut self, loads: &Loads<'_>, instant: usize) {
        let (mesh, nodes) = (&self.road.mesh, self.windows.len());
        let first = first_node(mesh, loads, instant, self.behind, nodes, self.first);
        while self.first < first.unwrap_or(self.first) {
            self.windows.shift(LANE);
            self.first += 1;
            self.windows.fill(LANE, mesh, self.first);
        }
        self.windows.unload();
        self.begin.copy_from_slice(self.windows.state());
    }

    /// Take the step that begins at an instant, under the forces at both its ends; again from its
    /// beginning if it was taken before.
    ///
    /// # Errors
    /// As [`Road::run`].
    pub(crate) fn step(&mut self, loads: &Loads<'_>, instant: usize) -> Result<()> {
        self.windows.restore(&self.begin);
        self.windows.unload();
        self.road.load(&mut self.windows, LANE, self.first, loads, instant)?;
        Arch::new().dispatch(Step(&mut self.windows));
        Ok(())
    }

    /// Deflection under a tire that moves, m, mean over its print, and how it changes there in time,
    /// m/s. None off the road.
    pub(crate) fn under(&self, x: f64, speed: f64) -> [f64; 2] {
        let Road { mesh, contact, .. } = self.road;
        let mut mean = [0.0; 2];
        let shape = Contact { weights: Weights::Hermite, ..*contact };
        shape.share(mesh, x, |element, weights| {
            for (mean, read) in mean.iter_mut().zip(self.read(element, weights)) {
                *mean += read;
            }
        });
        let slope = if contact.print > 0.0 {
            let half = 0.5 * contact.print;
            (self.deflection(x + half) - self.deflection(x - half)) / contact.print
        } else {
            let slope = mesh.place(x).map(|at| self.read(at.element, shape_slopes(at.h, at.s))[0]);
            slope.unwrap_or(0.0)
        };
        [mean[0], mean[1] + speed * slope]
    }

    /// Deflection at a place, m; none off the road.
    fn deflection(&self, x: f64) -> f64 {
        let place = self.road.mesh.place(x);
        place.map_or(0.0, |at| self.read(at.element, at.weights(Weights::Hermite))[0])
    }

    /// The motion of an element's unknowns, and its rate, summed by weights.
    fn read(&self, element: usize, weights: [f64; 4]) -> [f64; 2] {
        let Some(left) = element.checked_sub(self.first).filter(|at| at + 1 < self.windows.len())
        else {
            return [0.0; 2];
        };
        let [here, next] = [left, left + 1].map(|node| self.windows.motion(LANE, node));
        [0, 1].map(|order| {
            let unknowns = here[order].into_iter().chain(next[order]);
            unknowns.zip(weights).map(|(unknown, weight)| unknown * weight).sum()
        })
    }
}

/// One lane, but with the instructions of this machine.
struct Step<'a>(&'a mut Windows<f64>);

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.step(Scalar);
    }
}
