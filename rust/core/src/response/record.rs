//! What is kept of a run: histories at chosen places, and the envelope of every node.

use std::ops::Range;

use super::passes::Passes;
use super::sdirk::Noted;
use crate::error::{Error, Result, check_count, invalid};
use crate::pavement::mesh::Place;
use crate::pavement::strip::{Shares, Strip};
use crate::pavement::{Mesh, Quantity, Reading, Weights};

/// What to keep besides the envelope.
#[derive(Debug, Clone, PartialEq)]
pub struct Keep {
    /// Quantities whose history is kept.
    pub quantities: Vec<Quantity>,
    /// Whether it is kept at every node.
    pub nodes: bool,
    /// Further places where it is kept, m.
    pub stations: Vec<f64>,
    /// Keep every n-th instant of the histories, the first included. The envelope sees them all.
    pub every: usize,
}

/// Extremes of the deflection of every node over the run, m, up positive.
///
/// Where forces vary within a step they may lie between two steps, at the vertex of the parabola
/// through three of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Lowest value of each node.
    pub lowest: Vec<f64>,
    /// Highest value of each node.
    pub highest: Vec<f64>,
    /// The step at which each node was lowest.
    pub lowest_step: Vec<usize>,
    /// `axles x nodes`: the lowest value of each node while that axle is the nearest, 0 or below.
    pub passes: Vec<f64>,
}

/// What was kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// A row for each kept instant: for each quantity, a column for each kept node and then for each
    /// station.
    pub history: Vec<f64>,
    /// Extremes at every node of the road, the held ones included.
    pub envelope: Envelope,
}

impl Record {
    /// Without the error of second order, from the same run in half the steps; only the step of the
    /// lowest stays.
    pub(super) fn extrapolated(self, fine: &Self) -> Self {
        let both = |coarse: Vec<f64>, fine: &[f64]| {
            coarse
                .into_iter()
                .zip(fine)
                .map(|(coarse, fine)| fine + (fine - coarse) / 3.0)
                .collect()
        };
        let (here, there) = (self.envelope, &fine.envelope);
        let envelope = Envelope {
            lowest: both(here.lowest, &there.lowest),
            highest: both(here.highest, &there.highest),
            lowest_step: here.lowest_step,
            passes: both(here.passes, &there.passes),
        };
        Self { history: both(self.history, &fine.history), envelope }
    }
}

/// What a node has gone through for a while: extremes of its deflection, and the step of the lowest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passed {
    pub(super) lowest: f64,
    pub(super) highest: f64,
    pub(super) step: usize,
}

impl From<Noted> for Passed {
    fn from(Noted { lowest, highest, when, .. }: Noted) -> Self {
        Self { lowest, highest, step: when as usize }
    }
}

impl Envelope {
    /// Of so many nodes and axles, before any motion.
    pub(super) fn zeros(nodes: usize, axles: usize) -> Self {
        let zeros = vec![0.0; nodes];
        let passes = vec![0.0; nodes * axles];
        Self { lowest: zeros.clone(), highest: zeros, lowest_step: vec![0; nodes], passes }
    }

    /// Take what a node has gone through while an axle was the nearest.
    pub(super) fn take(&mut self, node: usize, axle: usize, passed: Passed) {
        if passed.lowest < self.lowest[node] {
            self.lowest[node] = passed.lowest;
            self.lowest_step[node] = passed.step;
        }
        self.highest[node] = self.highest[node].max(passed.highest);
        let pass = &mut self.passes[axle * self.lowest.len() + node];
        *pass = pass.min(passed.lowest);
    }
}

impl Keep {
    /// Nothing but the envelope.
    #[must_use]
    pub fn envelope() -> Self {
        Self { quantities: Vec::new(), nodes: false, stations: Vec::new(), every: 1 }
    }

    /// The deflection at every node or not, and at further places.
    #[must_use]
    pub fn deflection(nodes: bool, stations: &[f64], every: usize) -> Self {
        let stations = stations.to_vec();
        Self { quantities: vec![Quantity::Deflection], nodes, stations, every }
    }

    /// Where histories are kept: at every node, if so, and at the stations.
    fn places(&self, mesh: &Mesh) -> Result<Vec<Place>> {
        check_count("every", self.every, "at least 1", |every| every >= 1)?;
        let place = |x: f64| mesh.place(x).ok_or_else(|| off(x, mesh.length()));
        let nodes = if self.nodes { mesh.len() } else { 0 };
        let nodes = (0..nodes).map(|node| mesh.node(node));
        nodes.chain(self.stations.iter().copied()).map(place).collect()
    }

    /// How each column of a history is read.
    pub(super) fn readings(&self, mesh: &Mesh) -> Result<Vec<Reading>> {
        let places = self.places(mesh)?;
        let read = |quantity: &Quantity| {
            let quantity = *quantity;
            places.iter().map(move |place| mesh.reading(place, quantity))
        };
        Ok(self.quantities.iter().flat_map(read).collect())
    }

