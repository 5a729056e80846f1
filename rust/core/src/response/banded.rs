//! The paper's scheme on roads of any length: a transition matrix of which only a band is held.
//!
//! Within a step the motion of a node is felt only nearby: away from the diagonal the entries of
//! `Phi` and `Gamma` (eqs. 11-12) die away. Here those below [`CUT`] are left out, and the others
//! come from the transition matrices of short pieces of the road, each with enough pavement on both
//! sides of the nodes whose rows are taken from it. Far from joints and ends all nodes of a section
//! have the same row; so the matrices of a road take no more room than its joints need.
//!
//! Only a window of nodes that moves with the vehicle is stepped, as in [`super::window`], and as
//! exactly in time as by the whole matrix ([`super::dense`]).

use std::ops::Range;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::Hold;
use super::passes::Passes;
use super::record::{Extremes, Keep, Record};
use super::window::{TOLERANCE, WATCHED, behind, extent, first_node, window_nodes};
use crate::error::{Error, Result, Watch, diverged, go_on, positive, reserve};
use crate::linalg::{DMatrix, add_scaled, multiply_by};
use crate::pavement::load::{Contact, Loads, TRACK_SHARE};
use crate::pavement::{Mesh, Reading, Strip};
use crate::transition::{Form, Transition};

/// Entries of `Phi - I` and `Gamma` that are left out, as parts of the largest of their kind:
/// between the same two of `(w, theta, w', theta')`.
pub const CUT: f64 = 1e-13;

/// Nodes that a piece of road has beyond those that are felt: what its ends throw back is less than
/// what is left out.
const MARGIN: usize = 8;

/// Nodes on each side of the first piece of road that is looked at, and of the longest.
const FIRST: usize = 32;
const LONGEST: usize = 128;

/// The widest vector. (Rows are filled up to it with zeros.)
const WIDEST: usize = 8;

/// Motions of a node: `(w, theta, w', theta')`.
const MOTIONS: usize = 4;

/// A road ready to be stepped by its band.
#[derive(Debug)]
pub struct Road {
    mesh: Mesh,
    dt: f64,
    contact: Contact,
    hold: Hold,
    keep: Keep,
    /// How each column of a history is read.
    readings: Vec<Reading>,
    band: Band,
}

impl Road {
    /// Find the band of a road's mesh, and check what is to be kept.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the time step, the tire print or a station off the road, [`Error::TooWide`],
    /// [`Error::NoMemory`], [`Error::Stopped`], and as [`Transition::new`].
    pub fn new(
        mesh: Mesh,
        dt: f64,
        (contact, hold): (impl Into<Contact>, Hold),
        keep: Keep,
        watch: &mut Watch<'_>,
    ) -> Result<Self> {
        positive("time step dt", dt, "s")?;
        let contact = contact.into();
        contact.check()?;
        let readings = keep.readings(&mesh)?;
        let band = Band::of(&mesh, dt, hold, watch)?;
        Ok(Self { mesh, dt, contact, hold, keep, readings, band })
    }

    /// Places of the nodes, m, the ends included.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        self.mesh.nodes()
    }

    /// Nodes on each side of one that its row of the band holds.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.band.reach
    }

    /// Columns of a record's history.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.readings.len()
    }

    /// Deflection of the road under `loads`, from rest. Axles only go forward.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NonFinite`] for loads that do not fit, [`Error::Invalid`] for an
    /// axle that goes back, [`Error::Diverged`], [`Error::Stopped`].
    pub fn run(&self, loads: &Loads<'_>, watch: &mut Watch<'_>) -> Result<Record> {
        let instants = loads.check()?;
        Arch::new().dispatch(Run { road: self, loads, instants, watch })
    }
}

/// A piece of road and its transition over a step.
struct Patch {
    strip: Strip,
    /// The blocks of `Phi - I`.
    phi: [DMatrix<f64>; 4],
    /// Displacement and velocity that a unit force at the beginning of the step leaves, and, if
    /// forces vary within a step, one at its end.
    pulses: Vec<[DMatrix<f64>; 2]>,
}

