//! The paper's scheme: the whole road stepped by its dense transition matrix (eqs. 9-12).
//!
//! With the matrices of [`crate::transition`] after `i` steps, a state `(u, v)` under no force moves
//! to
//!
//! ```text
//! u_i = H_i (M u) + G_i (C u + M v)
//! v_i = H_i (M v) - G_i (K u)
//! ```
//!
//! Of the steps in between only displacements are asked for, at the nodes and stations, so the state
//! itself goes [`BLOCK`] steps at a time, and what lies between is one matrix product over many
//! blocks. Forces add their own pulse responses: the same numbers as step by step, but for rounding,
//! from a third of the memory traffic, which is what bounds a step. (`G` and `H` of the paper's road
//! take 154 kB and come from the second-level cache; each entry serves two products.)

use pulp::{Arch, Simd, WithSimd};

use super::Hold;
use super::kernel::{Bands, Blocks};
use super::passes::Passes;
use super::record::{Extremes, Keep, Record};
use crate::error::{Result, Watch, diverged, go_on, invalid, reserve};
use crate::linalg::{DMatrix, add_scaled, multiply_add, multiply_by, zeros};
use crate::pavement::load::{Contact, Loads, NodalForces};
use crate::pavement::strip::{Shares, Strip};
use crate::transition::{Levels, Transition};

/// Steps that the state goes at a time. More would cost more in preparing than they save on a road
/// as long as the paper's.
const BLOCK: usize = 4;

/// Blocks between two products for what lies in between, and two words to the watcher.
const BATCH: usize = 64;

/// The matrices that a road, a time step, a hold and the places to read need.
///
/// Factor once, run many: it depends on no force and no position.
#[derive(Debug)]
pub struct Stepper {
    strip: Strip,
    transition: Transition,
    contact: Contact,
    hold: Hold,
    every: usize,
    /// The first of the probes whose history is kept.
    first_kept: usize,
    /// Where deflections are read: the nodes, then the stations.
    probes: Vec<Shares>,
    /// `H` and `G` after a block of steps.
    block: Levels,
    /// `[H_i G_i]` read at the probes, for the steps `i` within a block, one below the other.
    between: DMatrix<f64>,
    /// What the force at the beginning of a step does, and, if it varies, that at its end.
    pulses: Vec<Pulse>,
}

/// What a unit force at one end of a step has done some steps later.
#[derive(Debug)]
struct Pulse {
    /// Displacement and velocity at the end of a block, each `n x n`, by the step it acts in.
    state: Vec<[DMatrix<f64>; 2]>,
    /// Deflection at the probes after one step, two steps, ..., one below the other.
    probes: DMatrix<f64>,
}

impl Stepper {
    /// Carry the transition over a block of steps and read it at the nodes and stations.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) where the transition is not that of the strip, or for a station off the
    /// road or the tire print, [`Error::Stopped`](crate::error::Error::Stopped).
    pub fn new(
        strip: Strip,
        transition: Transition,
        (contact, hold): (impl Into<Contact>, Hold),
        keep: &Keep,
        watch: &mut Watch<'_>,
    ) -> Result<Self> {
        if transition.system() != strip.system() {
            return Err(invalid("transition", "that of another system", "that of the strip"));
        }
        let contact = contact.into();
        contact.check()?;
        let n = strip.system().len();
        let probes = keep.probes(&strip)?;
        let kept = keep.nodes && !keep.quantities.is_empty();
        let first_kept = if kept { 0 } else { strip.nodes().len() };
        let every = keep.every;
        let phi = transition.phi();
        let first = transition.levels();
        let used = match hold {
            Hold::Zero => 1,
            Hold::First => 2,
        };
        let integrals = first.integrals[..used].to_vec();
        let mut stages = vec![Levels { integrals, ..first.clone() }];
        for _ in 1..BLOCK {
            let mut next = Levels::zeros(n, used);
            next.carry(&stages[stages.len() - 1], &phi, first, watch)?;
            stages.push(next);
        }
        let mut between = zeros((BLOCK - 1) * probes.len(), 2 * n);
        for (i, stage) in stages[..BLOCK - 1].iter().enumerate() {
            read(&probes, &stage.rate, &mut between, (i * probes.len(), 0));
            read(&probes, &stage.impulse, &mut between, (i * probes.len(), n));
        }
        let pulses = Pulse::all(&stages, hold, &probes);
        let block = stages.swap_remove(BLOCK - 1);
        Ok(Self {
            strip,
            transition,
            contact,
            hold,
            every,
            first_kept,
            probes,
            block,
            between,
            pulses,
        })
    }

    /// Columns of a record's history.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.probes.len() - self.first_kept
    }

    /// Deflection of the road under `loads`, from rest.
    ///
    /// # Errors
    /// [`Error::Shape`](crate::error::Error::Shape) and [`Error::NonFinite`](crate::error::Error::NonFinite) for loads that do not fit, [`Error::Diverged`](crate::error::Error::Diverged),
    /// [`Error::Stopped`](crate::error::Error::Stopped).
    pub fn run(&self, loads: &Loads<'_>, watch: &mut Watch<'_>) -> Result<Record> {
        let instants = loads.check()?;
        Arch::new().dispatch(Run { stepper: self, loads, instants, watch })
    }
}

