//! Vehicles that are stepped together for some ticks, each on its own window of pavement.
//!
//! Windows in which others of the same lane are too are added before an extreme is noted: each note is
//! of the deflection of a node, which moves with it, and of what others make of it. The sum at a tick
//! is complete when all have taken the step to it. It is therefore noted a tick later.

use std::marker::PhantomData;
use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::events::{Crossing, Event, Events};
use super::model::{Model, Passage};
use crate::error::{Result, diverged};
use crate::pavement::Mesh;
use crate::pavement::load::TRACK_SHARE;
use crate::response::Hold;
use crate::response::sdirk::{Noted, Notes, Number, STAGES, Windows};
use crate::response::window::first_before;
use crate::vehicle::course::Course;

/// A vehicle on the pavement, as it is between two packings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OnRoad {
    pub(super) passage: usize,
    /// First node of its window, and how many there are.
    pub(super) first: usize,
    pub(super) nodes: usize,
    /// What moves with the nodes.
    pub(super) motion: Vec<f64>,
    pub(super) axles: Vec<Axle>,
    /// Forces of the axles a tick ago and at the last tick, N.
    pub(super) forces: Vec<[f64; 2]>,
    /// The first node that is not the follower's.
    pub(super) given: usize,
    /// The tick from which on it loads the lane, and the last one at which a step under load ended.
    pub(super) start: i64,
    pub(super) loaded: i64,
    /// Whether it had come onto the lane before its pavement began to move.
    pub(super) late: bool,
    /// Whether nothing more comes of it.
    pub(super) finished: bool,
}

/// An axle and the nodes near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axle {
    /// How far behind the front axle it is, m.
    pub(super) behind: f64,
    /// The first node that is not nearer to the next axle, or has been left by all.
    pub(super) left: usize,
    /// The first node that it has not reached yet.
    pub(super) reached: usize,
    /// The nodes that it reaches at ticks that count.
    pub(super) from: usize,
    pub(super) to: usize,
}

impl Axle {
    /// Whether its pass of a node counts.
    fn counts(&self, node: usize) -> bool {
        (self.from..self.reached.min(self.to)).contains(&node)
    }
}

/// How near a node an axle counts as at it, m.
const NEAR: f64 = 1e-9;

impl OnRoad {
    /// At rest, at the tick at which its pavement begins to move.
    pub(super) fn new(
        model: &Model,
        number: usize,
        (tick, late): (i64, bool),
        nodes: usize,
    ) -> Self {
        let (passage, course) = (&model.inputs.passages[number], &model.courses[number]);
        let vehicle = &model.inputs.vehicles[passage.vehicle];
        let mesh = model.geometry(model.inputs.lanes[passage.lane].road);
        let place = course.place(tick);
        let offsets: Vec<f64> = vehicle.axle_places().collect();
        let start = place - vehicle.length() - model.reaches[number].behind;
        let first = first_before(mesh, start.max(0.0), nodes, 0);
        // At a node but for rounding is at the node.
        let ahead = |x: f64| mesh.nodes().partition_point(|node| *node < x - NEAR);
        let axle = |(number, &behind): (usize, &f64)| {
            let next = offsets.get(number + 1);
            let left = next.map_or(first, |next| ahead(place - 0.5 * (behind + next)).max(first));
            let reached = ahead(place - behind);
            let counts = model.inputs.outcome.ticks.start <= tick;
            let from = if counts && !late { reached } else { usize::MAX };
            Axle { behind, left, reached, from, to: usize::MAX }
        };
        Self {
            passage: number,
            first,
            nodes,
            motion: Vec::new(),
            axles: offsets.iter().enumerate().map(axle).collect(),
            forces: vehicle.static_loads().iter().map(|&load| [load; 2]).collect(),
            given: first,
            start: tick,
            loaded: tick,
            late,
            finished: false,
        }
    }