/// What one motion of a node takes from one motion of the others, or gives of a force on it.
struct Kind<'a> {
    matrix: &'a DMatrix<f64>,
    /// Whether the node is a column of the matrix, not a row.
    gives: bool,
    /// The unknown of the node, 0 or 1, and that of the others.
    own: usize,
    other: usize,
}

impl Patch {
    fn of(mesh: Mesh, dt: f64, hold: Hold, watch: &mut Watch<'_>) -> Result<Self> {
        let strip = Strip::of(mesh)?;
        // By integrals: no inverse of a stiffness, which is felt all over the piece.
        let transition = Transition::new(strip.system().clone(), dt, Form::Integral, watch)?;
        let phi = transition.phi().blocks().map(Clone::clone);
        let levels = transition.levels();
        let step = [levels.level(2).clone(), levels.level(1).clone()];
        let pulses = match hold {
            Hold::Zero => vec![step],
            Hold::First => {
                let grown = [3, 2].map(|level| multiply_by(levels.level(level), 1.0 / dt));
                let [u, v] = step;
                vec![[u - &grown[0], v - &grown[1]], grown]
            }
        };
        Ok(Self { strip, phi, pulses })
    }

    /// All kinds of entries: `Phi` by the motion that takes and the one that is taken, then the
    /// pulses by the end of the step, the unknown a force acts on and the motion that takes it.
    fn kinds(&self) -> impl Iterator<Item = Kind<'_>> {
        let phi = (0..MOTIONS * MOTIONS).map(|kind| {
            let (to, from) = (kind / MOTIONS, kind % MOTIONS);
            let matrix = &self.phi[to / 2 * 2 + from / 2];
            Kind { matrix, gives: false, own: to % 2, other: from % 2 }
        });
        let pulses = self.pulses.iter().flat_map(|pulse| {
            (0..2 * MOTIONS).map(|kind| {
                let (own, to) = (kind / MOTIONS, kind % MOTIONS);
                Kind { matrix: &pulse[to / 2], gives: true, own, other: to % 2 }
            })
        });
        phi.chain(pulses)
    }

    fn entry(&self, kind: &Kind<'_>, node: usize, other: usize) -> f64 {
        let own = self.strip.free(2 * node + kind.own);
        let other = self.strip.free(2 * other + kind.other);
        match (own, other) {
            (Some(own), Some(other)) if kind.gives => kind.matrix[(other, own)],
            (Some(own), Some(other)) => kind.matrix[(own, other)],
            _ => 0.0,
        }
    }

    /// How many nodes away from some of its nodes entries are above [`CUT`].
    fn reach(&self, wanted: Range<usize>) -> usize {
        let nodes = self.strip.nodes().len();
        let reach = |kind: Kind<'_>| {
            let pairs = || wanted.clone().flat_map(|i| (0..nodes).map(move |j| (i, j)));
            let entry = |(i, j): (usize, usize)| self.entry(&kind, i, j).abs();
            let largest = pairs().map(entry).fold(0.0, f64::max);
            let counts = pairs().filter(|&pair| entry(pair) > CUT * largest);
            counts.map(|(i, j)| i.abs_diff(j)).max().unwrap_or(0)
        };
        self.kinds().map(reach).max().unwrap_or(0)
    }
}

/// `Phi` and `Gamma` of a road without what is far from the diagonal.
#[derive(Debug)]
struct Band {
    /// Nodes on each side of one that its row holds.
    reach: usize,
    /// Numbers of a row for each kind of entry, from `reach` nodes behind on.
    width: usize,
    /// Kinds of entries, the first [`MOTIONS`]` x `[`MOTIONS`] of them those of `Phi`.
    kinds: usize,
    stretches: Vec<Stretch>,
}

/// Nodes with a row in common, or with one each.
#[derive(Debug)]
struct Stretch {
    nodes: Range<usize>,
    shared: bool,
    /// Kinds x width numbers a row. (Stretches alike have the same.)
    rows: Arc<[f64]>,
}

