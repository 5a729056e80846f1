//! Traffic: thousands of vehicles on a road, each on its own window of pavement.
//!
//! Lanes of a road are strips that do not touch. In a lane, deflections of vehicles that share pavement
//! are added, each with the stiffness that the asphalt has at that vehicle's speed: exactly the answer
//! of the road where these are equal, and a rule of this package where they are not.
//!
//! Time goes in ticks of `dt` that are the same for all, and in [`INTERVAL`]s of these. For each interval,
//! vehicles of a kind first find their forces, side by side in the lanes of a vector, and then windows of
//! pavement are stepped, those that meet in one gang. What has happened is added up in the order of the gangs,
//! so that the number of threads changes nothing.

mod events;
mod gang;
mod model;
mod pack;
mod rolling;
mod state;

use std::num::NonZero;
use std::ops::Range;

use pulp::Arch;

pub use crate::vehicle::course::Break;
pub use events::{Ride, Totals, Worst};
pub use model::{
    Carriageway, Discretisation, Inputs, Lane, Outcome, Passage, Precision, Surface, TOLERANCE,
};

use self::gang::{Done, Member, OnRoad, Walk};
use self::model::Model;
use self::pack::{Candidate, Gang, pack};
use self::rolling::{Rolled, roll};
use super::window::nodes_over;
use crate::error::Result;
use crate::lanes::lanes;
use crate::threads::in_order;

/// Ticks between two packings.
pub const INTERVAL: i64 = 256;

/// Instants at which windows are looked at for whether they meet, in ticks.
const LOOK: usize = 32;

/// Room between windows that do not meet, m: how far two may come nearer between two looks.
const ROOM: f64 = 1.0;

/// A vehicle that is somewhere on its way.
#[derive(Debug, Clone, PartialEq)]
struct Active {
    passage: usize,
    begin: Begin,
    /// How its bodies move, if they do.
    vehicle: Option<Vec<f64>>,
    /// The pavement under it, once that moves.
    on: Option<OnRoad>,
}

/// When a passage begins.
#[derive(Debug, Clone, PartialEq)]
struct Begin {
    /// The tick at which its vehicle starts to roll.
    rolls: i64,
    /// The tick at which its pavement begins to move, and whether it had come onto the lane before.
    moves: i64,
    late: bool,
    /// Ticks whose forces count.
    counts: Range<i64>,
}

/// A run of traffic.
pub struct Traffic {
    model: Model,
    threads: NonZero<usize>,
    begins: Vec<Begin>,
    /// Passages in the order in which they begin, and how many have.
    order: Vec<usize>,
    begun: usize,
    tick: i64,
    active: Vec<Active>,
    totals: Vec<Totals>,
    worst: Vec<Worst>,
    rides: Vec<Option<Ride>>,
    /// Ticks that vehicles on the pavement have gone.
    steps: u64,
}

impl Traffic {
    /// At the beginning.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for an input out of range, a vehicle that is not
    /// linear, or a pavement that does not forget.
    pub fn new(inputs: Inputs, threads: NonZero<usize>) -> Result<Self> {
        let model = Model::new(inputs)?;
        let passages = 0..model.inputs.passages.len();
        let begins: Vec<Begin> = passages.map(|number| Begin::of(&model, number)).collect();
        let mut order: Vec<usize> = (0..begins.len()).collect();
        // What has left before anything counts is left out.
        order.retain(|&number| begins[number].counts.end >= begins[number].moves);
        order.sort_by_key(|&number| (begins[number].rolls, number));
        let first = order.first().map_or(0, |&number| begins[number].rolls.min(0) - 1);
        let totals = |_: &Lane| Totals::new(model.len(), &model.inputs.outcome);
        Ok(Self {
            threads,
            order,
            begun: 0,
            tick: first.div_euclid(INTERVAL) * INTERVAL,
            active: Vec::new(),
            totals: model.inputs.lanes.iter().map(totals).collect(),
            worst: vec![Worst::NONE; begins.len()],
            rides: vec![None; begins.len()],
            steps: 0,
            begins,
            model,
        })
    }