    /// Whether a node that one of its axles has reached at a tick that counts is not left yet.
    pub(super) fn is_awaited(&self) -> bool {
        self.axles.iter().any(|axle| axle.left.max(axle.from) < axle.reached.min(axle.to))
    }
}

/// Forces of a vehicle's axles at the ticks after the first, N.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forces<'a> {
    pub(super) values: &'a [f64],
    pub(super) lanes: usize,
    pub(super) lane: usize,
    pub(super) axles: usize,
}

impl Forces<'_> {
    #[inline(always)]
    fn at(&self, row: usize, axle: usize) -> f64 {
        self.values[(row * self.axles + axle) * self.lanes + self.lane]
    }
}

/// A vehicle and what it meets.
pub(super) struct Member<'a> {
    pub(super) on: OnRoad,
    /// None for static loads.
    pub(super) forces: Option<Forces<'a>>,
    /// How far behind the axles its window goes, m.
    pub(super) behind: f64,
    /// Ticks that the pavement remembers.
    pub(super) memory: i64,
    /// Number of its cluster.
    pub(super) cluster: usize,
}

/// What came of some ticks.
pub(super) struct Done {
    pub(super) members: Vec<OnRoad>,
    pub(super) events: Events,
    /// A row of the stations' deflections for each tick, if there are any.
    pub(super) history: Vec<f64>,
}

/// Members of a gang, those of a cluster from the front to the back, and the ticks to take.
pub(super) struct Walk<'a, R> {
    model: &'a Model,
    members: Vec<Member<'a>>,
    nodes: usize,
    ticks: Range<i64>,
    number: PhantomData<R>,
}

impl<'a, R> Walk<'a, R> {
    pub(super) fn new(
        model: &'a Model,
        members: Vec<Member<'a>>,
        nodes: usize,
        ticks: Range<i64>,
    ) -> Self {
        Self { model, members, nodes, ticks, number: PhantomData }
    }
}

impl<R: Number> WithSimd for Walk<'_, R> {
    type Output = Result<Done>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { model, members, nodes, ticks, .. } = self;
        let lanes = R::lanes(simd);
        let columns = model.inputs.outcome.stations.len();
        let mut history = vec![0.0; columns * (ticks.end - ticks.start) as usize];
        let mut walkers = Vec::with_capacity(members.len());
        let mut vectors: Vec<Windows<R>> = Vec::with_capacity(members.len().div_ceil(lanes));
        let memories: Vec<i64> = members.iter().map(|member| member.memory).collect();
        for (number, member) in members.into_iter().enumerate() {
            if number % lanes == 0 {
                vectors.push(Windows::new(nodes, lanes, model.dt(), Notes::Crowd));
            }
            let windows = &mut vectors[number / lanes];
            walkers.push(Walker::new(model, member, number % lanes, windows, ticks.start)?);
        }
        let pairs = pairs(&walkers);
        let mut events = Events::default();
        for tick in ticks.clone() {
            let row = (tick - ticks.start) as usize;
            for windows in &mut vectors {
                windows.begin(row, model.inputs.scheme.hold == Hold::First);
            }
            for number in 0..walkers.len() {
                let (ahead, rest) = walkers.split_at_mut(number + 1);
                let walker = &mut ahead[number];
                let follower = rest.first_mut().filter(|next| next.cluster == walker.cluster);
                let at = number / lanes;
                walker.leave(
                    &mut vectors,
                    at,
                    follower.map(|next| (&*next, (number + 1) / lanes)),
                    &mut events,
                );
                walker.go(model, &mut vectors[at], row, tick, &mut events)?;
            }
            if !pairs.is_empty() {
                exchange(&mut walkers, &mut vectors, lanes, &pairs);
            }
            if columns > 0 {
                let sums = &mut history[row * columns..][..columns];
                for (number, walker) in walkers.iter().enumerate() {
                    walker.read(model, &vectors[number / lanes], sums);
                }
            }
            for windows in &mut vectors {
                windows.step(simd);
            }
        }
        if !vectors.iter().all(Windows::is_sound) {
            return Err(diverged("deflection", ticks.end.max(0) as usize, model.dt()));
        }
        let stop = |(number, (walker, memory)): (usize, (Walker<'_>, i64))| {
            walker.stop(model, &mut vectors[number / lanes], ticks.end, memory, &mut events)
        };
        let members = walkers.into_iter().zip(memories).enumerate().map(stop).collect();
        Ok(Done { members, events, history })
    }
}

