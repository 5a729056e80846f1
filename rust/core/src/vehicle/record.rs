//! What of a vehicle's tire forces is kept: histories, forces at stations, and their statistics.

use pulp::Simd;

use super::model::Tire;
use super::run::Passage;
use crate::aligned::Aligned;
use crate::error::{Error, Result, check, check_count, diverged, reserve};

/// What to keep of a run besides the statistics of every axle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Keep {
    /// Every n-th instant of the forces; none without.
    pub every: Option<usize>,
    /// Places, m, in increasing order: the force with which each axle passes them.
    pub stations: Vec<f64>,
}

impl Keep {
    /// Whether anything but the statistics is kept.
    pub(super) fn asks(&self) -> bool {
        self.every.is_some() || !self.stations.is_empty()
    }

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

/// Takes forces as they come, rows of one an axle, N, of instants that follow each other; whether to
/// go on.
pub type Take<'a> = dyn FnMut(&[f64]) -> bool + 'a;

/// Where the history of a run goes, so many instants at a time, in place of the record.
pub(super) struct Outlet<'a> {
    pub(super) instants: usize,
    pub(super) take: &'a mut Take<'a>,
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

/// What the forces of a vehicle came to over the instants that counted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tally {
    /// Instants that counted.
    pub(crate) instants: usize,
    /// Statistics of each axle.
    pub(crate) axles: Vec<Statistics>,
    /// Largest force of any axle, N, its axle, and the first tick at which it was.
    pub(crate) largest: f64,
    pub(crate) axle: usize,
    pub(crate) tick: i64,
}

impl Tally {
    /// What was [saved](Sums::save) of a vehicle of such static loads; nothing where no instant
    /// counted yet.
    pub(crate) fn of(loads: &[f64], saved: &[f64]) -> Option<Self> {
        let (shared, axles) = saved.split_at(SHARED - KEPT);
        let count = shared[COUNT - KEPT];
        if count == 0.0 {
            return None;
        }
        let statistics = |(axle, load): (&[f64], &f64)| {
            let number = |number: usize| axle[number - SUM];
            let mean = number(SUM) / count;
            // A sum that is not finite must show: max() would hide it.
            let square = number(SQUARES) / count - mean * mean;
            let deviation = if square < 0.0 { 0.0 } else { square.sqrt() };
            Statistics {
                mean: load + mean,
                deviation,
                lowest: number(LOWEST),
                highest: number(HIGHEST),
                airborne: number(AIRBORNE) as usize,
            }
        };
        let axles: Vec<_> = axles.chunks_exact(NUMBERS - SUM).zip(loads).map(statistics).collect();
        let largest = shared[LARGEST - KEPT];
        Some(Self {
            instants: count as usize,
            largest,
            axle: axles.iter().position(|axle| axle.highest == largest).unwrap_or(0),
            tick: shared[TICK - KEPT] as i64,
            axles,
        })
    }
}

/// Sums of the forces of vehicles side by side, each number a vector of lanes.
pub(super) struct Sums {
    lanes: usize,
    axles: usize,
    /// What the axles of a vehicle share, then axle by axle; number by number, lane by lane.
    numbers: Aligned<f64>,
}

/// Numbers that the axles share: 1 where the vehicle counts now, else 0, and 0 there, else infinity;
/// those that are saved: the instants that counted, the largest force and the tick at which it was.
const COUNTS: usize = 0;
const SHUT: usize = 1;
const KEPT: usize = COUNT;
const COUNT: usize = 2;
const LARGEST: usize = 3;
const TICK: usize = 4;
const SHARED: usize = 5;

/// Numbers of an axle: the static load, from which the sums are taken (that keeps their digits), and,
/// saved, the sums, the extremes, and the instants off the road.
const LOAD: usize = 0;
const SUM: usize = 1;
const SQUARES: usize = 2;
const LOWEST: usize = 3;
const HIGHEST: usize = 4;
const AIRBORNE: usize = 5;
const NUMBERS: usize = 6;

impl Sums {
    /// Of so many axles, no lane taken.
    pub(super) fn new(axles: usize, lanes: usize) -> Self {
        let numbers = Aligned::zeros((SHARED + axles * NUMBERS) * lanes);
        let mut sums = Self { lanes, axles, numbers };
        for lane in 0..lanes {
            sums.count(lane, false);
        }
        sums
    }

    /// Put a vehicle into a lane, with what was saved of it.
    pub(super) fn enter(&mut self, lane: usize, loads: &[f64], saved: Option<&[f64]>) {
        let mut set = |number: usize, value| self.numbers[number * self.lanes + lane] = value;
        set(LARGEST, f64::NEG_INFINITY);
        for (axle, load) in loads.iter().enumerate() {
            let first = SHARED + axle * NUMBERS;
            set(first + LOAD, *load);
            set(first + LOWEST, f64::INFINITY);
            set(first + HIGHEST, f64::NEG_INFINITY);
        }
        for (number, value) in Self::kept(self.axles).zip(saved.unwrap_or_default()) {
            set(number, *value);
        }
    }

    /// The numbers that are saved of a vehicle with so many axles.
    fn kept(axles: usize) -> impl Iterator<Item = usize> {
        let of_axle = |axle: usize| (SUM..NUMBERS).map(move |n| SHARED + axle * NUMBERS + n);
        (KEPT..SHARED).chain((0..axles).flat_map(of_axle))
    }

