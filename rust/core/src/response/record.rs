//! What is kept of a run: histories at chosen places, and the envelope of every node.

use crate::error::{Error, Result, check_count, invalid};
use crate::pavement::mesh::Place;
use crate::pavement::strip::{Shares, Strip};
use crate::pavement::{Mesh, Weights};

/// What to keep besides the envelope.
#[derive(Debug, Clone, PartialEq)]
pub struct Keep {
    /// Whether the deflection history of every node is kept.
    pub nodes: bool,
    /// Further places whose deflection history is kept, m.
    pub stations: Vec<f64>,
    /// Keep every n-th instant of the histories, the first included. The envelope sees them all.
    pub every: usize,
}

/// Extremes of the deflection of every node over the run, m, up positive.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Lowest value of each node.
    pub lowest: Vec<f64>,
    /// Highest value of each node.
    pub highest: Vec<f64>,
    /// The step at which each node was lowest.
    pub lowest_step: Vec<usize>,
}

/// What was kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Deflection, m, up positive: a row for each kept instant, a column for each kept node and then
    /// for each station.
    pub history: Vec<f64>,
    /// Extremes at every node of the road, the held ones included.
    pub envelope: Envelope,
}

/// What a node has gone through for a while: extremes of its deflection, and the step of the lowest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passed {
    pub(super) lowest: f64,
    pub(super) highest: f64,
    pub(super) step: f64,
}

impl Envelope {
    /// Of so many nodes, before any motion.
    pub(super) fn zeros(nodes: usize) -> Self {
        let zeros = vec![0.0; nodes];
        Self { lowest: zeros.clone(), highest: zeros, lowest_step: vec![0; nodes] }
    }

    /// Take what a node has gone through for a while.
    pub(super) fn take(&mut self, node: usize, passed: Passed) {
        if passed.lowest < self.lowest[node] {
            self.lowest[node] = passed.lowest;
            self.lowest_step[node] = passed.step as usize;
        }
        self.highest[node] = self.highest[node].max(passed.highest);
    }
}

impl Keep {
    /// Where the stations are.
    pub(super) fn places(&self, mesh: &Mesh) -> Result<Vec<Place>> {
        check_count("every", self.every, "at least 1", |every| every >= 1)?;
        self.stations.iter().map(|&x| mesh.place(x).ok_or_else(|| off(x, mesh.length()))).collect()
    }

    /// Where deflections are read: at every node, then at the stations by the element's shape
    /// functions.
    pub(super) fn probes(&self, strip: &Strip) -> Result<Vec<Shares>> {
        check_count("every", self.every, "at least 1", |every| every >= 1)?;
        let probe =
            |&x: &f64| strip.shares(x, Weights::Hermite).ok_or_else(|| off(x, strip.length()));
        strip.nodes().iter().chain(&self.stations).map(probe).collect()
    }
}

fn off(station: f64, length: f64) -> Error {
    invalid("station", format!("{station:?} m"), format!("on the road, 0 to {length:?} m"))
}

/// The extremes so far.
pub(super) struct Extremes {
    lowest: Vec<f64>,
    highest: Vec<f64>,
    /// Steps as doubles: comparison and choice then run in one vector width.
    lowest_step: Vec<f64>,
}

impl Extremes {
    /// Of so many nodes, before any motion.
    pub(super) fn new(nodes: usize) -> Self {
        let zeros = vec![0.0; nodes];
        Self { lowest: zeros.clone(), highest: zeros.clone(), lowest_step: zeros }
    }

    #[inline(always)]
    pub(super) fn update(&mut self, step: usize, deflection: &[f64]) {
        let step = step as f64;
        let extremes = self.lowest.iter_mut().zip(&mut self.highest).zip(&mut self.lowest_step);
        for (((lowest, highest), at), &w) in extremes.zip(deflection) {
            *at = if w < *lowest { step } else { *at };
            *lowest = if w < *lowest { w } else { *lowest };
            *highest = if w > *highest { w } else { *highest };
        }
    }

    pub(super) fn finish(self) -> Envelope {
        Envelope {
            lowest: self.lowest,
            highest: self.highest,
            lowest_step: self.lowest_step.into_iter().map(|step| step as usize).collect(),
        }
    }
}