/// A member on its way.
struct Walker<'a> {
    on: OnRoad,
    passage: &'a Passage,
    course: &'a Course,
    forces: Option<Forces<'a>>,
    cluster: usize,
    behind: f64,
    nodes: usize,
    /// The lane of its vector.
    lane: usize,
    mesh: Mesh,
    /// The piece of the course that the stiffness is of.
    piece: usize,
    /// Place of the front axle a tick ago, now, and a tick later, m.
    places: [f64; 3],
    /// Of each axle.
    cursors: Vec<Cursor>,
    /// The last tick at which it loads the lane.
    until: i64,
    /// Nodes at which others are.
    met: Range<usize>,
    /// The tick that notes count from.
    epoch: f64,
}

/// Where an axle is in the mesh, and its forces, N.
#[derive(Debug, Clone, Copy)]
struct Cursor {
    /// Places of the nodes `left` and `reached` of the axle, m.
    left: f64,
    reached: f64,
    /// The element that it is on, and its ends, m.
    element: usize,
    start: f64,
    end: f64,
    /// Forces of a tick ago, now, and a tick later.
    forces: [f64; 3],
}

impl<'a> Walker<'a> {
    fn new<R: Number>(
        model: &'a Model,
        Member { mut on, forces, behind, cluster, .. }: Member<'a>,
        lane: usize,
        windows: &mut Windows<R>,
        tick: i64,
    ) -> Result<Self> {
        let (passage, course) = (&model.inputs.passages[on.passage], &model.courses[on.passage]);
        let piece = course.number(tick);
        let mesh = model.mesh(passage, passage.classes[piece])?;
        let place_of = |node: usize| place_of(&mesh, node);
        let (before, now) = (course.place(tick - 1), course.place(tick));
        let cursor = |(axle, &[before, force]): (&Axle, &[f64; 2])| {
            let element = mesh.place(now - axle.behind).map_or(0, |place| place.element);
            Cursor {
                left: place_of(axle.left),
                reached: place_of(axle.reached),
                element,
                start: mesh.node(element),
                end: mesh.node(element + 1),
                forces: [before, before, force],
            }
        };
        let cursors = on.axles.iter().zip(&on.forces).map(cursor).collect();
        // A longer window near the road's end begins at nodes that have been left.
        let first = on.first.min(mesh.len() - windows.len());
        windows.fill(lane, &mesh, first);
        windows.put(lane, on.first - first, &on.motion);
        on.first = first;
        let until = (passage.until / model.dt() * (1.0 + 1e-12)).floor() as i64; // saturates
        let nodes = windows.len();
        let (places, met) = ([before, before, now], 0..0);
        Ok(Self {
            on,
            passage,
            course,
            forces,
            cluster,
            behind,
            nodes,
            lane,
            mesh,
            piece,
            places,
            cursors,
            until,
            met,
            epoch: tick as f64,
        })
    }

