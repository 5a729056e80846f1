//! Linear vehicles over a profile, several at a time: one in each lane of a vector.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::contact::{Interpolation, Line, Profile, Wheel};
use super::course::{Course, Piece};
use super::model::{Tire, Vehicle};
use super::record::{Keep, Keeper, Outlet, Record, Sums, Tally};
use super::run::{Passage, WATCHED};
use crate::aligned::Aligned;
use crate::error::{Result, Watch, diverged, go_on, invalid, unwatched};
use crate::linalg::{DMatrix, multiply};
use crate::transition::{Form, Transition};

/// Most rows of a product that are summed side by side: their sums stay in registers.
const ROWS: usize = 12;

/// Ticks of a run whose forces are looked at together; a part of [`WATCHED`].
const CHUNK: usize = 128;

/// One step of a linear vehicle as one matrix, at any speed.
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
#[derive(Debug, Clone)]
pub(crate) struct Step {
    dt: f64,
    /// Numbers of the state, twice the unknowns.
    states: usize,
    tires: Vec<Tire>,
    loads: Vec<f64>,
    /// The matrix by [blocks](deal) of rows, each column by column.
    matrix: Vec<f64>,
    /// `B`, a row a number of the state and a column a tire.
    ends: DMatrix<f64>,
}

impl Step {
    /// Of a vehicle in steps of `dt`, over profiles that are felt in such a way.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a vehicle with dry friction, and as
    /// [`Transition::new`].
    pub(crate) fn new(vehicle: &Vehicle, dt: f64, interpolation: Interpolation) -> Result<Self> {
        if !vehicle.frictions.is_empty() {
            let springs = format!("{} springs with dry friction", vehicle.frictions.len());
            return Err(invalid("vehicle", springs, "linear, without dry friction"));
        }
        // A handful of unknowns: done before anyone could ask.
        let transition =
            Transition::new(vehicle.system().clone(), dt, Form::Integral, &mut unwatched)?;
        let (gamma, ramp) = (transition.gamma(), transition.ramp());
        let phi = transition.phi().to_dense();
        let (n, tires) = (vehicle.system().len(), vehicle.tires.len());
        let mut begins = DMatrix::zeros(2 * n, tires);
        let mut ends = DMatrix::zeros(2 * n, tires);
        let mut felt = DMatrix::zeros(tires, 2 * n);
        for (i, (tire, row)) in vehicle.tires.iter().zip(&vehicle.rows).enumerate() {
            let (held, growing) = (&gamma * row, &ramp * row);
            if interpolation.jumps(tire.print) {
                begins.set_column(i, &(held * tire.stiffness));
            } else {
                // The damper feels the mean velocity of the step.
                let end = &growing * tire.stiffness + &held * (tire.damping / dt);
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
        let blocks = deal(matrix.nrows()).flat_map(|rows| {
            let columns = matrix.column_iter();
            columns.flat_map(move |column| column.as_slice()[rows.clone()].to_vec())
        });
        Ok(Self {
            dt,
            states: 2 * n,
            tires: vehicle.tires.clone(),
            loads: vehicle.static_loads().to_vec(),
            matrix: blocks.collect(),
            ends,
        })
    }

    /// Numbers of the state, and tires: what vehicles that go side by side have in common.
    pub(crate) fn kind(&self) -> (usize, usize) {
        (self.states, self.tires.len())
    }

    /// What the forces of a vehicle came to over the ticks that counted, from its
    /// [state](Abreast::state); nothing where none did yet.
    pub(crate) fn tally(&self, state: &[f64]) -> Option<Tally> {
        Tally::of(&self.loads, &state[1 + self.states..])
    }
}

/// Rows of a product in blocks as even as they can be, none higher than [`ROWS`].
#[inline(always)]
fn deal(rows: usize) -> impl Iterator<Item = Range<usize>> {
    let blocks = rows.div_ceil(ROWS);
    (0..blocks).map(move |i| rows * i / blocks..rows * (i + 1) / blocks)
}

/// A vehicle on its way.
#[derive(Debug, Clone)]
pub(crate) struct Member<'a> {
    pub(crate) step: &'a Step,
    /// The road; none where it is smooth: then the forces are the static loads.
    pub(crate) profile: Option<&'a Profile<'a>>,
    pub(crate) course: &'a Course,
    /// The tick at which it starts, at rest at equilibrium on the level of the profile's first sample;
    /// its forces are its static loads before.
    pub(crate) begin: i64,
    /// The ticks that its [`Tally`] is of.
    pub(crate) counts: Range<i64>,
}

/// A vehicle in its lane.
struct Rider<'a> {
    member: Member<'a>,
    /// One a tire; none on a smooth road.
    wheels: Vec<Wheel<'a>>,
    begun: bool,
    piece: Piece,
    /// How far the step from here goes, m.
    reach: f64,
    /// The next tick at which it starts, changes its speed, or counts from or no more.
    due: i64,
}

