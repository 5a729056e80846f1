//! What happens where an axle passes a node, and what all passes come to.

use super::model::{Model, Outcome};
use crate::response::sdirk::Noted;
use crate::vehicle::record::Tally;

/// What an axle did to a node while it was the nearest to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Event {
    pub(super) passage: usize,
    pub(super) node: usize,
    pub(super) passed: Noted,
    /// Whether the axle reached the node, at a tick that counts.
    pub(super) counts: bool,
}

/// The force of a wheel track on a node as an axle passes it, N.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub(super) passage: usize,
    pub(super) node: usize,
    pub(super) force: f64,
}

/// What a gang has seen.
#[derive(Debug, Default)]
pub(super) struct Events {
    pub(super) passes: Vec<Event>,
    pub(super) crossings: Vec<Crossing>,
}

/// What all passes came to at the nodes of a lane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Totals {
    /// Lowest and highest deflection, m, and the time of the lowest, s.
    pub lowest: Vec<f64>,
    /// Highest deflection, m.
    pub highest: Vec<f64>,
    /// Time of the lowest, s.
    pub time_of_lowest: Vec<f64>,
    /// Largest strain of the bottom fibre.
    pub strain: Vec<f64>,
    /// Largest force of a wheel track, N.
    pub force: Vec<f64>,
    /// Axles that passed.
    pub passes: Vec<u64>,
    /// Node by node, how many peaks of deflection are in each bin, those below and above all of them
    /// included.
    pub histogram: Vec<u32>,
    /// Node by node, power by power, the sums of powers of peak deflections, m,
    pub deflection_powers: Vec<f64>,
    /// peak strains,
    pub strain_powers: Vec<f64>,
    /// and forces, N.
    pub force_powers: Vec<f64>,
}

/// What a vehicle did to the pavement at worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// Lowest deflection as one of its axles passed, m, and the place of the node in the lane, m.
    pub lowest: f64,
    /// Place of that node, m.
    pub place: f64,
    /// Largest strain as one of its axles passed.
    pub strain: f64,
}

impl Worst {
    pub(super) const NONE: Self = Self { lowest: 0.0, place: f64::NAN, strain: 0.0 };
}

/// What the tire forces of a vehicle came to in a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ride {
    /// Instants that it is of.
    pub instants: usize,
    /// Largest dynamic load coefficient of its axles: standard deviation over static load.
    pub dlc: f64,
    /// Largest force of an axle, N.
    pub force: f64,
    /// The axle, from 0.
    pub axle: usize,
    /// Place of that axle then, m.
    pub place: f64,
}

impl Ride {
    pub(super) fn of(model: &Model, number: usize, tally: &Tally) -> Self {
        let passage = &model.inputs.passages[number];
        let vehicle = &model.inputs.vehicles[passage.vehicle];
        let axles = tally.axles.iter().zip(vehicle.static_loads());
        let dlc = axles.map(|(axle, load)| axle.deviation / load).fold(0.0, f64::max);
        let behind = vehicle.axle_places().nth(tally.axle).unwrap_or(0.0);
        let place = model.courses[number].place(tally.tick) - behind;
        let Tally { instants, largest: force, axle, .. } = *tally;
        Self { instants, dlc, force, axle, place }
    }
}

impl Totals {
    pub(super) fn new(nodes: usize, outcome: &Outcome) -> Self {
        let zeros = || vec![0.0; nodes];
        let powers = || vec![0.0; nodes * outcome.powers.len()];
        let bins = if outcome.bins.is_empty() { 0 } else { outcome.bins.len() + 1 };
        Self {
            lowest: zeros(),
            highest: zeros(),
            time_of_lowest: vec![f64::NAN; nodes],
            strain: zeros(),
            force: zeros(),
            passes: vec![0; nodes],
            histogram: vec![0; nodes * bins],
            deflection_powers: powers(),
            strain_powers: powers(),
            force_powers: powers(),
        }
    }
}

impl Totals {
    /// All that is not counted.
    pub(super) fn numbers(&self) -> [&Vec<f64>; 8] {
        [
            &self.lowest,
            &self.highest,
            &self.time_of_lowest,
            &self.strain,
            &self.force,
            &self.deflection_powers,
            &self.strain_powers,
            &self.force_powers,
        ]
    }

    pub(super) fn numbers_mut(&mut self) -> [&mut Vec<f64>; 8] {
        [
            &mut self.lowest,
            &mut self.highest,
            &mut self.time_of_lowest,
            &mut self.strain,
            &mut self.force,
            &mut self.deflection_powers,
            &mut self.strain_powers,
            &mut self.force_powers,
        ]
    }
}

/// How a number is raised to a power.
#[derive(Debug, Clone, Copy)]
pub(super) enum Power {
    Whole(i32),
    Any(f64),
}

impl Power {
    pub(super) fn of(exponent: f64) -> Self {
        if exponent.fract() == 0.0 { Self::Whole(exponent as i32) } else { Self::Any(exponent) }
    }

    #[inline(always)]
    fn raise(self, x: f64) -> f64 {
        match self {
            Self::Whole(exponent) => x.powi(exponent),
            Self::Any(exponent) => x.powf(exponent),
        }
    }
}

impl Events {
    /// Add all that has been seen to what was before.
    pub(super) fn add_to(&self, model: &Model, lanes: &mut [Totals], worst: &mut [Worst]) {
        let Model { inputs, counted, powers, fibre, .. } = model;
        let dt = model.dt();
        let bins = &inputs.outcome.bins;
        for event in &self.passes {
            let (node, Noted { lowest, highest, when, curvature }) = (event.node, event.passed);
            let lane = inputs.passages[event.passage].lane;
            let road = inputs.lanes[lane].road;
            if !counted[road].contains(&node) {
                continue;
            }
            let totals = &mut lanes[lane];
            let strain = curvature * fibre[road][node];
            if lowest < totals.lowest[node] {
                totals.lowest[node] = lowest;
                totals.time_of_lowest[node] = when * dt;
            }
            totals.highest[node] = totals.highest[node].max(highest);
            totals.strain[node] = totals.strain[node].max(strain);
            let worst = &mut worst[event.passage];
            if lowest < worst.lowest {
                worst.lowest = lowest;
                worst.place = model.geometry(road).node(node);
            }
            worst.strain = worst.strain.max(strain);
            if !event.counts {
                continue;
            }
            totals.passes[node] += 1;
            if !bins.is_empty() {
                let bin = bins.partition_point(|edge| *edge <= -lowest);
                totals.histogram[node * (bins.len() + 1) + bin] += 1;
            }
            for (at, power) in (node * powers.len()..).zip(powers) {
                totals.deflection_powers[at] += power.raise(-lowest);
                totals.strain_powers[at] += power.raise(strain);
            }
        }
        for &Crossing { passage, node, force } in &self.crossings {
            let lane = inputs.passages[passage].lane;
            if !counted[inputs.lanes[lane].road].contains(&node) {
                continue;
            }
            let totals = &mut lanes[lane];
            totals.force[node] = totals.force[node].max(force);
            for (at, power) in (node * powers.len()..).zip(powers) {
                totals.force_powers[at] += power.raise(force.max(0.0));
            }
        }
    }
}