impl Band {
    fn of(mesh: &Mesh, dt: f64, hold: Hold, watch: &mut Watch<'_>) -> Result<Self> {
        let mut reach = 0;
        let mut known: Vec<Mesh> = Vec::new();
        for section in 0..mesh.sections().len() {
            let sample = mesh.more_of(section, 2 * FIRST);
            if !known.contains(&sample) {
                reach = reach.max(reach_within(mesh, section, dt, hold, watch)?);
                known.push(sample);
            }
        }
        // Ends and joints may throw back more than the pavement between them.
        while reach + MARGIN <= LONGEST {
            let (band, needed) = Self::with_reach(mesh, dt, hold, reach, watch)?;
            if needed <= reach {
                return Ok(band);
            }
            reach = needed;
        }
        Err(too_wide(mesh, dt))
    }

    /// The band with so many nodes on each side, and how many it needs.
    fn with_reach(
        mesh: &Mesh,
        dt: f64,
        hold: Hold,
        reach: usize,
        watch: &mut Watch<'_>,
    ) -> Result<(Self, usize)> {
        let width = (2 * reach + 1).next_multiple_of(WIDEST);
        let ends = if hold == Hold::Zero { 1 } else { 2 };
        let kinds = MOTIONS * MOTIONS + ends * 2 * MOTIONS;
        let mut band = Self { reach, width, kinds, stretches: Vec::new() };
        let mut known: Vec<(Mesh, Range<usize>, Arc<[f64]>)> = Vec::new();
        let mut needed = 0;
        for (nodes, shared) in stretches(mesh, reach) {
            let middle = (nodes.start + nodes.end) / 2;
            let own = if shared { middle..middle + 1 } else { nodes.clone() };
            let first = own.start.saturating_sub(reach + MARGIN);
            let last = (own.end - 1 + reach + MARGIN).min(mesh.elements());
            let (piece, own) = (mesh.part(first..last), own.start - first..own.end - first);
            let alike = known.iter().find(|(other, nodes, _)| *other == piece && *nodes == own);
            let rows = if let Some((.., rows)) = alike {
                Arc::clone(rows)
            } else {
                let patch = Patch::of(piece.clone(), dt, hold, watch)?;
                needed = needed.max(patch.reach(own.clone()));
                let rows: Arc<[f64]> = band.rows_of(&patch, own.clone())?.into();
                known.push((piece, own, Arc::clone(&rows)));
                rows
            };
            band.stretches.push(Stretch { nodes, shared, rows });
        }
        Ok((band, needed))
    }

    /// The rows of some nodes of a piece of road.
    fn rows_of(&self, patch: &Patch, nodes: Range<usize>) -> Result<Vec<f64>> {
        let last = patch.strip.nodes().len() - 1;
        let mut rows = Vec::new();
        reserve(&mut rows, nodes.len() * self.kinds * self.width)?;
        for node in nodes {
            for kind in patch.kinds() {
                rows.extend((0..self.width).map(|i| match (node + i).checked_sub(self.reach) {
                    Some(other) if i <= 2 * self.reach && other <= last => {
                        patch.entry(&kind, node, other)
                    }
                    _ => 0.0,
                }));
            }
        }
        Ok(rows)
    }

    /// Ends of a step at which forces act.
    fn ends(&self) -> usize {
        (self.kinds / MOTIONS - MOTIONS) / 2
    }

    /// Number of the stretch that a node is in.
    fn stretch(&self, node: usize) -> usize {
        self.stretches.partition_point(|stretch| stretch.nodes.end <= node)
    }

    /// The row of a node in its stretch.
    #[inline(always)]
    fn row<'a>(&self, stretch: &'a Stretch, node: usize) -> &'a [f64] {
        let row = if stretch.shared { 0 } else { node - stretch.nodes.start };
        let length = self.kinds * self.width;
        &stretch.rows[row * length..(row + 1) * length]
    }
}

fn too_wide(mesh: &Mesh, dt: f64) -> Error {
    Error::TooWide { elements: LONGEST - MARGIN, length: mesh.shortest(), dt }
}

