//! What of a vehicle's tire forces is kept: histories, forces at stations, and their statistics.

use pulp::Simd;

use super::fleet::Passage;
use super::model::Tire;
use crate::error::{Error, Result, check, check_count, reserve};

/// What to keep of a run besides the statistics of every axle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Keep {
    /// Every n-th instant of the forces; none without.
    pub every: Option<usize>,
    /// Places, m, in increasing order: the force with which each axle passes them.
    pub stations: Vec<f64>,
}

impl Keep {
    pub(super) fn check(&self) -> Result<()> {
        check_count("every", self.every.unwrap_or(1), "at least 1", |every| every >= 1)?;
        for (number, &place) in self.stations.iter().enumerate() {
            let name = format!("station {number}");
            let before = number.checked_sub(1).map_or(f64::NEG_INFINITY, |i| self.stations[i]);
            let allowed = "finite and above the one before it";
            check(&name, place, "m", allowed, |place| place > before)?;
        }
        Ok(())
    }
}

/// Tire force of one axle over the steps that are kept, N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Smallest.
    pub lowest: f64,
    /// Largest.
    pub highest: f64,
    /// Instants at which it did not press on the road.
    pub airborne: usize,
}

/// What was kept of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Forces at every n-th instant, a row of one an axle, N.
    pub history: Vec<f64>,
    /// Forces at the stations, a row of one an axle, N; NaN where an axle does not get there.
    pub at_stations: Vec<f64>,
    /// Statistics of each axle.
    pub axles: Vec<Statistics>,
}

/// Sums of the forces of vehicles side by side, of each axle a vector of lanes.
pub(super) struct Sums {
    lanes: usize,
    /// 1 in the lanes whose vehicle counts now, and 0 in the others; and 0, or infinity.
    counts: Vec<f64>,
    shut: Vec<f64>,
    /// Static loads, from which the sums are taken: that keeps their digits.
    loads: Vec<f64>,
    sum: Vec<f64>,
    squares: Vec<f64>,
    lowest: Vec<f64>,
    highest: Vec<f64>,
    airborne: Vec<f64>,
}

impl Sums {
    pub(super) fn new(axles: usize, lanes: usize, group: &[Passage<'_>]) -> Self {
        let mut loads = vec![0.0; axles * lanes];
        for (lane, passage) in group.iter().enumerate() {
            for (axle, load) in passage.vehicle.static_loads().iter().enumerate() {
                loads[axle * lanes + lane] = *load;
            }
        }
        let all = |value: f64| vec![value; axles * lanes];
        Self {
            lanes,
            counts: vec![0.0; lanes],
            shut: vec![f64::INFINITY; lanes],
            loads,
            sum: all(0.0),
            squares: all(0.0),
            lowest: all(f64::INFINITY),
            highest: all(f64::NEG_INFINITY),
            airborne: all(0.0),
        }
    }

    /// Count the vehicle of a lane from now on, or no more.
    pub(super) fn count(&mut self, lane: usize, counts: bool) {
        self.counts[lane] = f64::from(u8::from(counts));
        self.shut[lane] = if counts { 0.0 } else { f64::INFINITY };
    }

    /// Add the forces of an instant, axle by axle.
    #[inline(always)]
    pub(super) fn take<S: Simd>(&mut self, simd: S, forces: &[f64]) {
        let (counts, shut) = (S::as_simd_f64s(&self.counts).0[0], S::as_simd_f64s(&self.shut).0[0]);
        let zero = simd.splat_f64s(0.0);
        let sums = [&mut self.sum, &mut self.squares, &mut self.lowest, &mut self.highest];
        let [sum, squares, lowest, highest] = sums.map(|sums| S::as_mut_simd_f64s(sums).0);
        let airborne = S::as_mut_simd_f64s(&mut self.airborne).0;
        let loads = S::as_simd_f64s(&self.loads).0;
        for (axle, &force) in S::as_simd_f64s(forces).0.iter().enumerate() {
            let above = simd.mul_f64s(counts, simd.sub_f64s(force, loads[axle]));
            sum[axle] = simd.add_f64s(sum[axle], above);
            squares[axle] = simd.add_f64s(squares[axle], simd.mul_f64s(above, above));
            lowest[axle] = simd.min_f64s(lowest[axle], simd.add_f64s(force, shut));
            highest[axle] = simd.max_f64s(highest[axle], simd.sub_f64s(force, shut));
            let off = simd.less_than_or_equal_f64s(force, zero);
            airborne[axle] = simd.add_f64s(airborne[axle], simd.select_f64s(off, counts, zero));
        }
    }

    /// The lane of a vehicle whose forces are not finite.
    pub(super) fn unsound_lane(&self) -> Option<usize> {
        self.squares.iter().position(|squares| !squares.is_finite()).map(|at| at % self.lanes)
    }

    /// # Errors
    /// [`Error::Diverged`] where a force was not finite.
    fn of_lane(&self, lane: usize, passage: &Passage<'_>) -> Result<Vec<Statistics>> {
        let count = (passage.run.steps + 1) as f64;
        let statistics = |axle: usize| {
            let at = axle * self.lanes + lane;
            let mean = self.sum[at] / count;
            Statistics {
                mean: self.loads[at] + mean,
                deviation: (self.squares[at] / count - mean * mean).max(0.0).sqrt(),
                lowest: self.lowest[at],
                highest: self.highest[at],
                airborne: self.airborne[at] as usize,
            }
        };
        let axles: Vec<_> = (0..passage.vehicle.tires.len()).map(statistics).collect();
        // A sum of squares that is not finite shows here, and max() hides no NaN of the mean.
        match axles.iter().all(|axle| axle.mean.is_finite() && axle.deviation.is_finite()) {
            true => Ok(axles),
            false => Err(diverged(passage, passage.run.total())),
        }
    }
}

/// Where one axle is among the stations.
struct Crossing {
    /// How far behind the front axle.
    behind: f64,
    next: usize,
    place: f64,
    force: f64,
}

/// Takes the histories of one vehicle, and its forces at stations.
pub(super) struct Keeper<'a> {
    passage: &'a Passage<'a>,
    keep: &'a Keep,
    crossings: Vec<Crossing>,
    history: Vec<f64>,
    at_stations: Vec<f64>,
}

