//! A window of pavement that moves with the vehicle: a cost that does not depend on the road's length.
//!
//! The pavement forgets in space and in time. Only the nodes near the vehicle are stepped, from so
//! far behind it to so far ahead that what is left out is below [`TOLERANCE`]; nodes beyond are held
//! still. The window moves by whole nodes, and at sections, joints and ends of the road it holds the
//! very elements that are there. A run is cut into as many parts of time as a vector has lanes; each
//! starts from rest as long before its first instant as the pavement remembers.

mod follow;

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::Hold;
use super::passes::Passes;
use super::record::{Envelope, Keep, Record};
use super::sdirk::{Notes, STAGES, Windows};
use crate::analytical::WinklerBeam;
use crate::error::{
    Error, Result, Watch, check_count, diverged, go_on, invalid, positive, reserve,
};
use crate::pavement::load::{Contact, Loads, TRACK_SHARE};
use crate::pavement::{Mesh, Reading};

pub(crate) use follow::Follower;

/// What is left out of a deflection, as a part of that under a force.
pub const TOLERANCE: f64 = 1e-8;

/// Fewest steps that a part is run in: a step of the method leaves up to a fifth of a motion that
/// dies away within it.
const LEAST_STEPS: f64 = 16.0;

/// Spacing of bars, in decay lengths of a continuous bed, above which they are none.
const WIDEST_BARS: f64 = 2.5;

/// Nodes stepped between two looks at the watcher: a millisecond or so.
pub(super) const WATCHED: usize = 1 << 16;

/// A road ready to be stepped through a window.
#[derive(Debug, Clone)]
pub struct Road {
    mesh: Mesh,
    dt: f64,
    contact: Contact,
    hold: Hold,
    keep: Keep,
    /// How each column of a history is read.
    readings: Vec<Reading>,
}

impl Road {
    /// Hold a road's mesh, and check what is to be kept.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for the time step or the tire print, or for a station off the road.
    pub fn new(
        mesh: Mesh,
        dt: f64,
        (contact, hold): (impl Into<Contact>, Hold),
        keep: Keep,
    ) -> Result<Self> {
        positive("time step dt", dt, "s")?;
        let contact = contact.into();
        contact.check()?;
        let readings = keep.readings(&mesh)?;
        Ok(Self { mesh, dt, contact, hold, keep, readings })
    }

    /// Places of the nodes, m, the ends included.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        self.mesh.nodes()
    }

    /// Columns of a record's history.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.readings.len()
    }

    /// Deflection of the road under `loads`, from rest. Axles only go forward.
    ///
    /// # Errors
    /// [`Error::Shape`](crate::error::Error::Shape) and [`Error::NonFinite`](crate::error::Error::NonFinite) for loads that do not fit, [`Error::Invalid`](crate::error::Error::Invalid) for an
    /// axle that goes back, [`Error::Diverged`](crate::error::Error::Diverged), [`Error::Stopped`](crate::error::Error::Stopped).
    pub fn run(&self, loads: &Loads<'_>, watch: &mut Watch<'_>) -> Result<Record> {
        let instants = loads.check()?;
        let run = Run { road: self, loads, instants, block: None, watch };
        Arch::new().dispatch(run).map(|block| block.record)
    }

    /// Deflection of the road during a part of a run, within [`TOLERANCE`] of the whole run's. Instants
    /// are numbered as in the whole run.
    ///
    /// The envelope has the last instant of the warm-up again: where an extreme lies beyond that, only
    /// the instant after it tells.
    ///
    /// # Errors
    /// As [`Road::run`]; [`Error::Invalid`](crate::error::Error::Invalid) for a warm-up that is too
    /// short.
    pub fn run_block(&self, loads: &Loads<'_>, lead: Lead, watch: &mut Watch<'_>) -> Result<Block> {
        let instants = loads.check()?;
        let allowed = format!("below the {instants} instants of the loads");
        check_count("warm_up", lead.warm_up, &allowed, |warm_up| warm_up < instants)?;
        let least = self.warm_up(loads.speed(self.dt))?;
        let allowed = format!("at least {least} instants, or all that are ahead");
        let suffices = |warm_up| lead.before == 0 || warm_up as f64 >= least;
        check_count("warm_up", lead.warm_up, &allowed, suffices)?;
        Arch::new().dispatch(Run { road: self, loads, instants, block: Some(lead), watch })
    }

    /// How many instants warm a block up at a speed, m/s: as many as the pavement remembers, and one;
    /// infinite where nothing damps it out.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a speed or a pavement out of range.
    pub fn warm_up(&self, speed: f64) -> Result<f64> {
        extent(&self.mesh, self.dt, self.contact.print, speed, TOLERANCE)
            .map(|(_, steps)| steps + 1.0)
    }

    /// The same without the error of second order in the step, by Richardson: from this run and one in
    /// steps of half the length, `(4 fine - coarse) / 3`. Three times the work, for runs that verify
    /// others.
    ///
    /// # Errors
    /// As [`Road::run`], and [`Error::Invalid`](crate::error::Error::Invalid) where forces are held, which is of first order.
    pub fn run_extrapolated(&self, loads: &Loads<'_>, watch: &mut Watch<'_>) -> Result<Record> {
        if self.hold == Hold::Zero {
            return Err(invalid("hold", "zero", "first, where steps are of third order"));
        }
        let keep = Keep { every: 2 * self.keep.every, ..self.keep.clone() };
        let finer = Self { dt: 0.5 * self.dt, keep, ..self.clone() };
        let coarse = self.run(loads, &mut |step, steps| watch(step, 3 * steps))?;
        let halved = [loads.positions, loads.forces].map(|values| halved(values, loads.axles));
        let halves = Loads { axles: loads.axles, positions: &halved[0], forces: &halved[1] };
        let fine = finer.run(&halves, &mut |step, steps| watch(step + steps / 2, steps / 2 * 3))?;
        Ok(coarse.extrapolated(&fine))
    }
}