/// How many nodes away the motion of a node is felt within a step, far from joints and ends.
fn reach_within(
    mesh: &Mesh,
    section: usize,
    dt: f64,
    hold: Hold,
    watch: &mut Watch<'_>,
) -> Result<usize> {
    let mut half = FIRST;
    while half <= LONGEST {
        let patch = Patch::of(mesh.more_of(section, 2 * half), dt, hold, watch)?;
        let reach = patch.reach(half..half + 1);
        if reach + MARGIN <= half {
            return Ok(reach);
        }
        half *= 2;
    }
    Err(too_wide(mesh, dt))
}

/// Cut a road into the nodes of each section that feel no joint or end, which share a row, and short
/// runs of those that do.
fn stretches(mesh: &Mesh, reach: usize) -> Vec<(Range<usize>, bool)> {
    let longest = 2 * (reach + 1);
    let mut all = Vec::new();
    let mut from = 0;
    let end = mesh.len()..mesh.len();
    let alike = mesh.stretches().map(|e| e.start + reach + 1..e.end.saturating_sub(reach));
    for alike in alike.filter(|nodes| !nodes.is_empty()).chain(std::iter::once(end)) {
        let own = (from..alike.start).step_by(longest);
        all.extend(own.map(|start| (start..alike.start.min(start + longest), false)));
        from = alike.end;
        all.push((alike, true));
    }
    all.pop();
    all
}

struct Run<'a, 'w> {
    road: &'a Road,
    loads: &'a Loads<'a>,
    instants: usize,
    watch: &'a mut Watch<'w>,
}

impl WithSimd for Run<'_, '_> {
    type Output = Result<Record>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<Record> {
        let Self { road, loads, instants, watch } = self;
        let Road { mesh, dt, contact, hold, band, keep, .. } = road;
        let (reach, _) = extent(mesh, *dt, contact.print, loads.speed(*dt), TOLERANCE)?;
        let nodes = window_nodes(mesh, loads, reach);
        let columns = road.columns();
        let mut history = Vec::new();
        let rows = if columns > 0 { instants.div_ceil(keep.every) } else { 0 };
        reserve(&mut history, rows.saturating_mul(columns))?;
        history.resize(rows * columns, 0.0);
        let passes = Passes::new(mesh, loads, 0);
        let mut extremes = Extremes::new(passes, mesh.len(), *hold == Hold::First);
        let mut state = State::new(mesh.len(), band);
        let mut window = 0..nodes;
        let watched = (WATCHED / nodes).max(1);
        for instant in 0..instants {
            if instant % watched == 0 {
                go_on(watch, instant, instants - 1)?;
                if !state.is_sound(&window) {
                    return Err(diverged("deflection", instant, *dt));
                }
            }
            extremes.update(instant, window.start, state.deflection(&window));
            if columns > 0 && instant.is_multiple_of(keep.every) {
                let row = instant / keep.every * columns;
                road.read(&state, &window, &mut history[row..row + columns]);
            }
            if instant + 1 == instants {
                break;
            }
            let first = first_node(mesh, loads, instant, reach[1], nodes, window.start);
            let first = first.unwrap_or(window.start);
            window = first..first + nodes;
            state.step(simd, band, &window);
            for end in 0..band.ends() {
                road.load(&mut state, &window, loads, (instant, end))?;
            }
            state.swap();
        }
        go_on(watch, instants - 1, instants - 1)?;
        if !state.is_sound(&window) {
            return Err(diverged("deflection", instants - 1, *dt));
        }
        Ok(Record { history, envelope: extremes.finish(instants) })
    }
}

impl Road {
    /// What is kept of an instant: only what is inside the window moves.
    fn read(&self, state: &State, window: &Range<usize>, row: &mut [f64]) {
        let motion = |node: usize| {
            if window.contains(&node) { state.motion(node) } else { [[0.0; 2]; 2] }
        };
        for (out, reading) in row.iter_mut().zip(&self.readings) {
            *out = reading.of(motion);
        }
    }

