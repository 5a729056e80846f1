//! Linear vehicles over a profile, several at a time: one in each lane of a vector.

use pulp::{Simd, WithSimd};

use super::contact::{Profile, Wheel};
use super::record::{Keep, Keeper, Outlet, Record, Sums};
use super::run::{Passage, WATCHED};
use crate::error::{Result, Watch, diverged, go_on, unwatched};
use crate::linalg::{DMatrix, multiply};
use crate::transition::{Form, Transition};

/// Rows of a product that are summed side by side: enough to hide the latency of an addition.
const ROWS: usize = 8;

/// One step of a vehicle at a fixed speed, as one matrix.
///
/// A step takes the state from `x` to `Phi x + sum_i (A_i u_i + B_i u_i')`, where `u_i` is the
/// elevation under tire `i` at its beginning and `u_i'` at its end. As the end of one step is the
/// beginning of the next, `w = x - sum_i B_i u_i` needs the elevations once:
///
/// ```text
/// [w']   [Phi   A + Phi B] [w]
/// [y ] = [-R        -R B ] [u],      R_i = (k r_i, c r_i),
/// ```
///
/// and the force is `F = F_static + k z + c dz/dt + y`. Where the elevation jumps (a staircase under
/// a point), `u` is its mean over the step and `B = 0`.
struct Step {
    matrix: DMatrix<f64>,
    /// `B`, `2n` rows and a column a tire.
    ends: DMatrix<f64>,
}

impl Step {
    fn new(passage: &Passage<'_>, jumps: &[bool]) -> Result<Self> {
        let Passage { vehicle, run } = passage;
        // A handful of unknowns: done before anyone could ask.
        let transition =
            Transition::new(vehicle.system().clone(), run.dt, Form::Integral, &mut unwatched)?;
        let (gamma, ramp) = (transition.gamma(), transition.ramp());
        let phi = transition.phi().to_dense();
        let (n, tires) = (vehicle.system().len(), vehicle.tires.len());
        let mut begins = DMatrix::zeros(2 * n, tires);
        let mut ends = DMatrix::zeros(2 * n, tires);
        let mut felt = DMatrix::zeros(tires, 2 * n);
        for (i, (tire, row)) in vehicle.tires.iter().zip(&vehicle.rows).enumerate() {
            let (held, growing) = (&gamma * row, &ramp * row);
            if jumps[i] {
                begins.set_column(i, &(held * tire.stiffness));
            } else {
                // The damper feels the mean velocity of the step.
                let end = &growing * tire.stiffness + &held * (tire.damping / run.dt);
                begins.set_column(i, &(held * tire.stiffness - &end));
                ends.set_column(i, &end);
            }
            felt.view_mut((i, 0), (1, n)).copy_from(&(row.transpose() * -tire.stiffness));
            felt.view_mut((i, n), (1, n)).copy_from(&(row.transpose() * -tire.damping));
        }
        let mut matrix = DMatrix::zeros(2 * n + tires, 2 * n + tires);
        begins += multiply(&phi, &ends);
        matrix.view_mut((0, 0), (2 * n, 2 * n)).copy_from(&phi);
        matrix.view_mut((0, 2 * n), (2 * n, tires)).copy_from(&begins);
        matrix.view_mut((2 * n, 0), (tires, 2 * n)).copy_from(&felt);
        matrix.view_mut((2 * n, 2 * n), (tires, tires)).copy_from(&multiply(&felt, &ends));
        Ok(Self { matrix, ends })
    }
}

/// Vehicles of one number of unknowns and one of tires, no more than a vector has lanes.
pub(super) struct Lanes<'a, 'w> {
    pub(super) group: &'a [Passage<'a>],
    pub(super) profile: &'a Profile<'a>,
    pub(super) keep: &'a Keep,
    /// Where the history of the first vehicle goes.
    pub(super) outlet: Option<Outlet<'a>>,
    pub(super) watch: &'a mut Watch<'w>,
}