/// How far ahead of the axles and behind them the window goes, m, and how many steps the
/// pavement remembers. All are infinite where nothing damps it out.
pub(super) fn extent(
    mesh: &Mesh,
    dt: f64,
    print: f64,
    speed: f64,
    tolerance: f64,
) -> Result<([f64; 2], f64)> {
    let (mut reach, mut memory) = ([0.0_f64; 2], 0.0_f64);
    for section in mesh.sections() {
        let beam = WinklerBeam::from(section);
        // A beam without a bed has no decay along the road.
        if beam.stiffness <= 0.0 {
            return Ok(([f64::INFINITY; 2], f64::INFINITY));
        }
        let [ahead, behind] = beam.reach(speed, tolerance)?;
        reach = [reach[0].max(ahead), reach[1].max(behind)];
        memory = memory.max(beam.memory(tolerance)?);
        if let Some(spacing) = mesh.spacing_of_bars() {
            // Between bars that are far apart, or if nothing but them is damped, waves live on.
            let between = beam.memory_without_bed(tolerance, spacing);
            let apart = spacing * beam.decay() > WIDEST_BARS;
            memory = memory.max(if apart { f64::INFINITY } else { between });
        }
    }
    // A step, however long, leaves some of what it damps.
    let steps = (memory / dt).ceil().max(LEAST_STEPS);
    if steps.is_infinite() {
        return Ok(([f64::INFINITY; 2], steps));
    }
    // What an axle has left behind moves on, where it is, for as long as the pavement remembers.
    let way = [reach[0] + speed * dt, reach[1].max(speed * dt * steps)];
    Ok((way.map(|length| length + 0.5 * print), steps))
}

/// What is ahead of a part of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lead {
    /// Instants of the run that are not among the loads.
    pub before: usize,
    /// Instants of the loads that only warm the pavement up.
    pub warm_up: usize,
}

/// What was kept of a part of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// First of the nodes that the window came by; the others were at rest.
    pub first_node: usize,
    /// Their envelope, and the histories.
    pub record: Record,
}

/// A part of a run: from rest at `begin`, counted from `from` on, up to before `end`.
struct Part<'a> {
    begin: usize,
    from: usize,
    end: usize,
    /// First node of its window.
    first: usize,
    /// Which axle each node is nearest to.
    passes: Passes<'a>,
}

struct Run<'a, 'w> {
    road: &'a Road,
    loads: &'a Loads<'a>,
    instants: usize,
    /// The whole run without one.
    block: Option<Lead>,
    watch: &'a mut Watch<'w>,
}