    /// Places of the nodes of the first carriageway, m.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        self.model.geometry(0).nodes()
    }

    /// The tick that the next step begins at: below 0 while vehicles only roll in.
    #[must_use]
    pub fn tick(&self) -> i64 {
        self.tick
    }

    /// Whether nothing more comes.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        // All go on while a node that counts is not left: they share pavement.
        let awaited = |active: &Active| active.on.as_ref().is_some_and(OnRoad::is_awaited);
        let over = self.tick >= self.model.inputs.outcome.ticks.end;
        over && !self.active.iter().any(awaited)
            || self.begun == self.order.len() && self.active.is_empty()
    }

    /// Vehicles whose pavement moves.
    #[must_use]
    pub fn active(&self) -> usize {
        self.active.iter().filter(|active| active.on.is_some()).count()
    }

    /// Seconds that vehicles have been on the pavement, all together.
    #[must_use]
    pub fn vehicle_seconds(&self) -> f64 {
        self.steps as f64 * self.model.dt()
    }

    /// Time step, s.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.model.dt()
    }

    /// What is kept.
    #[must_use]
    pub fn outcome(&self) -> &Outcome {
        &self.model.inputs.outcome
    }

    /// What all passes have come to, lane by lane.
    #[must_use]
    pub fn totals(&self) -> &[Totals] {
        &self.totals
    }

    /// What each vehicle did at worst.
    #[must_use]
    pub fn worst(&self) -> &[Worst] {
        &self.worst
    }

    /// What the tire forces of each passage came to, of those that are over.
    #[must_use]
    pub fn rides(&self) -> &[Option<Ride>] {
        &self.rides
    }

    /// The ticks at which each passage is on its lane.
    pub fn stays(&self) -> impl Iterator<Item = Range<i64>> {
        self.begins.iter().map(|begin| begin.counts.clone())
    }

    /// Go on by an [`INTERVAL`]. A row of the stations' deflections for each of its ticks.
    ///
    /// # Errors
    /// [`Error::Diverged`](crate::error::Error::Diverged).
    pub fn advance(&mut self) -> Result<Vec<f64>> {
        let ticks = self.tick..self.tick + INTERVAL;
        self.begin_rolling(&ticks);
        let rolled = roll(&self.model, &mut self.active, &ticks, self.threads)?;
        self.begin_moving(&ticks);
        let done = self.walk(&ticks, &rolled)?;
        let columns = self.model.inputs.outcome.stations.len();
        let mut history = vec![0.0; columns * INTERVAL as usize];
        for (numbers, Done { members, events, history: more }) in done {
            events.add_to(&self.model, &mut self.totals, &mut self.worst);
            history.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            self.steps += members.len() as u64 * INTERVAL as u64;
            for (number, on) in numbers.into_iter().zip(members) {
                self.active[number].on = Some(on);
            }
        }
        self.end_passages();
        self.tick = ticks.end;
        Ok(history)
    }

    /// Take in the vehicles that start to roll.
    fn begin_rolling(&mut self, ticks: &Range<i64>) {
        let due = |number: &&usize| self.begins[**number].rolls <= ticks.end;
        for &passage in self.order[self.begun..].iter().take_while(due) {
            let begin = self.begins[passage].clone();
            self.active.push(Active { passage, begin, vehicle: None, on: None });
            self.begun += 1;
        }
    }

    /// Let the pavement under a vehicle move, one tick early: so that its forces are known.
    fn begin_moving(&mut self, ticks: &Range<i64>) {
        let model = &self.model;
        for Active { passage, begin, on, .. } in &mut self.active {
            if on.is_none() && begin.moves <= ticks.end {
                let window = model.window(*passage);
                let nodes = nodes_over(model.geometry(0), window);
                *on = Some(OnRoad::new(model, *passage, (begin.moves, begin.late), nodes));
            }
        }
    }

    /// Step the pavement under all vehicles: who was in each gang, and what came of it.
    fn walk(&self, ticks: &Range<i64>, rolled: &Rolled) -> Result<Vec<(Vec<usize>, Done)>> {
        let moving = |(number, active): (usize, &Active)| {
            active.on.as_ref().map(|on| (number, self.candidate(on, ticks)))
        };
        let (numbers, candidates): (Vec<usize>, Vec<Candidate>) =
            self.active.iter().enumerate().filter_map(moving).unzip();
        let single = self.model.inputs.scheme.precision == Precision::Single;
        let [double, of_single] = lanes();
        let lanes = if single { of_single } else { double };
        let mut gangs = pack(&candidates, lanes);
        // The largest first, so that no thread is left with one at the end.
        gangs.sort_by_key(|gang| std::cmp::Reverse(gang.len()));
        let work = |gang: Gang| {
            let who: Vec<usize> = gang.members().map(|at| numbers[at]).collect();
            let nodes = gang.members().map(|at| candidates[at].nodes).max().unwrap_or(0);
            let members = gang
                .clusters
                .iter()
                .enumerate()
                .flat_map(|(cluster, members)| members.iter().map(move |&at| (cluster, at)));
            let member = |(cluster, at): (usize, usize)| {
                let number = numbers[at];
                let on = self.active[number].on.clone()?;
                let reach = self.model.reaches[on.passage];
                let forces = rolled.of(number);
                let (behind, memory) = (reach.behind, reach.memory);
                Some(Member { on, forces, behind, memory, cluster })
            };
            let members: Vec<Member<'_>> = members.filter_map(member).collect();
            let (model, ticks) = (&self.model, ticks.clone());
            let done = if single {
                Arch::new().dispatch(Walk::<f32>::new(model, members, nodes, ticks))
            } else {
                Arch::new().dispatch(Walk::<f64>::new(model, members, nodes, ticks))
            };
            done.map(|done| (who, done))
        };
        in_order(self.threads, gangs, work).into_iter().collect()
    }

    /// Where the window of a vehicle is during some ticks.
    fn candidate(&self, on: &OnRoad, ticks: &Range<i64>) -> Candidate {
        let (passage, course) =
            (&self.model.inputs.passages[on.passage], &self.model.courses[on.passage]);
        let mesh = self.model.geometry(0);
        let length = mesh.shortest() * (on.nodes - 1) as f64;
        let reach = self.model.reaches[on.passage];
        let span = self.model.inputs.vehicles[passage.vehicle].length();
        let at = |tick: i64| {
            let begin = (course.place(tick) - span - reach.behind).max(0.0);
            let begin = begin.min(mesh.length() - length);
            begin - ROOM..begin + length + ROOM
        };
        let windows = (ticks.start..ticks.end).step_by(LOOK).chain([ticks.end]).map(at).collect();
        let front = course.place(ticks.start);
        Candidate { lane: passage.lane, front, windows, nodes: on.nodes }
    }

    /// Let go of passages of which nothing more comes.
    fn end_passages(&mut self) {
        let (model, rides) = (&self.model, &mut self.rides);
        self.active.retain(|active| {
            let finished = active.on.as_ref().is_some_and(|on| on.finished);
            if finished {
                let state = active.vehicle.as_deref();
                let step = model.step(active.passage);
                let tally = step.zip(state).and_then(|(step, state)| step.tally(state));
                rides[active.passage] = tally.map(|tally| Ride::of(model, active.passage, &tally));
            }
            !finished
        });
    }
}