    /// Hand over what was noted at the nodes that the places of the last tick leave behind.
    #[inline(always)]
    fn leave<R: Number>(
        &mut self,
        vectors: &mut [Windows<R>],
        at: usize,
        follower: Option<(&Walker<'_>, usize)>,
        events: &mut Events,
    ) {
        let front = self.places[1];
        let windows = &mut vectors[at];
        let last = self.on.axles.len() - 1;
        for number in 0..last {
            let [axle, next] = [number, number + 1].map(|number| self.on.axles[number].behind);
            let middle = front - 0.5 * (axle + next);
            while self.cursors[number].left < middle {
                let node = self.on.axles[number].left;
                let passed = self.taken(windows, node);
                self.hand_over(number, passed, events);
            }
        }
        if let Some((follower, other)) = follower {
            let rear = front - self.on.axles[last].behind;
            let middle = 0.5 * (rear + follower.places[1]);
            let reach = follower.on.first + follower.nodes;
            // Who drives through the one ahead leaves it the nodes that its axle has not reached.
            let reach = reach.min(self.on.axles[last].reached);
            while self.cursors[last].left < middle && self.on.axles[last].left < reach {
                let node = self.on.axles[last].left;
                let passed = self.taken(&mut vectors[at], node);
                self.hand_over(last, passed, events);
                // Who may not have seen it before.
                if let (Some(here), Some(there)) = (self.inside(node), follower.inside(node)) {
                    let past = vectors[at].past(self.lane, here);
                    vectors[other].set_past(follower.lane, there, past);
                }
            }
            // What is left, by whatever way, is the follower's from now on.
            for node in self.on.given..self.on.axles[last].left {
                follower.taken(&mut vectors[other], node);
            }
        }
        self.on.given = self.on.axles[last].left;
    }

    /// What was noted of a node since this was last asked.
    #[inline(always)]
    fn taken<R: Number>(&self, windows: &mut Windows<R>, node: usize) -> Noted {
        self.inside(node).map_or_else(Noted::default, |at| windows.take(self.lane, at))
    }

    #[inline(always)]
    fn inside(&self, node: usize) -> Option<usize> {
        node.checked_sub(self.on.first).filter(|at| *at < self.nodes)
    }

    /// An axle has left its next node.
    fn hand_over(&mut self, number: usize, passed: Noted, events: &mut Events) {
        let axle = &mut self.on.axles[number];
        let (node, counts) = (axle.left, axle.counts(axle.left));
        axle.left += 1;
        self.cursors[number].left = place_of(&self.mesh, axle.left);
        // What was before a late one began is not all that was.
        let known = !self.on.late || node >= axle.from;
        let passed = Noted { when: passed.when + self.epoch, ..passed };
        if counts || known && (passed.lowest != 0.0 || passed.highest != 0.0) {
            events.passes.push(Event { passage: self.on.passage, node, passed, counts });
        }
    }

    /// Go on to a tick, and put the forces of the step that begins there on the nodes.
    #[inline(always)]
    fn go<R: Number>(
        &mut self,
        model: &Model,
        windows: &mut Windows<R>,
        row: usize,
        tick: i64,
        events: &mut Events,
    ) -> Result<()> {
        self.places = [self.places[1], self.places[2], self.course.place(tick + 1)];
        let piece = self.course.number(tick);
        if piece != self.piece {
            if self.passage.classes[piece] != self.passage.classes[self.piece] {
                self.mesh = model.mesh(self.passage, self.passage.classes[piece])?;
                windows.forget(self.lane);
                windows.fill(self.lane, &self.mesh, self.on.first);
            }
            self.piece = piece;
        }
        for (number, cursor) in self.cursors.iter_mut().enumerate() {
            let [_, now, next] = cursor.forces;
            let force = self.forces.map_or(next, |forces| forces.at(row, number));
            cursor.forces = [now, next, force];
        }
        self.move_window(windows, events);
        self.reach(model, tick, events);
        if (self.on.start..self.until).contains(&tick) {
            let loads = self.load(model, windows);
            if loads {
                self.on.loaded = tick + 1;
            }
        }
        Ok(())
    }

    /// Let the window follow the last axle.
    #[inline(always)]
    fn move_window<R: Number>(&mut self, windows: &mut Windows<R>, events: &mut Events) {
        let last = self.on.axles.len() - 1;
        let start = self.places[1] - self.on.axles[last].behind - self.behind;
        let first = first_before(&self.mesh, start.max(0.0), self.nodes, self.on.first);
        while self.on.first < first {
            let passed = windows.shift(self.lane);
            if self.on.axles[last].left == self.on.first {
                self.hand_over(last, passed, events);
            }
            self.on.first += 1;
            windows.fill(self.lane, &self.mesh, self.on.first);
        }
    }

    /// Note which nodes the axles have reached, and with what force.
    #[inline(always)]
    fn reach(&mut self, model: &Model, tick: i64, events: &mut Events) {
        let ticks = &model.inputs.outcome.ticks;
        let [before, now, _] = self.places;
        let share = TRACK_SHARE * self.passage.share;
        for (axle, cursor) in self.on.axles.iter_mut().zip(&mut self.cursors) {
            // Ticks come one by one, but a run may begin after these.
            if tick >= ticks.start && axle.from == usize::MAX {
                axle.from = axle.reached;
            }
            if tick >= ticks.end && axle.to == usize::MAX {
                axle.to = axle.reached;
            }
            while cursor.reached <= now - axle.behind {
                if tick <= self.until && ticks.contains(&tick) {
                    let part = (cursor.reached + axle.behind - before) / (now - before);
                    let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 1.0 };
                    let force = cursor.forces[0] + part * (cursor.forces[1] - cursor.forces[0]);
                    let (passage, node) = (self.on.passage, axle.reached);
                    events.crossings.push(Crossing { passage, node, force: share * force });
                } else if tick > self.until && axle.to == usize::MAX {
                    axle.to = axle.reached;
                }
                axle.reached += 1;
                cursor.reached = place_of(&self.mesh, axle.reached);
            }
        }
    }