impl<'a> Keeper<'a> {
    pub(super) fn new(passage: &'a Passage<'a>, keep: &'a Keep) -> Result<Self> {
        let Passage { vehicle, run } = passage;
        let axles = vehicle.tires.len();
        let mut history = Vec::new();
        if let Some(every) = keep.every {
            reserve(&mut history, (run.steps / every + 1).saturating_mul(axles))?;
        }
        let mut at_stations = Vec::new();
        reserve(&mut at_stations, keep.stations.len().saturating_mul(axles))?;
        at_stations.resize(keep.stations.len() * axles, f64::NAN);
        let crossing = |tire: &Tire| Crossing {
            behind: tire.point.x,
            next: 0,
            place: f64::NEG_INFINITY,
            force: 0.0,
        };
        let crossings = vehicle.tires.iter().map(crossing).collect();
        Ok(Self { passage, keep, crossings, history, at_stations })
    }

    /// The forces of all axles at a step, counted from the start of the run.
    #[inline(always)]
    pub(super) fn take(&mut self, step: usize, forces: impl Fn(usize) -> f64) {
        let run = &self.passage.run;
        let Some(kept) = step.checked_sub(run.skip).filter(|kept| *kept <= run.steps) else {
            return;
        };
        let axles = self.crossings.len();
        if self.keep.every.is_some_and(|every| kept.is_multiple_of(every)) {
            self.history.extend((0..axles).map(&forces));
        }
        let stations = &self.keep.stations;
        if stations.is_empty() {
            return;
        }
        for (axle, crossing) in self.crossings.iter_mut().enumerate() {
            let (place, force) = (run.place(step) - crossing.behind, forces(axle));
            while crossing.next < stations.len() && stations[crossing.next] <= place {
                let station = stations[crossing.next];
                // A station behind where the run began is never passed.
                if kept > 0 || station == place {
                    let part = (place - station) / (place - crossing.place);
                    self.at_stations[crossing.next * axles + axle] =
                        force - part * (force - crossing.force);
                }
                crossing.next += 1;
            }
            (crossing.place, crossing.force) = (place, force);
        }
    }

    /// What was kept, with the statistics of a lane.
    ///
    /// # Errors
    /// [`Error::Diverged`] where a force was not finite.
    pub(super) fn finish(self, sums: &Sums, lane: usize) -> Result<Record> {
        let axles = sums.of_lane(lane, self.passage)?;
        Ok(Record { history: self.history, at_stations: self.at_stations, axles })
    }
}

pub(super) fn diverged(passage: &Passage<'_>, step: usize) -> Error {
    Error::Diverged { quantity: "tire force", step, time: step as f64 * passage.run.dt }
}