impl Begin {
    /// When a passage begins.
    fn of(model: &Model, number: usize) -> Self {
        let Inputs { passages, vehicles, outcome, lanes, .. } = &model.inputs;
        let (passage, course) = (&passages[number], &model.courses[number]);
        let (mesh, reach) = (model.geometry(0), model.reaches[number]);
        let dt = model.dt();
        let ticks = passage.breaks.first().map_or(0.0, |at| at.time / dt);
        // Where the road begins, the step in which it comes onto it counts too.
        let onto = passage.breaks.first().is_none_or(|at| at.place <= 0.0);
        let comes = if onto { (ticks + NEAR).floor() } else { (ticks - NEAR).ceil() } as i64;
        let leaves = course.first_from(mesh.length() + vehicles[passage.vehicle].length());
        let leaves = leaves.min((passage.until / dt).ceil() as i64);
        // So long ahead of what counts, all that comes of it begins.
        let mut moves = comes;
        if outcome.ticks.start > comes {
            let ahead = course.place(outcome.ticks.start) - model.window(number);
            let node = course.first_from(ahead).min(outcome.ticks.start);
            moves = moves.max(node - reach.memory);
        }
        let from = model.counted[lanes[passage.lane].road].start;
        if from > 0 {
            let node = course.first_from(mesh.node(from) - reach.ahead - mesh.longest());
            moves = moves.max(node.saturating_sub(reach.memory));
        }
        let rolls = course.first_tick(passage.run_in).min(comes - 1);
        Self { rolls, moves, late: moves > comes, counts: comes..leaves }
    }
}

/// How near a tick an entry counts as at it, in ticks.
const NEAR: f64 = 1e-6;