    /// Put the axles on the nodes; whether any of them loads the road.
    #[inline(always)]
    fn load<R: Number>(&mut self, model: &Model, windows: &mut Windows<R>) -> bool {
        let scheme = &model.inputs.scheme;
        let taken: &[(f64, &[usize])] = match scheme.hold {
            Hold::Zero => &[(0.0, &[0, 1])],
            Hold::First => &[(STAGES[0], &[0]), (STAGES[1], &[1])],
        };
        let share = -TRACK_SHARE * self.passage.share;
        let [_, now, next] = self.places;
        let mut loads = false;
        for (axle, cursor) in self.on.axles.iter().zip(&mut self.cursors) {
            for &(part, stages) in taken {
                let x = now + part * (next - now) - axle.behind;
                let force =
                    share * (cursor.forces[1] + part * (cursor.forces[2] - cursor.forces[1]));
                let mut put = |element: usize, weights: [f64; 4]| {
                    loads = true;
                    let Some(node) = element.checked_sub(self.on.first) else { return };
                    if node + 1 >= self.nodes {
                        return;
                    }
                    let at_end = element == 0 || element + 1 == self.mesh.elements();
                    for (k, weight) in weights.into_iter().enumerate() {
                        if weight != 0.0 && !(at_end && self.mesh.holds(2 * element + k)) {
                            for &stage in stages {
                                windows.load(
                                    stage,
                                    self.lane,
                                    (node + k / 2, k % 2),
                                    weight * force,
                                );
                            }
                        }
                    }
                };
                if scheme.contact.print == 0.0 {
                    cursor.go_to(x, &self.mesh);
                    if x >= cursor.start && x <= cursor.end {
                        let h = cursor.end - cursor.start;
                        put(cursor.element, scheme.contact.weights.at(h, (x - cursor.start) / h));
                    }
                } else {
                    scheme.contact.share(&self.mesh, x, put);
                }
            }
        }
        loads
    }

    /// Add the deflection now to the stations that its window holds.
    fn read<R: Number>(&self, model: &Model, windows: &Windows<R>, row: &mut [f64]) {
        let first = self.on.first;
        for station in model.stations.iter().filter(|station| station.lane == self.passage.lane) {
            if station.last >= first && station.last < first + self.nodes + 2 {
                let motion = |node: usize| {
                    self.inside(node).map_or([[0.0; 2]; 2], |at| windows.motion(self.lane, at))
                };
                row[station.column] += station.reading.of(motion);
            }
        }
    }

