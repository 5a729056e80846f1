//! Steps of windows of pavement, one window in each lane of a vector.
//!
//! The two-stage, stiffly accurate, L-stable method of second order with `g = 1 - 1/sqrt 2` (R.
//! Alexander, SIAM J. Numer. Anal. 14 (1977) 1006). With `h = g dt`, each stage solves for a velocity
//!
//! ```text
//! (M + h C + h^2 K) v_i = M a_i - h K b_i + h f_i
//! a_1 = v,               b_1 = u
//! a_2 = v + l (v_1 - v), b_2 = u + l h v_1,     l = (1 - g)/g
//! ```
//!
//! and the step ends at `v = v_2`, `u = b_2 + h v_2`. Beside `M v` and `h K u` of the first stage, the
//! second needs one product more, `l (M - h^2 K) v_1`. The matrices are symmetric and of 2x2 blocks,
//! one row of blocks a node, each coupled to its neighbours only: they are factored once for a
//! window's content, as `L D L'`, and a stage is one walk down the window and one back.
//!
//! Where a road is uniform, all rows are equal, and so are the factors from some node on. One row, in each
//! lane its own, then serves all nodes, and lanes of different sections and stiffness cost nothing: what a
//! step reads and writes stays in the first-level cache, or nearly so.

mod number;
mod rows;
mod step;

use std::f64::consts::FRAC_1_SQRT_2;

use pulp::Simd;

pub(crate) use number::Number;
pub(crate) use step::Notes;

use self::rows::{
    EVEN, Each, Even, FACTORS, Laned, ROWS, Rows, Shared, even, factored, lengthened,
};
use self::step::{Noting, step};
use crate::aligned::Aligned;
use crate::pavement::Mesh;

const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// How far the second stage goes on with what the first has found.
const LATE: f64 = (1.0 - GAMMA) / GAMMA;

/// Where in a step its stages stand, as parts of it.
pub(super) const STAGES: [f64; 2] = [GAMMA, 1.0];

/// Where the numbers of a node stand that move on with it. Displacement and velocity now,
const U: usize = 0;
const V: usize = 2;
/// the extremes since these were last asked, and the step of the lowest;
const LOWEST: usize = 4;
const HIGHEST: usize = 5;
const WHEN: usize = 6;
/// the deflection a step before, and two steps before;
const BEFORE: usize = 7;
const EARLIER: usize = 8;
/// the largest curvature since it was last asked, and the curvature a step before;
const BEND: usize = 9;
const OWN_BEND: usize = 10;
/// the deflection that others make of the node;
const OTHERS: usize = 11;
/// so many in all.
const MOVING: usize = 12;
/// And those of one step: the velocity of the first stage, first on its way down; what `u` and `v`
/// leave to the right-hand side of the second, and then its solution on its way down; `h f` of both
/// stages.
const FIRST: usize = 12;
const REST: usize = 14;
const LOADS: [usize; 2] = [16, 18];
const NODE: usize = 20;

/// What a window holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    /// Elements of the section of this number alone, and so on both its sides.
    Uniform(usize),
    /// The nodes from this one on.
    From(usize),
}

/// What a node has gone through for a while: extremes of its deflection, the step of the lowest, and
/// the largest curvature.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Noted {
    pub(super) lowest: f64,
    pub(super) highest: f64,
    pub(super) when: f64,
    pub(super) curvature: f64,
}

/// Windows of as many nodes each, with one node that does not move on both sides.
pub(super) struct Windows<R> {
    nodes: usize,
    lanes: usize,
    /// `h = g dt`, s.
    h: f64,
    notes: Notes,
    /// What each lane holds.
    contents: Vec<Option<Content>>,
    /// The rows of uniform lanes, for all their nodes, the factors of each, and how many of these
    /// differ; and the rows of all lanes, node by node, with those that are not up to date.
    even: Aligned<R>,
    factors: Aligned<R>,
    differing: Vec<usize>,
    laned: Aligned<R>,
    stale: Vec<bool>,
    /// One copy of the rows, where all lanes hold the same that is not uniform.
    shared: Option<Vec<[f64; ROWS]>>,
    /// The numbers of each node.
    motion: Aligned<R>,
    /// Which of them are forces that are not zero.
    loaded: Vec<usize>,
    /// 0 in the lanes that count now, infinity in the others; the step that they are at.
    shut: Vec<R>,
    now: Vec<R>,
    /// 1/8 in the lanes where extremes may now lie between steps, 0 in the others.
    sharp: Vec<R>,
}