impl WithSimd for Lanes<'_, '_> {
    type Output = Result<Vec<Record>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { group, profile, keep, mut outlet, watch } = self;
        let Some(Passage { vehicle, .. }) = group.first() else { return Ok(Vec::new()) };
        let (states, tires) = (2 * vehicle.system().len(), vehicle.tires.len());
        let (lanes, size) = (S::F64_LANES, states + tires);
        let mut contacts = Contacts::new(group, profile, lanes);
        let mut sums = Sums::new(tires, lanes, group);
        let mut keepers = Vec::with_capacity(lanes);
        let rows = size.next_multiple_of(ROWS);
        let mut matrix = vec![0.0; rows * size * lanes];
        let mut vector = vec![0.0; size * lanes];
        let mut product = vec![0.0; rows * lanes];
        let mut forces = vec![0.0; tires * lanes];
        for (lane, passage) in group.iter().enumerate() {
            let step = Step::new(passage, &contacts.jumps(lane))?;
            for row in 0..size {
                for column in 0..size {
                    let at = (row / ROWS * size + column) * ROWS + row % ROWS;
                    matrix[at * lanes + lane] = step.matrix[(row, column)];
                }
            }
            // At rest, x = 0.
            for (i, elevation) in contacts.first_elevations(lane).into_iter().enumerate() {
                for state in 0..states {
                    vector[state * lanes + lane] -= step.ends[(state, i)] * elevation;
                }
            }
            keepers.push(Keeper::new(passage, keep, outlet.take())?);
        }
        let longest = group.iter().map(|passage| passage.run.total()).max().unwrap_or(0);
        for step in 0..=longest {
            if step % WATCHED == 0 {
                go_on(watch, step, longest)?;
                if let Some(lane) = sums.unsound_lane() {
                    return Err(diverged("tire force", step, group[lane].run.dt));
                }
            }
            contacts.roll(simd, step, &mut vector[states * lanes..]);
            multiply_lanes(simd, &matrix, &vector, &mut product);
            let (next, felt) = product.split_at(states * lanes);
            contacts.complete(simd, felt, &mut forces);
            for (lane, passage) in group.iter().enumerate() {
                let first = passage.run.skip;
                if step == first || step == passage.run.total() + 1 {
                    sums.count(lane, step == first);
                }
            }
            sums.take(simd, &forces);
            if keep.asks() {
                for (lane, keeper) in keepers.iter_mut().enumerate() {
                    keeper.take(step, |axle| forces[axle * lanes + lane])?;
                }
            }
            vector[..states * lanes].copy_from_slice(next);
        }
        let records = keepers.into_iter().enumerate();
        records.map(|(lane, keeper)| keeper.finish(&sums, lane)).collect()
    }
}

/// Numbers that are held of a tire, each in every lane: distance behind the front axle, stiffness,
/// damping times speed, static load; its place now, the line it is on, and its force.
const BEHIND: usize = 0;
const STIFFNESS: usize = 1;
const DAMPING: usize = 2;
const LOAD: usize = 3;
const PLACE: usize = 4;
const ORIGIN: usize = 5;
const LEVEL: usize = 6;
const SLOPE: usize = 7;
const UNTIL: usize = 8;
const JUMP: usize = 9;
const FORCE: usize = 10;
const NUMBERS: usize = 11;

/// The tires of a group of vehicles on the profile.
struct Contacts<'a> {
    group: &'a [Passage<'a>],
    lanes: usize,
    wheels: Vec<Wheel<'a>>,
    /// Of each vehicle: where the front axle starts, and how far it goes in a step.
    starts: Vec<f64>,
    reaches: Vec<f64>,
    /// Tire by tire, number by number, lane by lane.
    tires: Vec<f64>,
}