/// Linear vehicles of one [kind](Step::kind) side by side, no more than a vector has lanes.
///
/// They can be stopped after any tick and gone on with, in any lanes, beside any others of their kind:
/// that changes no bit.
pub(crate) struct Abreast<'a> {
    lanes: usize,
    states: usize,
    riders: Vec<Rider<'a>>,
    /// The next tick at which a rider is due.
    due: i64,
    /// Whether any vehicle has begun to move.
    moves: bool,
    /// Of each lane: the front axle's place at a tick, that tick, and how far a step goes.
    paths: Aligned<f64>,
    /// Tire by tire, number by number, lane by lane.
    tires: Aligned<f64>,
    matrix: Aligned<f64>,
    /// `w` and `u`, and room for `w'` and `y`.
    now: Aligned<f64>,
    next: Aligned<f64>,
    sums: Sums,
}

/// Numbers that are held of a lane.
const PLACE: usize = 0;
const FIRST: usize = 1;
const REACH: usize = 2;
const PATH: usize = 3;

/// Numbers that are held of a tire, each in every lane: distance behind the front axle, stiffness,
/// damping times speed, static load; the line it is on, and how far ahead of it that must go on.
const BEHIND: usize = 0;
const STIFFNESS: usize = 1;
const DAMPING: usize = 2;
const LOAD: usize = 3;
const ORIGIN: usize = 4;
const LEVEL: usize = 5;
const SLOPE: usize = 6;
const UNTIL: usize = 7;
const JUMP: usize = 8;
const MARGIN: usize = 9;
const NUMBERS: usize = 10;