impl<R: Number> Windows<R> {
    /// Windows of `nodes` nodes at rest, in steps of `dt`.
    pub(super) fn new(nodes: usize, lanes: usize, dt: f64, notes: Notes) -> Self {
        let per_lane = |number: f64| vec![R::of(number); lanes];
        Self {
            nodes,
            lanes,
            h: GAMMA * dt,
            notes,
            contents: vec![None; lanes],
            even: Aligned::zeros(EVEN * lanes),
            factors: Aligned::zeros((nodes + 2) * FACTORS * lanes),
            differing: vec![1; lanes],
            laned: Aligned::zeros(0),
            stale: vec![true; lanes],
            shared: None,
            motion: Aligned::zeros((nodes + 2) * NODE * lanes),
            loaded: Vec::new(),
            shut: per_lane(if notes == Notes::Crowd { 0.0 } else { f64::INFINITY }),
            now: per_lane(0.0),
            sharp: per_lane(0.0),
        }
    }

    /// Take the nodes from `first` on into a lane, unless it holds the same already.
    pub(super) fn fill(&mut self, lane: usize, mesh: &Mesh, first: usize) {
        let after = first + self.nodes;
        let inside = first > 0 && after < mesh.len();
        let uniform = inside && mesh.uniform(first - 1, after - 1);
        let content =
            if uniform { Content::Uniform(mesh.number(first)) } else { Content::From(first) };
        if self.contents[lane] == Some(content) {
            return;
        }
        self.contents[lane] = Some(content);
        self.shared = None;
        self.stale[lane] = true;
        if uniform {
            let (row, factors) = even(mesh, first, self.nodes, self.h);
            for (number, value) in row.into_iter().enumerate() {
                self.even[number * self.lanes + lane] = R::of(value);
            }
            for node in 0..self.nodes + 2 {
                let values = factors[node.min(factors.len() - 1)];
                for (number, value) in values.into_iter().enumerate() {
                    self.factors[(node * FACTORS + number) * self.lanes + lane] = R::of(value);
                }
            }
            self.differing[lane] = factors.len();
            return;
        }
        let rows = factored(mesh, first, self.nodes, self.h);
        self.write(lane, |node| rows[node]);
        // A lane without content is at rest, whatever it reads; those of a crowd have stiffnesses of
        // their own.
        let same = self.contents.iter().flatten().all(|other| *other == Content::From(first));
        self.shared = (same && self.notes != Notes::Crowd).then_some(rows);
    }

    /// The pavement of a lane is another one from now on.
    pub(super) fn forget(&mut self, lane: usize) {
        self.contents[lane] = None;
    }

    /// Write the rows of a lane, node by node.
    fn write(&mut self, lane: usize, rows: impl Fn(usize) -> [f64; ROWS]) {
        if self.laned.is_empty() {
            self.laned = Aligned::zeros((self.nodes + 2) * ROWS * self.lanes);
        }
        for node in 0..self.nodes + 2 {
            for (number, value) in rows(node).into_iter().enumerate() {
                self.laned[(node * ROWS + number) * self.lanes + lane] = R::of(value);
            }
        }
        self.stale[lane] = false;
    }

    /// Where a number of a node of a lane stands.
    fn at(&self, lane: usize, node: usize, number: usize) -> usize {
        ((node + 1) * NODE + number) * self.lanes + lane
    }

    /// Move a lane by one node: the first one leaves, the last one comes in at rest.
    pub(super) fn shift(&mut self, lane: usize) -> Noted {
        let passed = self.take(lane, 0);
        for node in 1..self.nodes {
            for number in 0..MOVING {
                let from = self.at(lane, node, number);
                self.motion[from - NODE * self.lanes] = self.motion[from];
            }
        }
        for number in 0..MOVING {
            let last = self.at(lane, self.nodes - 1, number);
            self.motion[last] = R::default();
        }
        passed
    }

    /// Nodes of a window.
    pub(super) fn len(&self) -> usize {
        self.nodes
    }