impl WithSimd for Run<'_, '_> {
    type Output = Result<Block>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<Block> {
        let Self { road, loads, instants, block, watch } = self;
        let Lead { before, warm_up } = block.unwrap_or_default();
        let mesh = &road.mesh;
        let speed = loads.speed(road.dt);
        let (reach, memory) = extent(mesh, road.dt, road.contact.print, speed, TOLERANCE)?;
        let nodes = window_nodes(mesh, loads, reach);
        let first = |instant, first| first_node(mesh, loads, instant, reach[1], nodes, first);
        let mut parts: Vec<Part<'_>> =
            parts(warm_up.saturating_sub(1)..instants, S::F64_LANES, memory)
                .map(|[begin, from, end]| {
                    let passes = Passes::new(mesh, loads, begin);
                    Part { begin, from, end, first: first(begin, 0).unwrap_or(0), passes }
                })
                .collect();
        let between = road.hold == Hold::First;
        let notes = if between { Notes::Vertices } else { Notes::Steps };
        let mut windows = Windows::<f64>::new(nodes, S::F64_LANES, road.dt, notes);
        let passed = match block {
            None => 0..mesh.len(),
            Some(_) => passed(&parts, nodes, first),
        };
        let mut envelope = Envelope::zeros(passed.len(), loads.axles);
        let columns = road.columns();
        let mut history = Vec::new();
        let rows_before = |instant: usize| (before + instant).div_ceil(road.keep.every);
        let first_row = rows_before(warm_up);
        let rows = if columns > 0 { rows_before(instants) - first_row } else { 0 };
        reserve(&mut history, rows.saturating_mul(columns))?;
        history.resize(rows * columns, 0.0);
        let longest = parts.iter().map(|part| part.end - part.begin).max().unwrap_or(0);
        for (lane, part) in parts.iter().enumerate() {
            windows.fill(lane, mesh, part.first);
        }
        let watched = (WATCHED / nodes).max(1);
        for tick in 0..longest {
            if tick % watched == 0 {
                go_on(watch, tick, longest)?;
                if !windows.is_sound() {
                    return Err(diverged("deflection", before + tick, road.dt));
                }
            }
            windows.unload();
            for (lane, part) in parts.iter_mut().enumerate() {
                let instant = part.begin + tick;
                let counts = (part.from..part.end).contains(&instant);
                let between = road.hold == Hold::First && instant > 0 && instant + 1 < instants;
                let number = before + instant;
                windows.count(lane, number, counts, between);
                if instant >= part.end {
                    continue;
                }
                let kept = counts && instant >= warm_up && number.is_multiple_of(road.keep.every);
                if kept && columns > 0 {
                    let row = number / road.keep.every - first_row;
                    let row = &mut history[row * columns..(row + 1) * columns];
                    road.read(&windows, lane, part.first, row);
                }
                if let Some(first) = first(instant, part.first) {
                    while part.first < first {
                        let axle = part.passes.axle(part.first);
                        envelope.take(part.first - passed.start, axle, windows.shift(lane).into());
                        part.first += 1;
                        windows.fill(lane, mesh, part.first);
                    }
                }
                part.passes.advance(instant, |node, axle| {
                    if let Some(at) = node.checked_sub(part.first).filter(|at| *at < nodes) {
                        envelope.take(node - passed.start, axle, windows.take(lane, at).into());
                    }
                });
                if instant + 1 < instants {
                    road.load(&mut windows, lane, part.first, loads, instant)?;
                }
            }
            windows.step(simd);
        }
        for (lane, part) in parts.iter().enumerate() {
            for node in 0..nodes {
                let axle = part.passes.axle(part.first + node);
                let at = part.first + node - passed.start;
                envelope.take(at, axle, windows.take(lane, node).into());
            }
        }
        go_on(watch, longest, longest)?;
        if !windows.is_sound() {
            return Err(diverged("deflection", before + instants - 1, road.dt));
        }
        Ok(Block { first_node: passed.start, record: Record { history, envelope } })
    }
}

impl Road {
    /// What is kept of an instant: only what is inside the window moves.
    fn read(&self, windows: &Windows<f64>, lane: usize, first: usize, row: &mut [f64]) {
        let motion = |node: usize| {
            let inside = node.checked_sub(first).filter(|at| *at < windows.len());
            inside.map_or([[0.0; 2]; 2], |at| windows.motion(lane, at))
        };
        for (out, reading) in row.iter_mut().zip(&self.readings) {
            *out = reading.of(motion);
        }
    }