    /// Where deflections are read: at every node, then at the stations by the element's shape
    /// functions.
    pub(super) fn probes(&self, strip: &Strip) -> Result<Vec<Shares>> {
        check_count("every", self.every, "at least 1", |every| every >= 1)?;
        if self.quantities.iter().any(|quantity| *quantity != Quantity::Deflection) {
            let allowed = "deflections only, from the whole transition matrix; a window has all";
            return Err(invalid("quantities", format!("{:?}", self.quantities), allowed));
        }
        let probe =
            |&x: &f64| strip.shares(x, Weights::Hermite).ok_or_else(|| off(x, strip.length()));
        let stations = if self.quantities.is_empty() { &[] } else { self.stations.as_slice() };
        strip.nodes().iter().chain(stations).map(probe).collect()
    }
}

fn off(station: f64, length: f64) -> Error {
    invalid("station", format!("{station:?} m"), format!("on the road, 0 to {length:?} m"))
}

/// The extremes of every node so far, instant after instant.
pub(super) struct Extremes<'a> {
    passes: Passes<'a>,
    envelope: Envelope,
    /// Whether extremes may lie between steps.
    sharp: bool,
    /// The nodes that move now.
    window: Range<usize>,
    /// Deflections at the last instant, which are not noted yet, and at the one before.
    last: Vec<f64>,
    before: Vec<f64>,
    /// What each node has gone through while its axle is the nearest. Steps as doubles: comparison
    /// and choice then run in one vector width.
    lowest: Vec<f64>,
    highest: Vec<f64>,
    lowest_step: Vec<f64>,
}

impl<'a> Extremes<'a> {
    /// Before any motion.
    pub(super) fn new(passes: Passes<'a>, nodes: usize, sharp: bool) -> Self {
        let zeros = || vec![0.0; nodes];
        Self {
            envelope: Envelope::zeros(nodes, passes.axles()),
            passes,
            sharp,
            window: 0..nodes,
            last: zeros(),
            before: zeros(),
            lowest: zeros(),
            highest: zeros(),
            lowest_step: zeros(),
        }
    }

    /// Take the deflections of the nodes from `first` on at an instant, and note those of the one
    /// before. (A window that has moved on leaves nodes behind that have come to rest.)
    #[inline(always)]
    pub(super) fn update(&mut self, instant: usize, first: usize, deflection: &[f64]) {
        self.window = first..first + deflection.len();
        if let Some(last) = instant.checked_sub(1) {
            self.note(last, deflection, if self.sharp && last > 0 { 0.125 } else { 0.0 });
        }
        std::mem::swap(&mut self.before, &mut self.last);
        self.last[self.window.clone()].copy_from_slice(deflection);
    }

    /// Note the last instant.
    #[inline(always)]
    fn note(&mut self, instant: usize, next: &[f64], sharp: f64) {
        let Self { passes, envelope, window, lowest, highest, lowest_step, .. } = self;
        passes.advance(instant, |node, axle| {
            let [lowest, highest, step] =
                [&mut *lowest, highest, lowest_step].map(|all| std::mem::take(&mut all[node]));
            envelope.take(node, axle, Passed { lowest, highest, step: step as usize });
        });
        let step = instant as f64;
        let [lowest, highest, lowest_step] =
            [lowest, highest, lowest_step].map(|all| &mut all[window.clone()]);
        let [before, last] = [&self.before, &self.last].map(|all| &all[window.clone()]);
        let extremes = lowest.iter_mut().zip(highest).zip(lowest_step);
        let motion = before.iter().zip(last).zip(next);
        for (((lowest, highest), at), ((&before, &was), &is)) in extremes.zip(motion) {
            let (to, from) = (is - was, was - before);
            let (slope, bend) = (to + from, to - from);
            let vertex = sharp * slope * slope / bend.abs().max(f64::MIN_POSITIVE);
            // Where the vertex is not within half a step, there is no extreme.
            let low = was - vertex.min((sharp * bend).max(0.0));
            let high = was + vertex.min((-sharp * bend).max(0.0));
            *at = if low < *lowest { step } else { *at };
            *lowest = if low < *lowest { low } else { *lowest };
            *highest = if high > *highest { high } else { *highest };
        }
    }

    /// Note the last of so many instants, and hand over what all nodes went through.
    pub(super) fn finish(mut self, instants: usize) -> Envelope {
        let last = self.last[self.window.clone()].to_vec();
        self.note(instants - 1, &last, 0.0);
        for node in 0..self.lowest.len() {
            let (lowest, highest) = (self.lowest[node], self.highest[node]);
            let passed = Passed { lowest, highest, step: self.lowest_step[node] as usize };
            self.envelope.take(node, self.passes.axle(node), passed);
        }
        self.envelope
    }
}