impl<'a> Abreast<'a> {
    /// Of members of one kind, at least one and no more than `lanes`, each with the [`Abreast::state`]
    /// in which it stopped; none at first.
    pub(crate) fn new<'s>(
        lanes: usize,
        members: impl IntoIterator<Item = (Member<'a>, Option<&'s [f64]>)>,
    ) -> Self {
        let (riders, saved): (Vec<_>, Vec<_>) =
            members.into_iter().map(|(member, state)| (Rider::new(member, state), state)).unzip();
        let (states, tires) = riders.first().map_or((0, 0), |rider| rider.member.step.kind());
        let size = states + tires;
        let mut abreast = Self {
            lanes,
            states,
            due: i64::MIN,
            moves: false,
            paths: Aligned::zeros(PATH * lanes),
            tires: Aligned::zeros(tires * NUMBERS * lanes),
            matrix: Aligned::zeros(size * size * lanes),
            now: Aligned::zeros(size * lanes),
            next: Aligned::zeros(size * lanes),
            sums: Sums::new(tires, lanes),
            riders,
        };
        for tire in abreast.tires.chunks_exact_mut(NUMBERS * lanes) {
            tire[UNTIL * lanes..][..lanes].fill(f64::INFINITY);
        }
        for (lane, (Rider { member, .. }, state)) in abreast.riders.iter().zip(saved).enumerate() {
            let Member { step, profile, .. } = member;
            debug_assert_eq!(step.kind(), (states, tires), "vehicles of one kind");
            if profile.is_some() {
                for (to, entry) in abreast.matrix.chunks_exact_mut(lanes).zip(&step.matrix) {
                    to[lane] = *entry;
                }
            }
            for (tire, numbers) in abreast.tires.chunks_exact_mut(NUMBERS * lanes).enumerate() {
                numbers[BEHIND * lanes + lane] = step.tires[tire].point.x;
                numbers[STIFFNESS * lanes + lane] = step.tires[tire].stiffness;
                numbers[LOAD * lanes + lane] = step.loads[tire];
            }
            let saved = state.map(|state| state[1..].split_at(states));
            abreast.sums.enter(lane, &step.loads, saved.map(|(_, sums)| sums));
            for (to, w) in abreast.now.chunks_exact_mut(lanes).zip(saved.map_or(&[][..], |s| s.0)) {
                to[lane] = *w;
            }
        }
        abreast
    }

    /// The state of a lane's vehicle after the last tick that was run: what a [`Member`] goes on from.
    pub(crate) fn state(&self, lane: usize) -> Vec<f64> {
        let mut state = Vec::new();
        state.push(f64::from(u8::from(self.riders[lane].begun)));
        state.extend(self.now.chunks_exact(self.lanes).take(self.states).map(|w| w[lane]));
        self.sums.save(lane, &mut state);
        state
    }

    /// Go on over ticks that follow each other and those before, and write the tire forces, N, at each
    /// of them: tick by tick, axle by axle, lane by lane.
    ///
    /// # Errors
    /// [`Error::Diverged`](crate::error::Error::Diverged) where a force is not finite.
    #[inline(always)]
    pub(crate) fn run<S: Simd>(
        &mut self,
        simd: S,
        ticks: Range<i64>,
        forces: &mut [f64],
    ) -> Result<()> {
        let width = self.tires.len() / NUMBERS;
        for (tick, forces) in ticks.clone().zip(forces.chunks_exact_mut(width)) {
            if tick >= self.due {
                self.turn(tick);
            }
            if self.moves {
                self.roll(simd, tick, forces);
                multiply_lanes(simd, &self.matrix, &self.now, &mut self.next);
                let felt = S::as_simd_f64s(&self.next[self.states * self.lanes..]).0;
                for (force, &felt) in S::as_mut_simd_f64s(forces).0.iter_mut().zip(felt) {
                    *force = simd.add_f64s(*force, felt);
                }
                std::mem::swap(&mut self.now, &mut self.next);
            } else {
                let loads = self.tires.chunks_exact(NUMBERS * self.lanes);
                for (force, tire) in forces.chunks_exact_mut(self.lanes).zip(loads) {
                    force.copy_from_slice(&tire[LOAD * self.lanes..][..self.lanes]);
                }
            }
            self.sums.take(simd, tick, forces);
        }
        let unsound = |lane: usize| {
            let step = usize::try_from(ticks.end - 1).unwrap_or(0);
            Err(diverged("tire force", step, self.riders[lane].member.step.dt))
        };
        self.sums.unsound_lane().map_or(Ok(()), unsound)
    }

    /// Go to a tick: the elevation of each tire for the step from there, and its share of the forces.
    #[inline(always)]
    fn roll<S: Simd>(&mut self, simd: S, tick: i64, forces: &mut [f64]) {
        let paths = S::as_simd_f64s(&self.paths).0;
        let ahead = simd.sub_f64s(simd.splat_f64s(tick as f64), paths[FIRST]);
        let front = simd.add_f64s(paths[PLACE], simd.mul_f64s(paths[REACH], ahead));
        let size = NUMBERS * self.lanes;
        let road = S::as_mut_simd_f64s(&mut self.now[self.states * self.lanes..]).0;
        let forces = S::as_mut_simd_f64s(forces).0;
        for (i, (road, force)) in road.iter_mut().zip(forces).enumerate() {
            let numbers = &mut self.tires[i * size..][..size];
            let tire = S::as_simd_f64s(numbers).0;
            let place = simd.sub_f64s(front, tire[BEHIND]);
            let overdue = simd.sub_f64s(simd.add_f64s(place, tire[MARGIN]), tire[UNTIL]);
            if simd.reduce_max_f64s(overdue) >= 0.0 {
                take_lines(&mut self.riders, i, tick, numbers, self.lanes);
            }
            let tire = S::as_simd_f64s(numbers).0;
            let rise = simd.mul_f64s(tire[SLOPE], simd.sub_f64s(place, tire[ORIGIN]));
            let elevation = simd.add_f64s(tire[LEVEL], rise);
            *road = simd.add_f64s(elevation, tire[JUMP]);
            let static_and_damper = simd.mul_add_f64s(tire[DAMPING], tire[SLOPE], tire[LOAD]);
            *force = simd.mul_add_f64s(tire[STIFFNESS], elevation, static_and_damper);
        }
    }

    /// Let the riders that are due at a tick start, change their speeds, and count.
    #[cold]
    fn turn(&mut self, tick: i64) {
        let lanes = self.lanes;
        for (lane, rider) in self.riders.iter_mut().enumerate() {
            if tick < rider.due {
                continue;
            }
            let starts = rider.turn(tick);
            let Rider { member, wheels, piece, reach, .. } = rider;
            self.sums.count(lane, member.counts.contains(&tick));
            for (number, value) in
                [(PLACE, piece.place), (FIRST, piece.first as f64), (REACH, piece.reach)]
            {
                self.paths[number * lanes + lane] = value;
            }
            if !rider.begun {
                continue;
            }
            for (i, wheel) in wheels.iter_mut().enumerate() {
                self.moves = true;
                let tire = member.step.tires[i];
                let numbers = &mut self.tires[i * NUMBERS * lanes..];
                numbers[DAMPING * lanes + lane] = tire.damping * piece.speed;
                numbers[MARGIN * lanes + lane] = wheel.margin(*reach, piece.nudge());
                numbers[UNTIL * lanes + lane] = f64::NEG_INFINITY;
                let place = piece.place(tick) - tire.point.x;
                wheel.find(place);
                if starts {
                    // At rest, x = 0.
                    let elevation = wheel.touch(place, piece.nudge()).elevation;
                    for (state, end) in member.step.ends.column(i).iter().enumerate() {
                        self.now[state * lanes + lane] -= end * elevation;
                    }
                }
            }
        }
        self.due = self.riders.iter().map(|rider| rider.due).min().unwrap_or(i64::MAX);
    }
}