    /// Hand over how it stands at a tick; if nothing more comes of it, what is noted, too.
    fn stop<R: Number>(
        mut self,
        model: &Model,
        windows: &mut Windows<R>,
        tick: i64,
        memory: i64,
        events: &mut Events,
    ) -> OnRoad {
        let road = model.inputs.lanes[self.passage.lane].road;
        let last = self.on.axles.len() - 1;
        let rear = self.places[2] - self.on.axles[last].behind;
        let gone =
            rear > self.mesh.length() + model.inputs.scheme.contact.print || tick >= self.until;
        let past = self.on.first >= model.counted[road].end;
        self.on.finished = gone && tick > self.on.loaded + memory || past;
        if self.on.finished {
            for number in (0..=last).rev() {
                let ahead = number.checked_sub(1).map(|next| self.on.axles[next].left);
                let end = ahead.unwrap_or(self.on.first + self.nodes);
                while self.on.axles[number].left < end {
                    let passed = self.taken(windows, self.on.axles[number].left);
                    self.hand_over(number, passed, events);
                }
            }
        } else {
            self.on.motion = windows.moving(self.lane, tick as f64 - self.epoch);
            self.on.nodes = self.nodes;
        }
        let forces = self.cursors.iter().map(|cursor| [cursor.forces[1], cursor.forces[2]]);
        self.on.forces = forces.collect();
        self.on
    }
}

impl Cursor {
    /// Go forward to the element that holds a place.
    #[inline(always)]
    fn go_to(&mut self, x: f64, mesh: &Mesh) {
        while x >= self.end && self.element + 1 < mesh.elements() {
            self.element += 1;
            self.start = self.end;
            self.end = mesh.node(self.element + 1);
        }
    }
}

/// Place of a node, m; of one that is not there, infinitely far ahead.
fn place_of(mesh: &Mesh, node: usize) -> f64 {
    if node < mesh.len() { mesh.node(node) } else { f64::INFINITY }
}

/// Members of one cluster, two by two.
fn pairs(walkers: &[Walker<'_>]) -> Vec<[usize; 2]> {
    let all = |a: usize| (a + 1..walkers.len()).map(move |b| [a, b]);
    let same = |[a, b]: &[usize; 2]| walkers[*a].cluster == walkers[*b].cluster;
    (0..walkers.len()).flat_map(all).filter(same).collect()
}

/// Tell each window what others make of its nodes.
fn exchange<R: Number>(
    walkers: &mut [Walker<'_>],
    vectors: &mut [Windows<R>],
    lanes: usize,
    pairs: &[[usize; 2]],
) {
    for (number, walker) in walkers.iter_mut().enumerate() {
        for node in std::mem::take(&mut walker.met) {
            if let Some(at) = walker.inside(node) {
                vectors[number / lanes].clear_others(walker.lane, at);
            }
        }
    }
    for &[a, b] in pairs {
        let first = walkers[a].on.first.max(walkers[b].on.first);
        let end = |number: usize| walkers[number].on.first + walkers[number].nodes;
        let met = first..end(a).min(end(b));
        if met.is_empty() {
            continue;
        }
        for [to, from] in [[a, b], [b, a]] {
            for node in met.clone() {
                let [there, here] = [from, to].map(|number| node - walkers[number].on.first);
                let theirs = vectors[from / lanes].own(walkers[from].lane, there);
                vectors[to / lanes].add_others(walkers[to].lane, here, theirs);
            }
            let walker = &mut walkers[to];
            walker.met = if walker.met.is_empty() {
                met.clone()
            } else {
                walker.met.start.min(met.start)..walker.met.end.max(met.end)
            };
        }
    }
}