/// The rows of `matrix` read at the probes, put into `out` from `(row, column)` on.
fn read(
    probes: &[Shares],
    matrix: &DMatrix<f64>,
    out: &mut DMatrix<f64>,
    (row, column): (usize, usize),
) {
    let (n, rows) = (matrix.nrows(), out.nrows());
    let to = out.as_mut_slice().chunks_exact_mut(rows).skip(column);
    for (from, to) in matrix.as_slice().chunks_exact(n).zip(to) {
        for (probe, to) in probes.iter().zip(&mut to[row..]) {
            *to = probe.read(from);
        }
    }
}

impl Pulse {
    /// The pulses of a hold, from the levels after one step, two steps, ....
    ///
    /// A unit force held for one step is a step up at once and a step down a `dt` later:
    /// `J_i - J_(i-1)`. One that grows to a unit within the step, and is gone after it, is a ramp
    /// that ends in a step down: `(Q_i - Q_(i-1)) / dt - J_(i-1)`. Velocities are one level below.
    fn all(stages: &[Levels], hold: Hold, probes: &[Shares]) -> Vec<Self> {
        let dt = stages[0].time;
        let n = stages[0].rate.nrows();
        let held = |i: usize, level: usize| {
            let mut out = stages[i].level(level).clone();
            if i > 0 {
                add_scaled(out.as_mut_slice(), -1.0, stages[i - 1].level(level).as_slice());
            }
            out
        };
        let grown = |i: usize, level: usize| {
            let mut out = multiply_by(&held(i, level + 1), 1.0 / dt);
            if i > 0 {
                add_scaled(out.as_mut_slice(), -1.0, stages[i - 1].level(level).as_slice());
            }
            out
        };
        type Shape<'a> = &'a dyn Fn(usize, usize) -> DMatrix<f64>;
        let shrunk = |i: usize, level: usize| held(i, level) - grown(i, level);
        let shapes: &[Shape<'_>] = match hold {
            Hold::Zero => &[&held],
            Hold::First => &[&shrunk, &grown],
        };
        let pulse = |shape: &Shape<'_>| {
            let mut at_probes = zeros((stages.len() - 1) * probes.len(), n);
            let mut state = Vec::with_capacity(stages.len());
            for i in 0..stages.len() {
                let displacement = shape(i, 2);
                if i + 1 < stages.len() {
                    read(probes, &displacement, &mut at_probes, (i * probes.len(), 0));
                }
                state.push([displacement, shape(i, 1)]);
            }
            state.reverse(); // a force in the first step of a block acts on for the longest
            Self { state, probes: at_probes }
        };
        shapes.iter().map(pulse).collect()
    }
}

struct Run<'a, 'w> {
    stepper: &'a Stepper,
    loads: &'a Loads<'a>,
    instants: usize,
    watch: &'a mut Watch<'w>,
}

impl WithSimd for Run<'_, '_> {
    type Output = Result<Record>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<Record> {
        let Self { stepper, loads, instants, watch } = self;
        let Stepper { strip, transition, hold, probes, every, first_kept, .. } = stepper;
        let nodes = strip.nodes().len();
        let passes = Passes::new(strip.mesh(), loads, 0);
        let mut extremes = Extremes::new(passes, nodes, *hold == Hold::First);
        let mut history = Vec::new();
        reserve(&mut history, instants.div_ceil(*every) * stepper.columns())?;
        let mut state = State::new::<S>(stepper);
        let mut batch = Batch::new(stepper);
        let mut forces = Forces::default();
        for start in (0..instants).step_by(BATCH * BLOCK) {
            go_on(watch, start, instants - 1)?;
            for column in 0..BATCH {
                state.begin(simd);
                batch.read(column, stepper, &state);
                forces.set(stepper, loads, start + column * BLOCK, instants);
                forces.act(stepper, &mut batch.inner, column, &mut state);
                state.finish(simd);
            }
            batch.finish(stepper);
            for (step, deflection) in (start..instants).zip(batch.instants(probes.len())) {
                extremes.update(step, 0, &deflection[..nodes]);
                if step.is_multiple_of(*every) {
                    history.extend_from_slice(&deflection[*first_kept..]);
                }
            }
            if !state.displacement().iter().sum::<f64>().is_finite() {
                let step = (start + BATCH * BLOCK).min(instants - 1);
                return Err(diverged("deflection", step, transition.dt()));
            }
        }
        go_on(watch, instants - 1, instants - 1)?;
        Ok(Record { history, envelope: extremes.finish(instants) })
    }
}

/// Deflections at the probes over a batch of blocks.
struct Batch {
    /// Probes x blocks: at the beginning of each block.
    first: DMatrix<f64>,
    /// (Steps within a block x probes) x blocks: in between.
    inner: DMatrix<f64>,
    /// `[M u; C u + M v]` at the beginning of each block.
    products: DMatrix<f64>,
}