impl<'a> Rider<'a> {
    fn new(member: Member<'a>, state: Option<&[f64]>) -> Self {
        let tires = &member.step.tires;
        let wheels = member.profile.map_or_else(Vec::new, |profile| {
            tires.iter().map(|tire| Wheel::new(profile, tire.print)).collect()
        });
        let begun = state.is_some_and(|state| state[0] != 0.0);
        let piece = *member.course.piece(member.begin).0;
        Self { member, wheels, begun, piece, reach: piece.reach, due: i64::MIN }
    }

    /// Do what is due at a tick; whether it is to start.
    fn turn(&mut self, tick: i64) -> bool {
        let Member { course, begin, counts, .. } = &self.member;
        let (piece, next) = course.piece(tick);
        self.piece = *piece;
        // A step over a break goes as far as both pieces say.
        self.reach = match next {
            Some(next) if next == tick + 1 => (course.place(next) - piece.place(tick)).max(0.0),
            _ => piece.reach,
        };
        let starts = !self.begun && tick >= *begin;
        self.begun |= starts;
        let next = next.unwrap_or(i64::MAX);
        let dues = [*begin, counts.start, counts.end, next - 1, next];
        self.due = dues.into_iter().filter(|due| *due > tick).min().unwrap_or(i64::MAX);
        starts
    }
}