impl<'a> Contacts<'a> {
    fn new(group: &'a [Passage<'a>], profile: &'a Profile<'a>, lanes: usize) -> Self {
        let tires = group.first().map_or(0, |passage| passage.vehicle.tires.len());
        let mut contacts = Self {
            group,
            lanes,
            wheels: Vec::with_capacity(group.len() * tires),
            starts: vec![0.0; lanes],
            reaches: vec![0.0; lanes],
            tires: vec![0.0; tires * NUMBERS * lanes],
        };
        for (lane, Passage { vehicle, run }) in group.iter().enumerate() {
            contacts.starts[lane] = run.start;
            contacts.reaches[lane] = run.reach();
            for (i, (tire, load)) in vehicle.tires.iter().zip(vehicle.static_loads()).enumerate() {
                contacts.wheels.push(Wheel::new(profile, tire.print));
                let mut set = |number, value| *contacts.number(i, number, lane) = value;
                set(BEHIND, tire.point.x);
                set(STIFFNESS, tire.stiffness);
                set(DAMPING, tire.damping * run.speed);
                set(LOAD, *load);
                set(UNTIL, f64::NEG_INFINITY);
            }
        }
        // No line ends in a lane without a vehicle.
        for i in 0..tires {
            for lane in group.len()..lanes {
                *contacts.number(i, UNTIL, lane) = f64::INFINITY;
            }
        }
        contacts
    }

    fn number(&mut self, tire: usize, number: usize, lane: usize) -> &mut f64 {
        &mut self.tires[(tire * NUMBERS + number) * self.lanes + lane]
    }

    fn wheels(&mut self, lane: usize) -> &mut [Wheel<'a>] {
        let tires = self.wheels.len() / self.group.len();
        &mut self.wheels[lane * tires..(lane + 1) * tires]
    }

    /// Which tires of a vehicle feel jumps.
    fn jumps(&mut self, lane: usize) -> Vec<bool> {
        self.wheels(lane).iter().map(|wheel| wheel.jumps()).collect()
    }

    /// Elevations under the tires of a vehicle when it starts.
    fn first_elevations(&mut self, lane: usize) -> Vec<f64> {
        let Passage { vehicle, run } = &self.group[lane];
        let tires = vehicle.tires.iter().zip(self.wheels(lane));
        tires
            .map(|(tire, wheel)| wheel.touch(run.start - tire.point.x, run.nudge()).elevation)
            .collect()
    }

    /// Go to a step: the elevation of each tire for the transition, and its share of the forces.
    #[inline(always)]
    fn roll<S: Simd>(&mut self, simd: S, step: usize, road: &mut [f64]) {
        let steps = simd.splat_f64s(step as f64);
        let ahead = simd.mul_f64s(steps, S::as_simd_f64s(&self.reaches).0[0]);
        let front = simd.add_f64s(S::as_simd_f64s(&self.starts).0[0], ahead);
        let mut overdue = simd.splat_f64s(f64::NEG_INFINITY);
        for tire in rows_mut::<S>(&mut self.tires) {
            tire[PLACE] = simd.sub_f64s(front, tire[BEHIND]);
            overdue = simd.max_f64s(overdue, simd.sub_f64s(tire[PLACE], tire[UNTIL]));
        }
        if simd.reduce_max_f64s(overdue) >= 0.0 {
            self.take_lines();
        }
        let road = S::as_mut_simd_f64s(road).0;
        for (tire, road) in rows_mut::<S>(&mut self.tires).iter_mut().zip(road) {
            let rise = simd.mul_f64s(tire[SLOPE], simd.sub_f64s(tire[PLACE], tire[ORIGIN]));
            let elevation = simd.add_f64s(tire[LEVEL], rise);
            *road = simd.add_f64s(elevation, tire[JUMP]);
            let static_and_damper = simd.mul_add_f64s(tire[DAMPING], tire[SLOPE], tire[LOAD]);
            tire[FORCE] = simd.mul_add_f64s(tire[STIFFNESS], elevation, static_and_damper);
        }
    }

    /// Take the line under each tire that has left its own.
    fn take_lines(&mut self) {
        let tires = self.wheels.len() / self.group.len();
        for (lane, Passage { run, .. }) in self.group.iter().enumerate() {
            for i in 0..tires {
                let place = *self.number(i, PLACE, lane);
                if place < *self.number(i, UNTIL, lane) {
                    continue;
                }
                let line = self.wheels[lane * tires + i].line(place, run.reach(), run.nudge());
                *self.number(i, ORIGIN, lane) = line.origin;
                *self.number(i, LEVEL, lane) = line.level;
                *self.number(i, SLOPE, lane) = line.slope;
                *self.number(i, UNTIL, lane) = line.until;
                *self.number(i, JUMP, lane) = line.jump;
            }
        }
    }

    /// Complete the forces by what the motion of the vehicles makes of them.
    #[inline(always)]
    fn complete<S: Simd>(&mut self, simd: S, felt: &[f64], forces: &mut [f64]) {
        let tires = rows_mut::<S>(&mut self.tires).iter();
        let felt = S::as_simd_f64s(felt).0;
        let forces = S::as_mut_simd_f64s(forces).0;
        for ((force, tire), &felt) in forces.iter_mut().zip(tires).zip(felt) {
            *force = simd.add_f64s(tire[FORCE], felt);
        }
    }
}

/// The numbers of each tire.
#[inline(always)]
fn rows_mut<S: Simd>(tires: &mut [f64]) -> &mut [[S::f64s; NUMBERS]] {
    S::as_mut_simd_f64s(tires).0.as_chunks_mut::<NUMBERS>().0
}

/// `out = M v` in every lane, `M` in blocks of [`ROWS`] rows, column by column.
#[inline(always)]
fn multiply_lanes<S: Simd>(simd: S, matrix: &[f64], vector: &[f64], out: &mut [f64]) {
    let (vector, _) = S::as_simd_f64s(vector);
    let (matrix, _) = S::as_simd_f64s(matrix);
    let (out, _) = S::as_mut_simd_f64s(out);
    let blocks = matrix.chunks_exact(ROWS * vector.len());
    for (block, out) in blocks.zip(out.chunks_exact_mut(ROWS)) {
        let mut sums = [simd.splat_f64s(0.0); ROWS];
        for (&x, column) in vector.iter().zip(block.as_chunks::<ROWS>().0) {
            for (sum, &entry) in sums.iter_mut().zip(column) {
                *sum = simd.mul_add_f64s(entry, x, *sum);
            }
        }
        out.copy_from_slice(&sums);
    }
}