    /// What a node of a lane, counted from the first of its window, has gone through since this was
    /// last asked.
    #[inline(always)]
    pub(super) fn take(&mut self, lane: usize, node: usize) -> Noted {
        let [lowest, highest, when, curvature] = [LOWEST, HIGHEST, WHEN, BEND].map(|number| {
            let at = self.at(lane, node, number);
            std::mem::take(&mut self.motion[at]).double()
        });
        Noted { lowest, highest, when, curvature }
    }

    /// Deflection and slope of a node, and their rates.
    pub(super) fn motion(&self, lane: usize, node: usize) -> [[f64; 2]; 2] {
        [U, V].map(|number| [0, 1].map(|k| self.motion[self.at(lane, node, number + k)].double()))
    }

    /// All numbers of all nodes.
    pub(super) fn state(&self) -> &[R] {
        &self.motion
    }

    /// Go back to numbers that they had.
    pub(super) fn restore(&mut self, state: &[R]) {
        self.motion.copy_from_slice(state);
    }

    /// Whether all deflections are finite.
    pub(super) fn is_sound(&self) -> bool {
        let deflections = self.motion.chunks_exact(self.lanes).skip(U).step_by(NODE);
        deflections.flatten().all(|u| u.double().is_finite())
    }

    /// Whether the deflections of a lane, which are those of a step, count as extremes, and whether
    /// these may lie between steps, as they do not at the first and the last one.
    pub(super) fn count(&mut self, lane: usize, step: usize, counts: bool, between: bool) {
        self.shut[lane] = R::of(if counts { 0.0 } else { f64::INFINITY });
        self.sharp[lane] = R::of(if between { 0.125 } else { 0.0 });
        self.now[lane] = R::of(step as f64);
    }

    /// No forces.
    pub(super) fn unload(&mut self) {
        for at in self.loaded.drain(..) {
            self.motion[at] = R::default();
        }
    }

    /// Add a force or moment on an unknown of a node at one stage.
    #[inline(always)]
    pub(super) fn load(&mut self, stage: usize, lane: usize, (node, k): (usize, usize), f: f64) {
        let at = self.at(lane, node, LOADS[stage] + k);
        self.motion[at] = R::of(self.motion[at].double() + self.h * f);
        self.loaded.push(at);
    }

    /// All lanes of a crowd are at a step, counted from where their notes begin: what is noted in it was
    /// a step ago. Extremes may lie between steps, or not.
    pub(super) fn begin(&mut self, step: usize, between: bool) {
        self.unload();
        self.now.fill(R::of(step as f64 - 1.0));
        self.sharp.fill(R::of(if between { 0.125 } else { 0.0 }));
    }

    /// What a lane of a crowd makes of a node: its deflection, and its curvature a step ago.
    #[inline(always)]
    pub(super) fn own(&self, lane: usize, node: usize) -> [f64; 2] {
        [U, OWN_BEND].map(|number| self.motion[self.at(lane, node, number)].double())
    }

    /// Add to a node what others make of it; the curvature is forgotten in each step.
    #[inline(always)]
    pub(super) fn add_others(
        &mut self,
        lane: usize,
        node: usize,
        [deflection, curvature]: [f64; 2],
    ) {
        for (number, value) in [(OTHERS, deflection), (OWN_BEND, curvature)] {
            let at = self.at(lane, node, number);
            self.motion[at] = R::of(self.motion[at].double() + value);
        }
    }

    /// The deflections of a node a step and two steps ago, with those of others.
    pub(super) fn past(&self, lane: usize, node: usize) -> [R; 2] {
        [BEFORE, EARLIER].map(|number| self.motion[self.at(lane, node, number)])
    }

    /// Take over what another lane knows of them.
    pub(super) fn set_past(&mut self, lane: usize, node: usize, past: [R; 2]) {
        for (number, value) in [BEFORE, EARLIER].into_iter().zip(past) {
            let at = self.at(lane, node, number);
            self.motion[at] = value;
        }
    }

    /// There are no others at a node.
    #[inline(always)]
    pub(super) fn clear_others(&mut self, lane: usize, node: usize) {
        let at = self.at(lane, node, OTHERS);
        self.motion[at] = R::default();
    }