impl Batch {
    fn new(stepper: &Stepper) -> Self {
        let (rows, columns) = stepper.between.shape();
        Self {
            first: zeros(stepper.probes.len(), BATCH),
            inner: zeros(rows, BATCH),
            products: zeros(columns, BATCH),
        }
    }

    #[inline(always)]
    fn read(&mut self, column: usize, stepper: &Stepper, state: &State) {
        let u = state.displacement();
        let rows = stepper.probes.len();
        let first = &mut self.first.as_mut_slice()[column * rows..(column + 1) * rows];
        for (to, probe) in first.iter_mut().zip(&stepper.probes) {
            *to = probe.read(u);
        }
        let rows = self.inner.nrows();
        self.inner.as_mut_slice()[column * rows..(column + 1) * rows].fill(0.0);
        let n = state.n;
        let products = &mut self.products.as_mut_slice()[2 * n * column..2 * n * (column + 1)];
        products[..n].copy_from_slice(&state.products[0][..n]);
        products[n..].copy_from_slice(&state.products[1][..n]);
    }

    fn finish(&mut self, stepper: &Stepper) {
        multiply_add(&mut self.inner, 1.0, &stepper.between, &self.products);
    }

    /// The deflections at one instant after the other.
    fn instants(&self, probes: usize) -> impl Iterator<Item = &[f64]> {
        let first = self.first.as_slice().chunks_exact(probes);
        let inner = self.inner.as_slice().chunks_exact((BLOCK - 1) * probes);
        first.zip(inner).flat_map(move |(first, inner)| {
            std::iter::once(first).chain(inner.chunks_exact(probes))
        })
    }
}

/// The nodal forces at each end of the steps of a block.
#[derive(Default)]
struct Forces([NodalForces; BLOCK + 1]);

impl Forces {
    fn set(&mut self, stepper: &Stepper, loads: &Loads<'_>, start: usize, instants: usize) {
        let ends = BLOCK - 1 + stepper.pulses.len();
        for (i, forces) in self.0[..ends].iter_mut().enumerate() {
            forces.0.clear();
            if start + i < instants {
                forces.set(&stepper.strip, loads, stepper.contact, start + i);
            }
        }
    }

    /// Add what they do to the probes within the block and to the state at its end.
    #[inline(always)]
    fn act(&self, stepper: &Stepper, inner: &mut DMatrix<f64>, column: usize, state: &mut State) {
        let rows = inner.nrows();
        let inner = &mut inner.as_mut_slice()[column * rows..(column + 1) * rows];
        for (end, pulse) in stepper.pulses.iter().enumerate() {
            for step in 0..BLOCK {
                let after = &mut inner[step * stepper.probes.len()..];
                for &(unknown, force) in &self.0[step + end].0 {
                    add_scaled(after, force, column_of(&pulse.probes, unknown));
                    state.push(&pulse.state[step], unknown, force);
                }
            }
        }
    }
}

fn column_of(matrix: &DMatrix<f64>, column: usize) -> &[f64] {
    &matrix.as_slice()[column * matrix.nrows()..(column + 1) * matrix.nrows()]
}

/// The state and all that a block of steps reads, laid out for vectors.
struct State {
    n: usize,
    blocks: Blocks,
    bands: Bands,
    /// Displacement and velocity now, with `bands.half` zeros before and after them.
    now: [Vec<f64>; 2],
    /// Displacement and velocity after the block.
    next: [Vec<f64>; 2],
    /// `M u`, `C u + M v`, `-K u`, `M v`.
    products: [Vec<f64>; 4],
}

impl State {
    /// At rest.
    fn new<S: Simd>(stepper: &Stepper) -> Self {
        let system = stepper.transition.system();
        let blocks = Blocks::new::<S>(&stepper.block.impulse, &stepper.block.rate);
        let bands = Bands::new(system, blocks.rows);
        let padded = vec![0.0; blocks.rows + 2 * bands.half];
        Self {
            n: system.len(),
            now: std::array::from_fn(|_| padded.clone()),
            next: std::array::from_fn(|_| padded.clone()),
            products: std::array::from_fn(|_| vec![0.0; blocks.rows]),
            blocks,
            bands,
        }
    }

    fn displacement(&self) -> &[f64] {
        &self.now[0][self.bands.half..][..self.n]
    }

    /// Multiply the state with the bands; no force as yet.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S) {
        let [u, v] = &self.now;
        self.bands.apply(simd, u, v, &mut self.products);
        for next in &mut self.next {
            next.fill(0.0);
        }
    }

    /// Add a force on an unknown times what a unit of it makes of displacement and velocity.
    #[inline(always)]
    fn push(&mut self, unit: &[DMatrix<f64>; 2], unknown: usize, force: f64) {
        let half = self.bands.half;
        for (next, unit) in self.next.iter_mut().zip(unit) {
            add_scaled(&mut next[half..], force, column_of(unit, unknown));
        }
    }

    /// Multiply with `G` and `H`; what was next is now.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S) {
        let half = self.bands.half;
        let [u, v] = &mut self.next;
        self.blocks.apply(simd, self.n, &self.products, &mut u[half..], &mut v[half..]);
        std::mem::swap(&mut self.now, &mut self.next);
    }
}