    /// Put the axles on the nodes for the step from an instant to the next.
    fn load(
        &self,
        windows: &mut Windows<f64>,
        lane: usize,
        first: usize,
        loads: &Loads<'_>,
        instant: usize,
    ) -> Result<()> {
        // Where in the step the forces are taken, and the stages that they are for.
        let taken: &[(f64, &[usize])] = match self.hold {
            Hold::Zero => &[(0.0, &[0, 1])],
            Hold::First => &[(STAGES[0], &[0]), (STAGES[1], &[1])],
        };
        for axle in 0..loads.axles {
            let (now, next) = (instant * loads.axles + axle, (instant + 1) * loads.axles + axle);
            for &(part, stages) in taken {
                let along = |values: &[f64]| values[now] + part * (values[next] - values[now]);
                let force = -TRACK_SHARE * along(loads.forces);
                let mut inside = true;
                self.contact.share(&self.mesh, along(loads.positions), |element, weights| {
                    let node = element.checked_sub(first).filter(|at| at + 1 < windows.len());
                    let Some(node) = node else {
                        inside = false;
                        return;
                    };
                    for (k, weight) in weights.into_iter().enumerate() {
                        if weight != 0.0 && !self.mesh.holds(2 * element + k) {
                            for &stage in stages {
                                windows.load(stage, lane, (node + k / 2, k % 2), weight * force);
                            }
                        }
                    }
                });
                if !inside {
                    return Err(behind(axle, loads.positions[now], instant));
                }
            }
        }
        Ok(())
    }
}

/// Rows, and between any two of them the mean of both.
fn halved(values: &[f64], columns: usize) -> Vec<f64> {
    let rows: Vec<&[f64]> = values.chunks_exact(columns).collect();
    let between = rows.windows(2).flat_map(|pair| {
        let mean = pair[0].iter().zip(pair[1]).map(|(a, b)| 0.5 * (a + b));
        pair[0].iter().copied().chain(mean)
    });
    between.chain(rows.last().into_iter().copied().flatten().copied()).collect()
}

/// The error of an axle that is not on the window.
pub(super) fn behind(axle: usize, x: f64, instant: usize) -> Error {
    invalid(
        format!("place of axle {axle}"),
        format!("{x} m at instant {instant}"),
        "within the window of the axle ahead: axles only go forward",
    )
}

/// Nodes of the window: all axles, and the reach ahead and behind.
pub(super) fn window_nodes(mesh: &Mesh, loads: &Loads<'_>, [ahead, behind]: [f64; 2]) -> usize {
    nodes_over(mesh, loads.span() + ahead + behind)
}

/// Nodes of a window that goes over so many metres, wherever it is.
pub(super) fn nodes_over(mesh: &Mesh, length: f64) -> usize {
    // Two elements that are only partly covered, and one that the step goes into.
    let elements = (length / mesh.shortest()).ceil() + 3.0;
    if elements < mesh.elements() as f64 { elements as usize + 1 } else { mesh.len() }
}

/// First node of the window at an instant, which is not ahead of `first`; none where all axles have
/// left the road.
pub(super) fn first_node(
    mesh: &Mesh,
    loads: &Loads<'_>,
    instant: usize,
    behind: f64,
    nodes: usize,
    first: usize,
) -> Option<usize> {
    let row = loads.places(instant);
    // An axle that is still ahead of the road comes onto it at its beginning; one that is just past
    // its end may have a part of its print on it.
    let last = row.iter().copied().filter(|x| *x <= mesh.length() + behind).reduce(f64::min)?;
    Some(first_before(mesh, (last - behind).max(0.0), nodes, first))
}

/// First node of a window of so many that has a place in its first element, if that is not behind
/// `first` and the road goes on for as long.
#[inline(always)]
pub(super) fn first_before(mesh: &Mesh, start: f64, nodes: usize, first: usize) -> usize {
    let furthest = mesh.len() - nodes;
    if first == furthest || start < mesh.node(first + 1) {
        return first;
    }
    mesh.place(start).map_or(furthest, |place| place.element.min(furthest))
}

/// The nodes that the windows of all parts come by.
fn passed(
    parts: &[Part<'_>],
    nodes: usize,
    first_node: impl Fn(usize, usize) -> Option<usize>,
) -> Range<usize> {
    let furthest = |part: &Part<'_>| {
        let on = |first, instant| first_node(instant, first).unwrap_or(first).max(first);
        (part.begin..part.end).fold(part.first, on)
    };
    let first = parts.iter().map(|part| part.first).min().unwrap_or(0);
    first..parts.iter().map(furthest).max().unwrap_or(0) + nodes
}

/// Cut the instants that count into at most so many parts, where that saves more than the run-in of
/// each costs: the instants that each begins, counts from and ends at. What is ahead of them is for
/// the run-in of the first part.
fn parts(instants: Range<usize>, lanes: usize, memory: f64) -> impl Iterator<Item = [usize; 3]> {
    let worth = memory < 0.5 * instants.len() as f64;
    let (count, memory) = if worth { (lanes, memory as usize) } else { (1, instants.start) };
    let at = move |part: usize| instants.start + part * instants.len() / count;
    let part = move |number: usize| [at(number).saturating_sub(memory), at(number), at(number + 1)];
    (0..count).map(part).filter(|[_, from, end]| from < end)
}