    /// What moves of a lane, node after node, the steps of notes counted from another `step` on.
    pub(super) fn moving(&self, lane: usize, step: f64) -> Vec<f64> {
        let number = |(node, number): (usize, usize)| {
            let value = self.motion[self.at(lane, node, number)].double();
            match number {
                WHEN => value - step,
                OTHERS => 0.0, // they tell anew
                _ => value,
            }
        };
        let all = |node: usize| (0..MOVING).map(move |number| (node, number));
        (0..self.nodes).flat_map(all).map(number).collect()
    }

    /// Put what moved of a lane into one that is at rest, from a node on.
    pub(super) fn put(&mut self, lane: usize, first: usize, moving: &[f64]) {
        for (node, numbers) in (first..self.nodes).zip(moving.chunks_exact(MOVING)) {
            for (number, &value) in numbers.iter().enumerate() {
                let at = self.at(lane, node, number);
                self.motion[at] = R::of(value);
            }
        }
    }

    /// Note the extremes that the lanes are at, and take one step.
    #[inline(always)]
    pub(super) fn step<S: Simd>(&mut self, simd: S) {
        let uniform = |content: &Content| matches!(content, Content::Uniform(_));
        let uniform = self.contents.iter().flatten().all(uniform);
        if !uniform && self.shared.is_none() {
            self.freshen();
        }
        let one = |values: &[R]| R::vectors::<S>(values)[0];
        let noting = Noting { shut: one(&self.shut), now: one(&self.now), sharp: one(&self.sharp) };
        let nodes = R::vectors_mut::<S>(&mut self.motion).as_chunks_mut::<NODE>().0;
        let all = self.nodes + 2;
        let walk: Walk<'_, S, R> = Walk { simd, h: self.h, notes: self.notes, nodes, noting };
        if uniform {
            let row = &R::vectors::<S>(&self.even).as_chunks::<EVEN>().0[0];
            let factors = R::vectors::<S>(&self.factors).as_chunks::<FACTORS>().0;
            let differing = self.differing.iter().copied().max().unwrap_or(1);
            walk.by(Even { row, factors: &factors[..differing.min(all)] });
        } else if let Some(shared) = &self.shared {
            walk.by(Each(Shared(&shared[..all])));
        } else {
            let rows = R::vectors::<S>(&self.laned).as_chunks::<ROWS>().0;
            walk.by(Each(Laned(&rows[..all])));
        }
    }

    /// Write the row of each uniform lane to all its nodes, where it is not there.
    fn freshen(&mut self) {
        for lane in 0..self.lanes {
            if self.stale[lane] && self.contents[lane].is_some() {
                let column = |numbers: &[R]| -> Vec<f64> {
                    let numbers = numbers.iter().skip(lane).step_by(self.lanes);
                    numbers.map(|number| number.double()).collect()
                };
                let (short, factors) = (column(&self.even), column(&self.factors));
                self.write(lane, |node| lengthened(&short, &factors[node * FACTORS..][..FACTORS]));
            }
        }
    }
}

/// A step of all nodes, whatever their rows.
struct Walk<'a, S: Simd, R: Number> {
    simd: S,
    h: f64,
    notes: Notes,
    nodes: &'a mut [[R::Vector<S>; NODE]],
    noting: Noting<R::Vector<S>>,
}

impl<S: Simd, R: Number> Walk<'_, S, R> {
    #[inline(always)]
    fn by<M: Rows<S, R>>(self, rows: M) {
        let Self { simd, h, notes, nodes, noting } = self;
        match notes {
            Notes::Steps => step::<S, R, M, { Notes::Steps as u8 }>(simd, h, rows, nodes, noting),
            Notes::Vertices => {
                step::<S, R, M, { Notes::Vertices as u8 }>(simd, h, rows, nodes, noting);
            }
            Notes::Crowd => step::<S, R, M, { Notes::Crowd as u8 }>(simd, h, rows, nodes, noting),
        }
    }
}

/// Two numbers of a node.
#[inline(always)]
fn pair<V: Copy>(node: &[V; NODE], number: usize) -> [V; 2] {
    [node[number], node[number + 1]]
}

#[inline(always)]
fn put<V: Copy>(node: &mut [V; NODE], number: usize, pair: [V; 2]) {
    [node[number], node[number + 1]] = pair;
}