    /// Add what the axles at one end of a step do to the state after it.
    fn load(
        &self,
        state: &mut State,
        window: &Range<usize>,
        loads: &Loads<'_>,
        (instant, end): (usize, usize),
    ) -> Result<()> {
        for axle in 0..loads.axles {
            let at = (instant + end) * loads.axles + axle;
            let force = -TRACK_SHARE * loads.forces[at];
            let mut inside = true;
            self.contact.share(&self.mesh, loads.positions[at], |element, weights| {
                inside &= window.contains(&element) && window.contains(&(element + 1));
                for (k, weight) in weights.into_iter().enumerate() {
                    if inside && weight != 0.0 {
                        let on = (element + k / 2, k % 2);
                        state.push(&self.band, on, end, weight * force);
                    }
                }
            });
            if !inside {
                return Err(behind(axle, loads.positions[at], instant + end));
            }
        }
        Ok(())
    }
}

/// Motions of all nodes of a road. Outside the window they are left as they are.
struct State {
    /// Nodes before the first and after the last one that do not move.
    before: usize,
    now: [Vec<f64>; MOTIONS],
    next: [Vec<f64>; MOTIONS],
}

impl State {
    /// At rest.
    fn new(nodes: usize, band: &Band) -> Self {
        let motions = || std::array::from_fn(|_| vec![0.0; band.reach + nodes + band.width]);
        Self { before: band.reach, now: motions(), next: motions() }
    }

    /// Deflection and slope of a node, and their rates.
    fn motion(&self, node: usize) -> [[f64; 2]; 2] {
        let [w, slope, rate, turn] = [0, 1, 2, 3].map(|k| self.now[k][self.before + node]);
        [[w, slope], [rate, turn]]
    }

    fn deflection(&self, window: &Range<usize>) -> &[f64] {
        &self.now[0][self.before + window.start..self.before + window.end]
    }

    fn is_sound(&self, window: &Range<usize>) -> bool {
        self.deflection(window).iter().sum::<f64>().is_finite()
    }

    /// What the motions of now lead to at the nodes of a window.
    #[inline(always)]
    fn step<S: Simd>(&mut self, simd: S, band: &Band, window: &Range<usize>) {
        // What nodes outside the window are left with is not felt.
        for now in &mut self.now {
            now[window.start..self.before + window.start].fill(0.0);
            now[self.before + window.end..][..self.before].fill(0.0);
        }
        for stretch in &band.stretches[band.stretch(window.start)..] {
            let mut node = stretch.nodes.start.max(window.start);
            let end = stretch.nodes.end.min(window.end);
            while stretch.shared && node + 1 < end {
                self.advance::<S, 2>(simd, band, band.row(stretch, node), node);
                node += 2;
            }
            while node < end {
                self.advance::<S, 1>(simd, band, band.row(stretch, node), node);
                node += 1;
            }
            if end == window.end {
                break;
            }
        }
    }

    /// The same at `N` nodes from one on that have a row in common.
    #[inline(always)]
    fn advance<S: Simd, const N: usize>(&mut self, simd: S, band: &Band, row: &[f64], node: usize) {
        let width = band.width;
        let mut sums = [[simd.splat_f64s(0.0); N]; MOTIONS];
        for (from, now) in self.now.iter().enumerate() {
            let near: [_; N] =
                std::array::from_fn(|i| S::as_simd_f64s(&now[node + i..node + i + width]).0);
            let rows: [_; MOTIONS] = std::array::from_fn(|to| {
                S::as_simd_f64s(&row[(to * MOTIONS + from) * width..][..width]).0
            });
            for at in 0..width / S::F64_LANES {
                for (sums, row) in sums.iter_mut().zip(rows) {
                    for (sum, near) in sums.iter_mut().zip(near) {
                        *sum = simd.mul_add_f64s(row[at], near[at], *sum);
                    }
                }
            }
        }
        for ((next, now), sums) in self.next.iter_mut().zip(&self.now).zip(sums) {
            for (i, sum) in sums.into_iter().enumerate() {
                let at = self.before + node + i;
                next[at] = now[at] + simd.reduce_sum_f64s(sum);
            }
        }
    }

    /// Add a force on an unknown of a node at one end of the step.
    #[inline(always)]
    fn push(&mut self, band: &Band, (node, k): (usize, usize), end: usize, force: f64) {
        let row = band.row(&band.stretches[band.stretch(node)], node);
        let first = MOTIONS * MOTIONS + (2 * end + k) * MOTIONS;
        let pulses = &row[first * band.width..][..MOTIONS * band.width];
        for (next, pulse) in self.next.iter_mut().zip(pulses.chunks_exact(band.width)) {
            add_scaled(&mut next[node..node + band.width], force, pulse);
        }
    }