    /// Save what is known of the vehicle of a lane.
    pub(super) fn save(&self, lane: usize, to: &mut Vec<f64>) {
        let saved = Self::kept(self.axles).map(|number| self.numbers[number * self.lanes + lane]);
        to.extend(saved);
    }

    /// Count the vehicle of a lane from now on, or no more.
    pub(super) fn count(&mut self, lane: usize, counts: bool) {
        self.numbers[COUNTS * self.lanes + lane] = f64::from(u8::from(counts));
        self.numbers[SHUT * self.lanes + lane] = if counts { 0.0 } else { f64::INFINITY };
    }

    /// Add the forces of a tick, axle by axle.
    #[inline(always)]
    pub(super) fn take<S: Simd>(&mut self, simd: S, tick: i64, forces: &[f64]) {
        let (shared, axles) = S::as_mut_simd_f64s(&mut self.numbers).0.split_at_mut(SHARED);
        let (counts, shut) = (shared[COUNTS], shared[SHUT]);
        let zero = simd.splat_f64s(0.0);
        let mut largest = simd.splat_f64s(f64::NEG_INFINITY);
        for (axle, &force) in
            axles.as_chunks_mut::<NUMBERS>().0.iter_mut().zip(S::as_simd_f64s(forces).0)
        {
            let above = simd.mul_f64s(counts, simd.sub_f64s(force, axle[LOAD]));
            axle[SUM] = simd.add_f64s(axle[SUM], above);
            axle[SQUARES] = simd.add_f64s(axle[SQUARES], simd.mul_f64s(above, above));
            axle[LOWEST] = simd.min_f64s(axle[LOWEST], simd.add_f64s(force, shut));
            let open = simd.sub_f64s(force, shut);
            axle[HIGHEST] = simd.max_f64s(axle[HIGHEST], open);
            largest = simd.max_f64s(largest, open);
            let off = simd.less_than_or_equal_f64s(force, zero);
            axle[AIRBORNE] = simd.add_f64s(axle[AIRBORNE], simd.select_f64s(off, counts, zero));
        }
        let larger = simd.greater_than_f64s(largest, shared[LARGEST]);
        shared[COUNT] = simd.add_f64s(shared[COUNT], counts);
        shared[LARGEST] = simd.select_f64s(larger, largest, shared[LARGEST]);
        shared[TICK] = simd.select_f64s(larger, simd.splat_f64s(tick as f64), shared[TICK]);
    }

    /// The lane of a vehicle whose forces are not finite.
    pub(super) fn unsound_lane(&self) -> Option<usize> {
        let axles = self.numbers[SHARED * self.lanes..].chunks_exact(NUMBERS * self.lanes);
        let squares = axles.flat_map(|axle| axle[SQUARES * self.lanes..][..self.lanes].iter());
        squares.enumerate().find(|(_, sum)| !sum.is_finite()).map(|(at, _)| at % self.lanes)
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
    outlet: Option<Outlet<'a>>,
}

impl<'a> Keeper<'a> {
    pub(super) fn new(
        passage: &'a Passage<'a>,
        keep: &'a Keep,
        outlet: Option<Outlet<'a>>,
    ) -> Result<Self> {
        let Passage { vehicle, run } = passage;
        let axles = vehicle.tires.len();
        let mut history = Vec::new();
        if let Some(every) = keep.every {
            let rows = run.steps / every + 1;
            let rows = outlet.as_ref().map_or(rows, |outlet| outlet.instants.min(rows));
            reserve(&mut history, rows.saturating_mul(axles))?;
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
        Ok(Self { passage, keep, crossings, history, at_stations, outlet })
    }

    /// The forces of all axles at a step, counted from the start of the run.
    #[inline(always)]
    pub(super) fn take(&mut self, step: usize, forces: impl Fn(usize) -> f64) -> Result<()> {
        let run = &self.passage.run;
        let Some(kept) = step.checked_sub(run.skip).filter(|kept| *kept <= run.steps) else {
            return Ok(());
        };
        let axles = self.crossings.len();
        if self.keep.every.is_some_and(|every| kept.is_multiple_of(every)) {
            self.history.extend((0..axles).map(&forces));
            if self.outlet.as_ref().is_some_and(|to| self.history.len() >= to.instants * axles) {
                self.hand_over(step)?;
            }
        }
        let stations = &self.keep.stations;
        if stations.is_empty() {
            return Ok(());
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
        Ok(())
    }

    /// Hand the history so far over to where it goes, if it goes anywhere.
    #[cold]
    fn hand_over(&mut self, step: usize) -> Result<()> {
        if let (Some(outlet), false) = (&mut self.outlet, self.history.is_empty()) {
            if !(outlet.take)(&self.history) {
                return Err(Error::Stopped { step, steps: self.passage.run.total() });
            }
            self.history.clear();
        }
        Ok(())
    }

    /// What was kept, with the statistics of what was saved of the [`Sums`].
    ///
    /// # Errors
    /// [`Error::Diverged`](crate::error::Error::Diverged) where a force was not finite.
    pub(super) fn finish(mut self, saved: &[f64]) -> Result<Record> {
        let Passage { vehicle, run } = self.passage;
        self.hand_over(run.total())?;
        let tally = Tally::of(vehicle.static_loads(), saved);
        let axles = tally.map(|tally| tally.axles).unwrap_or_default();
        if axles.iter().any(|axle| !(axle.mean.is_finite() && axle.deviation.is_finite())) {
            return Err(diverged("tire force", run.total(), run.dt));
        }
        Ok(Record { history: self.history, at_stations: self.at_stations, axles })
    }
}