/// Take the line under a tire of each vehicle that has left its own.
fn take_lines(riders: &mut [Rider<'_>], tire: usize, tick: i64, numbers: &mut [f64], lanes: usize) {
    for (lane, Rider { wheels, piece, reach, .. }) in riders.iter_mut().enumerate() {
        let Some(wheel) = wheels.get_mut(tire) else { continue };
        let at = |number: usize| number * lanes + lane;
        let place = piece.place(tick) - numbers[at(BEHIND)];
        if place + numbers[at(MARGIN)] < numbers[at(UNTIL)] {
            continue;
        }
        let Line { origin, level, slope, until, jump } = wheel.line(place, *reach, piece.nudge());
        numbers[at(ORIGIN)] = origin;
        numbers[at(LEVEL)] = level;
        numbers[at(SLOPE)] = slope;
        numbers[at(UNTIL)] = until;
        numbers[at(JUMP)] = jump;
    }
}

/// `out = M v` in every lane, `M` in [blocks](deal) of rows, each column by column.
#[inline(always)]
fn multiply_lanes<S: Simd>(simd: S, matrix: &[f64], vector: &[f64], out: &mut [f64]) {
    let (vector, out) = (S::as_simd_f64s(vector).0, S::as_mut_simd_f64s(out).0);
    let mut matrix = S::as_simd_f64s(matrix).0;
    for rows in deal(out.len()) {
        let (block, rest) = matrix.split_at(rows.len() * vector.len());
        let out = &mut out[rows];
        match out.len() {
            1 => multiply_rows::<S, 1>(simd, block, vector, out),
            2 => multiply_rows::<S, 2>(simd, block, vector, out),
            3 => multiply_rows::<S, 3>(simd, block, vector, out),
            4 => multiply_rows::<S, 4>(simd, block, vector, out),
            5 => multiply_rows::<S, 5>(simd, block, vector, out),
            6 => multiply_rows::<S, 6>(simd, block, vector, out),
            7 => multiply_rows::<S, 7>(simd, block, vector, out),
            8 => multiply_rows::<S, 8>(simd, block, vector, out),
            9 => multiply_rows::<S, 9>(simd, block, vector, out),
            10 => multiply_rows::<S, 10>(simd, block, vector, out),
            11 => multiply_rows::<S, 11>(simd, block, vector, out),
            _ => multiply_rows::<S, ROWS>(simd, block, vector, out),
        }
        matrix = rest;
    }
}

#[inline(always)]
fn multiply_rows<S: Simd, const N: usize>(
    simd: S,
    block: &[S::f64s],
    vector: &[S::f64s],
    out: &mut [S::f64s],
) {
    let mut sums = [simd.splat_f64s(0.0); N];
    for (&x, column) in vector.iter().zip(block.as_chunks::<N>().0) {
        for (sum, &entry) in sums.iter_mut().zip(column) {
            *sum = simd.mul_add_f64s(entry, x, *sum);
        }
    }
    out.copy_from_slice(&sums);
}

/// Runs of vehicles of one number of unknowns and one of tires, no more than a vector has lanes.
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
        let mut steps = Vec::with_capacity(group.len());
        let mut courses = Vec::with_capacity(group.len());
        let mut keepers = Vec::with_capacity(group.len());
        for passage in group {
            let Passage { vehicle, run } = passage;
            steps.push(Step::new(vehicle, run.dt, profile.interpolation())?);
            courses.push(Course::steady(run.start, run.speed, run.dt));
            keepers.push(Keeper::new(passage, keep, outlet.take())?);
        }
        let members = steps.iter().zip(&courses).zip(group).map(|((step, course), passage)| {
            let counts = passage.run.skip as i64..passage.run.total() as i64 + 1;
            (Member { step, profile: Some(profile), course, begin: 0, counts }, None)
        });
        let mut abreast = Abreast::new(S::F64_LANES, members);
        let width = S::F64_LANES * steps.first().map_or(0, |step| step.tires.len());
        let mut forces = vec![0.0; CHUNK * width];
        let longest = group.iter().map(|passage| passage.run.total()).max().unwrap_or(0);
        for first in (0..=longest).step_by(CHUNK) {
            if first % WATCHED == 0 {
                go_on(watch, first, longest)?;
            }
            let end = (first + CHUNK).min(longest + 1);
            abreast.run(simd, first as i64..end as i64, &mut forces)?;
            if keep.asks() {
                for (step, forces) in (first..end).zip(forces.chunks_exact(width)) {
                    for (lane, keeper) in keepers.iter_mut().enumerate() {
                        keeper.take(step, |axle| forces[axle * S::F64_LANES + lane])?;
                    }
                }
            }
        }
        let records = keepers
            .into_iter()
            .enumerate()
            .map(|(lane, keeper)| keeper.finish(&abreast.state(lane)[1 + abreast.states..]));
        records.collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use pulp::Arch;

    use super::super::course::Break;
    use super::super::{Body, Friction, Point, Run, Spring};
    use super::*;
    use crate::error::Error;

    const DT: f64 = 1e-3;

    /// A truck with a cab, a steer axle and two drive axles, 6 unknowns; the last tire has a print.
    fn truck(load: f64, friction: Option<Friction>) -> Result<Vehicle> {
        let axles = [0.0, 3.8, 5.1];
        let body = |mass, inertia, x| Body { mass, inertia, x, pin: None };
        let point = |body, x| Point { body, x };
        let mut bodies = vec![body(9000.0 + load, 4e4, 2.6), body(900.0, 0.0, 0.3)];
        let cab = Spring::between(point(1, 0.3), point(0, 0.3), 1e5, 6e3);
        let mut springs = vec![cab];
        let mut tires = Vec::new();
        for (axle, x) in axles.into_iter().enumerate() {
            bodies.push(body(700.0, 0.0, x));
            let spring = Spring::between(point(0, x), point(2 + axle, x), 6e5, 1.5e4);
            springs.push(Spring { friction, ..spring });
            let print = if axle == 2 { 0.3 } else { 0.0 };
            tires.push(Tire { print, ..Tire::at(point(2 + axle, x), 2e6, 2e3) });
        }
        Vehicle::new(&bodies, &springs, &tires)
    }

    fn rough() -> (Vec<f64>, Vec<f64>) {
        let wave = |x: f64| 8e-3 * (1.9 * x).sin() + 3e-3 * (6.1 * x + 1.0).cos();
        (0..900).map(|i| 0.13 * f64::from(i)).map(|x| (x, wave(x))).unzip()
    }

    /// Pieces from such a time, s, at such a place, m: how long, s, and how fast, m/s.
    fn course(mut time: f64, mut place: f64, pieces: &[(f64, f64)]) -> Result<Course> {
        let mut breaks = Vec::new();
        for &(lasts, speed) in pieces {
            breaks.push(Break { time, place, speed });
            time += lasts;
            place += speed * lasts;
        }
        Course::new(&breaks, DT)
    }

    /// Away from a crossing: it brakes, stands, and goes on, at no whole number of steps.
    const STOPS: [(f64, f64); 5] =
        [(0.70013, 17.0), (0.31007, 9.3), (0.45, 0.0), (0.2002, 4.4), (1.0, 13.0)];

    struct Count;

    impl WithSimd for Count {
        type Output = usize;

        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }

    fn lanes() -> usize {
        Arch::new().dispatch(Count)
    }

    struct Go<'a, 'b>(&'b mut Abreast<'a>, Range<i64>);

    impl WithSimd for Go<'_, '_> {
        type Output = Result<Vec<f64>>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Self(abreast, ticks) = self;
            let width = S::F64_LANES * abreast.riders[0].member.step.tires.len();
            let mut forces = vec![0.0; ticks.clone().count() * width];
            abreast.run(simd, ticks, &mut forces)?;
            Ok(forces)
        }
    }

    /// Forces of each member of a group, tick by tick, axle by axle, and the states they end in.
    fn go<'a, 's>(
        members: impl IntoIterator<Item = (Member<'a>, Option<&'s [f64]>)>,
        ticks: Range<i64>,
    ) -> Result<Vec<(Vec<f64>, Vec<f64>)>> {
        let mut abreast = Abreast::new(lanes(), members);
        let forces = Arch::new().dispatch(Go(&mut abreast, ticks))?;
        let of_lane = |lane| forces.iter().copied().skip(lane).step_by(lanes()).collect();
        Ok((0..abreast.riders.len()).map(|lane| (of_lane(lane), abreast.state(lane))).collect())
    }

    /// Forces of one vehicle by the exponential of the augmented system, nothing shared with a step
    /// but the vehicle's matrices: between ticks each elevation is linear in time.
    fn propagated(
        vehicle: &Vehicle,
        profile: &Profile<'_>,
        course: &Course,
        ticks: Range<i64>,
    ) -> Vec<f64> {
        let (n, tires) = (vehicle.system().len(), vehicle.tires.len());
        let (mass, damping, stiffness) = (
            vehicle.system().mass.to_dense(),
            vehicle.system().damping.to_dense(),
            vehicle.system().stiffness.to_dense(),
        );
        let inverse = nalgebra::Cholesky::new(mass).map(|c| c.inverse()).unwrap_or_default();
        // Displacements, velocities, elevations, rates of the elevations.
        let size = 2 * n + 2 * tires;
        let mut rates = DMatrix::zeros(size, size);
        for i in 0..n {
            rates[(i, n + i)] = 1.0;
        }
        rates.view_mut((n, 0), (n, n)).copy_from(&(-&inverse * stiffness));
        rates.view_mut((n, n), (n, n)).copy_from(&(-&inverse * damping));
        for (i, (tire, row)) in vehicle.tires.iter().zip(&vehicle.rows).enumerate() {
            let push = &inverse * row;
            rates.view_mut((n, 2 * n + i), (n, 1)).copy_from(&(&push * tire.stiffness));
            rates.view_mut((n, 2 * n + tires + i), (n, 1)).copy_from(&(&push * tire.damping));
            rates[(2 * n + i, 2 * n + tires + i)] = 1.0;
        }
        let step = (rates * DT).exp();
        let mut wheels: Vec<_> =
            vehicle.tires.iter().map(|tire| Wheel::new(profile, tire.print)).collect();
        let mut touch = |tick: i64, i: usize| {
            wheels[i].touch(course.place(tick) - vehicle.tires[i].point.x, 1e-9)
        };
        let mut x = DVector::zeros(size);
        let mut forces = Vec::new();
        for tick in ticks {
            for (i, (tire, row)) in vehicle.tires.iter().zip(&vehicle.rows).enumerate() {
                let (here, ahead) = (touch(tick, i), touch(tick + 1, i).elevation);
                let height = row.dot(&x.rows(0, n));
                let sinks = row.dot(&x.rows(n, n));
                let rise = course.piece(tick).0.speed * here.slope;
                forces.push(
                    vehicle.static_loads()[i]
                        + tire.stiffness * (here.elevation - height)
                        + tire.damping * (rise - sinks),
                );
                x[2 * n + i] = here.elevation;
                x[2 * n + tires + i] = (ahead - here.elevation) / DT;
            }
            x = &step * x;
        }
        forces
    }

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_course_of_one_piece_is_a_run_at_constant_speed() -> Result<()> {
        let (x, z) = rough();
        let vehicle = truck(4e3, None)?;
        for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
            let profile = Profile::new(&x, &z, interpolation)?;
            let (steps, tolerance) = (2500, 1e-4);
            let run =
                Run { speed: 21.0, dt: DT, start: 3.0, skip: 0, steps, lift_off: false, tolerance };
            let expected = vehicle.tire_forces(&profile, &run, &mut unwatched)?;
            let step = Step::new(&vehicle, DT, interpolation)?;
            let profile = Some(&profile);
            // Late as early, but for the rounding of a late time.
            for (begin, error) in [(0, 0.0), (7000, 1e-9)] {
                let course = course(1e-3 * begin as f64, 3.0, &[(1.0, 21.0)])?;
                let member = Member { step: &step, profile, course: &course, begin, counts: 0..0 };
                let found = go([(member, None)], begin..begin + 2501)?;
                let worst = worst(&found[0].0, &expected);
                assert!(worst <= error * expected[0], "{worst} N, {interpolation:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn changes_of_speed_are_followed_exactly() -> Result<()> {
        let (x, z) = rough();
        let profile = Profile::new(&x, &z, Interpolation::Linear)?;
        let vehicle = truck(0.0, None)?;
        let step = Step::new(&vehicle, DT, Interpolation::Linear)?;
        let course = course(0.3333, 2.0, &STOPS)?;
        let begin = course.first_tick(4.0);
        let ticks = begin..begin + 3000;
        let member =
            Member { step: &step, profile: Some(&profile), course: &course, begin, counts: 0..0 };
        let found = go([(member, None)], ticks.clone())?;
        let mut expected = propagated(&vehicle, &profile, &course, ticks);
        // It starts at rest at the level of the first sample, as the reference does.
        let scale = vehicle.static_loads()[0];
        let swing = expected.iter().map(|force| (force - scale).abs()).fold(0.0, f64::max);
        assert!(swing > 0.3 * scale, "the road is felt");
        assert!(worst(&found[0].0, &expected) < 1e-8 * scale);
        expected[4000] += 1e-3;
        assert!(worst(&found[0].0, &expected) > 1e-8 * scale);
        Ok(())
    }

    /// Whole numbers that look random, from 0 to below a bound.
    struct Dice(u64);

    impl Dice {
        fn below(&mut self, bound: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 33) as usize % bound
        }
    }

    #[test]
    fn a_run_cut_and_packed_anew_is_the_same_to_the_last_bit() -> Result<()> {
        let (x, z) = rough();
        let ways = [Interpolation::Linear, Interpolation::Staircase];
        let profiles = [Profile::new(&x, &z, ways[0])?, Profile::new(&x, &z, ways[1])?];
        let vehicles = [truck(0.0, None)?, truck(6e3, None)?];
        let mut steps = Vec::new();
        for (vehicle, way) in vehicles.iter().flat_map(|vehicle| ways.map(|way| (vehicle, way))) {
            steps.push(Step::new(vehicle, DT, way)?);
        }
        let count = 11;
        let mut courses = Vec::new();
        for i in 0..count {
            let mut pieces = STOPS.map(|(lasts, speed)| (lasts, speed + 0.3 * i as f64));
            pieces[2].1 = 0.0;
            // One a tick before another, and one with several changes within a step.
            pieces[3].0 = [0.2002, 1e-3, 2e-4][i % 3];
            courses.push(course(0.1 * i as f64, 5.0, &pieces)?);
        }
        let member = |i: usize| Member {
            step: &steps[i % 4],
            profile: (i % 5 != 4).then_some(&profiles[i % 2]),
            course: &courses[i],
            begin: courses[i].first_tick(3.0),
            counts: 300..2200 + i as i64,
        };
        let (first, last) = (-400, 2700);
        let mut whole = Vec::new();
        for i in 0..count {
            whole.extend(go([(member(i), None)], first..last)?);
        }
        for seed in 0..20 {
            let mut dice = Dice(seed);
            let mut forces = vec![Vec::new(); count];
            let mut states: Vec<Option<Vec<f64>>> = vec![None; count];
            let mut tick = first;
            while tick < last {
                let end = (tick + 1 + dice.below(if seed < 2 { 3 } else { 500 }) as i64).min(last);
                let mut order: Vec<usize> = (0..count).collect();
                order.sort_by_key(|_| dice.below(1 << 20));
                while !order.is_empty() {
                    let group =
                        order.split_off(order.len() - 1 - dice.below(lanes().min(order.len())));
                    let members = group.iter().map(|&i| (member(i), states[i].as_deref()));
                    for (&i, (found, state)) in group.iter().zip(go(members, tick..end)?) {
                        forces[i].extend(found);
                        states[i] = Some(state);
                    }
                }
                tick = end;
            }
            for i in 0..count {
                let same = forces[i] == whole[i].0 && states[i].as_ref() == Some(&whole[i].1);
                assert!(same, "vehicle {i}, seed {seed}");
            }
        }
        Ok(())
    }

    #[test]
    fn a_tally_is_what_the_forces_say() -> Result<()> {
        let (x, z) = rough();
        let profile = Profile::new(&x, &z, Interpolation::Linear)?;
        let vehicle = truck(0.0, None)?;
        let step = Step::new(&vehicle, DT, Interpolation::Linear)?;
        let course = course(0.0, 0.0, &STOPS)?;
        for profile in [Some(&profile), None] {
            let counts = 450..2000;
            let at = counts.clone();
            let member = Member { step: &step, profile, course: &course, begin: -50, counts };
            let found = go([(member.clone(), None)], -50..450)?;
            assert_eq!(step.tally(&found[0].1), None);
            let found = go([(member, None)], -50..2500)?;
            let rows: Vec<_> = found[0].0.chunks_exact(3).collect();
            let rows = &rows[500..2050];
            let tally = step.tally(&found[0].1).unwrap_or_else(|| unreachable!("ticks counted"));
            assert_eq!(tally.instants, 1550);
            for (axle, found) in tally.axles.iter().enumerate() {
                let forces = || rows.iter().map(|row| row[axle]);
                let mean = forces().sum::<f64>() / 1550.0;
                let square = forces().map(|force| (force - mean).powi(2)).sum::<f64>() / 1550.0;
                assert!((found.mean - mean).abs() < 1e-9 * mean);
                assert!((found.deviation - square.sqrt()).abs() < 1e-9 * mean);
                assert_eq!(found.lowest, forces().fold(f64::INFINITY, f64::min));
                assert_eq!(found.highest, forces().fold(f64::NEG_INFINITY, f64::max));
                assert_eq!(found.airborne, forces().filter(|force| *force <= 0.0).count());
            }
            let largest = rows.iter().flat_map(|row| row.iter().copied()).fold(0.0, f64::max);
            assert_eq!(tally.largest, largest);
            let row = (tally.tick - at.start) as usize;
            assert_eq!(rows[row][tally.axle], largest);
            let before = rows[..row].iter().flat_map(|row| row.iter().copied());
            assert!(before.fold(0.0, f64::max) < largest);
        }
        Ok(())
    }

    /// It stands for 30 s: the forces become those of `K z = sum_i k_i r_i u_i`, which carry its weight.
    #[test]
    fn a_vehicle_that_stands_comes_to_rest() -> Result<()> {
        let (x, z) = rough();
        let vehicle = truck(0.0, None)?;
        for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
            let profile = Profile::new(&x, &z, interpolation)?;
            let step = Step::new(&vehicle, DT, interpolation)?;
            let course = course(0.0, 10.0, &[(1.00037, 14.0), (31.0, 0.0)])?;
            let (profile, counts) = (Some(&profile), 0..0);
            let member = Member { step: &step, profile, course: &course, begin: 0, counts };
            let found = go([(member, None)], 0..31_000)?;
            let mut right = DVector::zeros(vehicle.system().len());
            let mut elevations = Vec::new();
            for (tire, row) in vehicle.tires.iter().zip(&vehicle.rows) {
                let place = 10.0 + 14.0 * 1.00037 - tire.point.x;
                let touch = Wheel::new(profile.unwrap_or_else(|| unreachable!()), tire.print);
                let elevation = { touch }.touch(place, 0.0).elevation;
                right += row * (tire.stiffness * elevation);
                elevations.push(elevation);
            }
            let stiffness = vehicle.system().stiffness.to_dense();
            let heights = stiffness.lu().solve(&right).unwrap_or_default();
            let last = &found[0].0[3 * 30_999..];
            for (i, (tire, row)) in vehicle.tires.iter().zip(&vehicle.rows).enumerate() {
                let lift = tire.stiffness * (elevations[i] - row.dot(&heights));
                let load = vehicle.static_loads()[i];
                assert!(lift.abs() > 1e-3 * load, "the road is uneven");
                assert!((last[i] - load - lift).abs() < 1e-7 * load, "{interpolation:?}");
            }
            let weight = vehicle.static_loads().iter().sum::<f64>();
            assert!((last.iter().sum::<f64>() - weight).abs() < 1e-9 * weight);
        }
        Ok(())
    }

    #[test]
    fn a_vehicle_presses_with_its_static_loads_until_it_begins() -> Result<()> {
        let (x, z) = rough();
        let profile = Profile::new(&x, &z, Interpolation::Linear)?;
        let vehicle = truck(0.0, None)?;
        let step = Step::new(&vehicle, DT, Interpolation::Linear)?;
        let courses = [course(0.0, 0.0, &[(1.0, 20.0)])?, course(0.6, 7.0, &[(1.0, 12.0)])?];
        let member = |i: usize| {
            let (profile, course, begin) = (Some(&profile), &courses[i], 600 * i as i64);
            Member { step: &step, profile, course, begin, counts: 0..0 }
        };
        let alone = [go([(member(0), None)], 0..1000)?, go([(member(1), None)], 600..1000)?];
        let found = if lanes() == 1 {
            [go([(member(0), None)], 0..1000)?, go([(member(1), None)], 0..1000)?].concat()
        } else {
            go([(member(0), None), (member(1), None)], 0..1000)?
        };
        assert!(found[0].0 == alone[0][0].0);
        let (before, after) = found[1].0.split_at(1800);
        assert!(before.chunks_exact(3).all(|row| row == vehicle.static_loads()));
        assert!(after == alone[1][0].0);
        Ok(())
    }

    #[test]
    fn dry_friction_is_refused() -> Result<()> {
        let vehicle = truck(0.0, Some(Friction { force: 3e3, travel: 1e-3 }))?;
        let refused = Step::new(&vehicle, DT, Interpolation::Linear);
        assert!(matches!(refused, Err(Error::Invalid { name, .. }) if name == "vehicle"));
        Ok(())
    }
}