    fn swap(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::unwatched;
    use crate::pavement::{Bed, Ends, Foundation, Section};

    const DT: f64 = 1e-3;

    fn section(length: f64, modulus: f64) -> Section {
        Section {
            length,
            bending_stiffness: 4.5e-5 * modulus,
            bending_damping: 1750.0,
            mass: 2000.0,
            bed: Bed { stiffness: 8.65e7, damping: 280e3, mass: 355.0 / 1.5 },
        }
    }

    fn mesh(sections: &[Section], foundation: Foundation) -> Result<Mesh> {
        Mesh::new(sections, 0.5, foundation, Ends::Free)
    }

    /// Beside a joint, in a section and at an end: what is left out is below the cut, and what is
    /// kept is that of a piece of road twice as long but for as much.
    #[test]
    fn rows_are_those_of_a_longer_piece_of_road() -> Result<()> {
        for foundation in [Foundation::Bars, Foundation::Winkler] {
            let sections = [section(60.0, 4.4e9), section(60.0, 1e9)];
            let mesh = mesh(&sections, foundation)?;
            let band = Band::of(&mesh, DT, Hold::First, &mut unwatched)?;
            for node in [0, 3, 60, 117, 120, 180, 240] {
                let half = 2 * (band.reach + MARGIN);
                let first = usize::saturating_sub(node, half);
                let piece = mesh.part(first..(node + half).min(240));
                let patch = Patch::of(piece, DT, Hold::First, &mut unwatched)?;
                let (node, nodes) = (node - first, patch.strip.nodes().len());
                let row = band.row(&band.stretches[band.stretch(node + first)], node + first);
                for (kind, kept) in patch.kinds().zip(row.chunks_exact(band.width)) {
                    let exact = |other: usize| patch.entry(&kind, node, other);
                    let largest = (0..nodes).map(|other| exact(other).abs()).fold(0.0, f64::max);
                    for other in 0..nodes {
                        let at = (other + band.reach).checked_sub(node);
                        let found = at.and_then(|at| kept.get(at)).copied().unwrap_or(0.0);
                        // Where an end or a softer section is near, the largest may be beside it.
                        let error = (found - exact(other)).abs();
                        assert!(error <= 20.0 * CUT * largest, "{foundation:?} {node} {other}");
                    }
                }
            }
        }
        Ok(())
    }

    /// A row in common for each section, and rows of their own only at ends and joints; joints that
    /// are alike have theirs in common.
    #[test]
    fn a_long_road_has_no_more_rows_than_a_short_one() -> Result<()> {
        let rows = |sections: &[Section]| -> Result<usize> {
            let mesh = mesh(sections, Foundation::Bars)?;
            let band = Band::of(&mesh, DT, Hold::Zero, &mut unwatched)?;
            let nodes = band.stretches.iter().flat_map(|stretch| stretch.nodes.clone());
            assert!(nodes.eq(0..mesh.len()));
            let mut all: Vec<_> = band.stretches.iter().map(|stretch| &stretch.rows).collect();
            all.sort_by_key(|rows| rows.as_ptr());
            all.dedup_by_key(|rows| rows.as_ptr());
            let numbers: usize = all.iter().map(|rows| rows.len()).sum();
            Ok(numbers / band.kinds / band.width)
        };
        let short = rows(&[section(40.0, 4e9)])?;
        assert_eq!(rows(&[section(10e3, 4e9)])?, short);
        let lengths = |lengths: &[f64]| -> Vec<Section> {
            let modulus = |i: usize| if i.is_multiple_of(2) { 4e9 } else { 1e9 };
            lengths.iter().enumerate().map(|(i, &length)| section(length, modulus(i))).collect()
        };
        let three = rows(&lengths(&[60.0, 60.0, 60.0, 60.0]))?;
        assert_eq!(rows(&lengths(&[60.0; 40]))?, three);
        Ok(())
    }
}
