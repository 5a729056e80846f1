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
//! Where all lanes hold the same, as along a uniform road, they read one copy of it: what a step
//! reads and writes then stays in the first-level cache.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Matrix2;
use pulp::Simd;

use super::record::Passed;
use crate::pavement::Mesh;

const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// How far the second stage goes on with what the first has found.
const LATE: f64 = (1.0 - GAMMA) / GAMMA;

/// Where in a step its stages stand, as parts of it.
pub(super) const STAGES: [f64; 2] = [GAMMA, 1.0];

/// Numbers of a symmetric block row that are kept: the diagonal block and the one right of it.
const ROW: usize = 7;

/// Where the block rows of a node stand that a step reads: `M`, `h K` and `l (M - h^2 K)` (the
/// diagonal, 3 numbers, and right of it, 4); and of the factors `L` (4) and the inverse of `D` (3).
const MASS: usize = 0;
const STIFFNESS: usize = ROW;
const LATER: usize = 2 * ROW;
const FACTOR: usize = 3 * ROW;
const ROWS: usize = 4 * ROW;

/// Where the numbers of a node stand that move on with it. Displacement and velocity now,
const U: usize = 0;
const V: usize = 2;
/// the deflection a step before, the extremes since it was last asked, and the step of the lowest;
const BEFORE: usize = 4;
const LOWEST: usize = 5;
const HIGHEST: usize = 6;
const WHEN: usize = 7;
/// so many in all.
const MOVING: usize = 8;
/// And those of one step: the velocity of the first stage, what `u` and `v` leave to the right-hand
/// side of the second, the solution on its way down, and `h f` of both stages.
const FIRST: usize = 8;
const REST: usize = 10;
const DOWN: usize = 12;
const LOADS: [usize; 2] = [14, 16];
const NODE: usize = 18;

/// What a window holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    /// Elements of the section of this number alone, and so on both its sides.
    Uniform(usize),
    /// The nodes from this one on.
    From(usize),
}

/// Windows of as many nodes each, with one node that does not move on both sides.
pub(super) struct Windows {
    nodes: usize,
    lanes: usize,
    /// `h = g dt`, s.
    h: f64,
    /// What each lane holds, and the block rows of all lanes.
    contents: Vec<Option<Content>>,
    rows: Vec<f64>,
    /// One copy of the rows, where all lanes hold the same.
    shared: Option<Vec<[f64; ROWS]>>,
    /// The numbers of each node.
    motion: Vec<f64>,
    /// Which of them are forces that are not zero.
    loaded: Vec<usize>,
    /// 0 in the lanes that count now, infinity in the others; the step that they are at.
    shut: Vec<f64>,
    now: Vec<f64>,
    /// Whether extremes may lie between steps at all; 1/8 in the lanes where they may now, 0 in the
    /// others.
    between: bool,
    sharp: Vec<f64>,
}

impl Windows {
    /// Windows of `nodes` nodes at rest, in steps of `dt`; extremes may lie between these or not.
    pub(super) fn new(nodes: usize, lanes: usize, dt: f64, between: bool) -> Self {
        let per_node = |count: usize| vec![0.0; (nodes + 2) * count * lanes];
        Self {
            nodes,
            lanes,
            h: GAMMA * dt,
            contents: vec![None; lanes],
            rows: per_node(ROWS),
            shared: None,
            motion: per_node(NODE),
            loaded: Vec::new(),
            shut: vec![f64::INFINITY; lanes],
            now: vec![0.0; lanes],
            between,
            sharp: vec![0.0; lanes],
        }
    }

    /// Take the nodes from `first` on into a lane, unless it holds the same already.
    pub(super) fn fill(&mut self, lane: usize, mesh: &Mesh, first: usize) {
        let after = first + self.nodes;
        let inside = first > 0 && after < mesh.len();
        let content = if inside && mesh.uniform(first - 1, after - 1) {
            Content::Uniform(mesh.number(first))
        } else {
            Content::From(first)
        };
        if self.contents[lane] == Some(content) {
            return;
        }
        let rows = factored(mesh, first, self.nodes, self.h);
        let column = self.rows.iter_mut().skip(lane).step_by(self.lanes);
        for (to, from) in column.zip(rows.as_flattened()) {
            *to = *from;
        }
        self.contents[lane] = Some(content);
        // A lane without content is at rest, whatever it reads.
        let same = self.contents.iter().flatten().all(|other| *other == content);
        self.shared = same.then_some(rows);
    }

    /// Where a number of a node of a lane stands.
    fn at(&self, lane: usize, node: usize, number: usize) -> usize {
        ((node + 1) * NODE + number) * self.lanes + lane
    }

    /// Move a lane by one node: the first one leaves, the last one comes in at rest.
    pub(super) fn shift(&mut self, lane: usize) -> Passed {
        let passed = self.take(lane, 0);
        for node in 1..self.nodes {
            for number in 0..MOVING {
                let from = self.at(lane, node, number);
                self.motion[from - NODE * self.lanes] = self.motion[from];
            }
        }
        for number in 0..MOVING {
            let last = self.at(lane, self.nodes - 1, number);
            self.motion[last] = 0.0;
        }
        passed
    }

    /// Nodes of a window.
    pub(super) fn len(&self) -> usize {
        self.nodes
    }

    /// What a node of a lane, counted from the first of its window, has gone through since this was
    /// last asked.
    pub(super) fn take(&mut self, lane: usize, node: usize) -> Passed {
        let [lowest, highest, step] = [LOWEST, HIGHEST, WHEN].map(|number| {
            let at = self.at(lane, node, number);
            std::mem::take(&mut self.motion[at])
        });
        Passed { lowest, highest, step: step as usize }
    }

    /// Deflection and slope of a node, and their rates.
    pub(super) fn motion(&self, lane: usize, node: usize) -> [[f64; 2]; 2] {
        [U, V].map(|number| [0, 1].map(|k| self.motion[self.at(lane, node, number + k)]))
    }

    /// All numbers of all nodes.
    pub(super) fn state(&self) -> &[f64] {
        &self.motion
    }

    /// Go back to numbers that they had.
    pub(super) fn restore(&mut self, state: &[f64]) {
        self.motion.copy_from_slice(state);
    }

    /// Whether all deflections are finite.
    pub(super) fn is_sound(&self) -> bool {
        let deflections = self.motion.chunks_exact(self.lanes).skip(U).step_by(NODE);
        deflections.flatten().sum::<f64>().is_finite()
    }

    /// Whether the deflections of a lane, which are those of a step, count as extremes, and whether
    /// these may lie between steps, as they do not at the first and the last one.
    pub(super) fn count(&mut self, lane: usize, step: usize, counts: bool, between: bool) {
        self.shut[lane] = if counts { 0.0 } else { f64::INFINITY };
        self.sharp[lane] = if between { 0.125 } else { 0.0 };
        self.now[lane] = step as f64;
    }

    /// No forces.
    pub(super) fn unload(&mut self) {
        for at in self.loaded.drain(..) {
            self.motion[at] = 0.0;
        }
    }

    /// Add a force or moment on an unknown of a node at one stage.
    pub(super) fn load(&mut self, stage: usize, lane: usize, (node, k): (usize, usize), f: f64) {
        let at = self.at(lane, node, LOADS[stage] + k);
        self.motion[at] += self.h * f;
        self.loaded.push(at);
    }

    /// Note the extremes that the lanes are at, and take one step.
    #[inline(always)]
    pub(super) fn step<S: Simd>(&mut self, simd: S) {
        let all = self.nodes + 2;
        let one = |values: &[f64]| S::as_simd_f64s(values).0[0];
        let noting = Noting { shut: one(&self.shut), now: one(&self.now), sharp: one(&self.sharp) };
        let nodes = S::as_mut_simd_f64s(&mut self.motion).0.as_chunks_mut::<NODE>().0;
        let nodes = &mut nodes[..all];
        if let Some(rows) = &self.shared {
            let rows = Shared(&rows[..all]);
            if self.between {
                step::<S, _, true>(simd, self.h, rows, nodes, noting);
            } else {
                step::<S, _, false>(simd, self.h, rows, nodes, noting);
            }
        } else {
            let rows = S::as_simd_f64s(&self.rows).0.as_chunks::<ROWS>().0;
            step::<S, _, true>(simd, self.h, Laned(&rows[..all]), nodes, noting);
        }
    }
}

/// Note the extremes that the lanes are at, and take one step.
#[inline(always)]
fn step<S: Simd, R: Rows<S>, const BETWEEN: bool>(
    simd: S,
    h: f64,
    rows: R,
    nodes: &mut [[S::f64s; NODE]],
    noting: Noting<S::f64s>,
) {
    let n = nodes.len() - 2;
    let zero = [simd.splat_f64s(0.0); 2];
    let late = simd.splat_f64s(LATE);
    let [after, now] = [simd.splat_f64s(LATE * h), simd.splat_f64s(h)];

    let mut above = zero;
    for i in 1..=n {
        let inertia = apply(simd, rows, MASS, nodes, V, i);
        let force = apply(simd, rows, STIFFNESS, nodes, U, i);
        let node = &mut nodes[i];
        let right = [simd.sub_f64s(inertia[0], force[0]), simd.sub_f64s(inertia[1], force[1])];
        for k in 0..2 {
            node[REST + k] = simd.negate_mul_add_f64s(late, inertia[k], right[k]);
        }
        above = forward(simd, rows, i, above, add(simd, right, pair(node, LOADS[0])));
        put(node, DOWN, above);
    }
    let mut below = zero;
    for i in (1..=n).rev() {
        below = backward(simd, rows, i, pair(&nodes[i], DOWN), below);
        put(&mut nodes[i], FIRST, below);
    }
    let mut above = zero;
    for i in 1..=n {
        let later = apply(simd, rows, LATER, nodes, FIRST, i);
        let node = &mut nodes[i];
        let right = add(simd, pair(node, REST), pair(node, LOADS[1]));
        above = forward(simd, rows, i, above, add(simd, right, later));
        put(node, DOWN, above);
    }
    let mut below = zero;
    for i in (1..=n).rev() {
        below = backward(simd, rows, i, pair(&nodes[i], DOWN), below);
        let node = &mut nodes[i];
        let was = node[U];
        put(node, V, below);
        for k in 0..2 {
            let moved = simd.mul_add_f64s(after, node[FIRST + k], node[U + k]);
            node[U + k] = simd.mul_add_f64s(now, below[k], moved);
        }
        noting.note::<S, BETWEEN>(simd, node, was);
    }
}

/// How the lanes note extremes.
#[derive(Clone, Copy)]
struct Noting<V> {
    shut: V,
    now: V,
    sharp: V,
}

impl<V: Copy> Noting<V> {
    /// Note what a node was; or, if that is an extreme and these may lie between steps, the vertex of
    /// the parabola through what it was a step before and what it is now.
    #[inline(always)]
    fn note<S: Simd<f64s = V>, const BETWEEN: bool>(self, simd: S, node: &mut [V; NODE], was: V) {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let (mut low, mut high) = (simd.add_f64s(was, self.shut), simd.sub_f64s(was, self.shut));
        if BETWEEN {
            let [to, from] = [simd.sub_f64s(node[U], was), simd.sub_f64s(was, node[BEFORE])];
            node[BEFORE] = was;
            let (slope, bend) = (simd.add_f64s(to, from), simd.sub_f64s(to, from));
            let least = simd.max_f64s(simd.abs_f64s(bend), simd.splat_f64s(f64::MIN_POSITIVE));
            let square = simd.mul_f64s(simd.mul_f64s(slope, slope), self.sharp);
            let vertex = simd.div_f64s(square, least);
            // Where the vertex is not within half a step, there is no extreme.
            let most = simd.mul_f64s(self.sharp, bend);
            let below = simd.min_f64s(vertex, simd.max_f64s(most, zero));
            let above = simd.min_f64s(vertex, simd.max_f64s(simd.neg_f64s(most), zero));
            low = simd.sub_f64s(low, below);
            high = simd.add_f64s(high, above);
        }
        // As a number: a choice between two values would be stored under a mask, which is slow.
        let lower = simd.select_f64s(simd.less_than_f64s(low, node[LOWEST]), one, zero);
        node[WHEN] = simd.mul_add_f64s(lower, simd.sub_f64s(self.now, node[WHEN]), node[WHEN]);
        node[LOWEST] = simd.min_f64s(node[LOWEST], low);
        node[HIGHEST] = simd.max_f64s(node[HIGHEST], high);
    }
}

/// Block rows, node after node.
trait Rows<S: Simd>: Copy {
    /// A number of the rows of a node.
    fn number(self, simd: S, node: usize, number: usize) -> S::f64s;
}

/// One copy for all lanes.
#[derive(Clone, Copy)]
struct Shared<'a>(&'a [[f64; ROWS]]);

impl<S: Simd> Rows<S> for Shared<'_> {
    #[inline(always)]
    fn number(self, simd: S, node: usize, number: usize) -> S::f64s {
        simd.splat_f64s(self.0[node][number])
    }
}

/// A row for each lane.
#[derive(Clone, Copy)]
struct Laned<'a, V>(&'a [[V; ROWS]]);

impl<S: Simd> Rows<S> for Laned<'_, S::f64s> {
    #[inline(always)]
    fn number(self, _: S, node: usize, number: usize) -> S::f64s {
        self.0[node][number]
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

#[inline(always)]
fn add<S: Simd>(simd: S, a: [S::f64s; 2], b: [S::f64s; 2]) -> [S::f64s; 2] {
    [simd.add_f64s(a[0], b[0]), simd.add_f64s(a[1], b[1])]
}

/// Block row `i` of a matrix times a pair of each node, in two sums a row, whose latencies overlap.
#[inline(always)]
fn apply<S: Simd>(
    simd: S,
    rows: impl Rows<S>,
    matrix: usize,
    nodes: &[[S::f64s; NODE]],
    x: usize,
    i: usize,
) -> [S::f64s; 2] {
    let a = |node, k| rows.number(simd, node, matrix + k);
    let (left, here, right) = (pair(&nodes[i - 1], x), pair(&nodes[i], x), pair(&nodes[i + 1], x));
    let row = |[l0, l1, h0, h1, r0, r1]: [S::f64s; 6]| {
        let near = simd.mul_add_f64s(h1, here[1], simd.mul_f64s(h0, here[0]));
        let near = simd.mul_add_f64s(l0, left[0], near);
        let far = simd.mul_add_f64s(r1, right[1], simd.mul_f64s(r0, right[0]));
        simd.add_f64s(near, simd.mul_add_f64s(l1, left[1], far))
    };
    [
        row([a(i - 1, 3), a(i - 1, 5), a(i, 0), a(i, 1), a(i, 3), a(i, 4)]),
        row([a(i - 1, 4), a(i - 1, 6), a(i, 1), a(i, 2), a(i, 5), a(i, 6)]),
    ]
}

/// `right - L before`.
#[inline(always)]
fn forward<S: Simd>(
    simd: S,
    rows: impl Rows<S>,
    i: usize,
    before: [S::f64s; 2],
    right: [S::f64s; 2],
) -> [S::f64s; 2] {
    let l = |k| rows.number(simd, i, FACTOR + k);
    let y = simd.negate_mul_add_f64s(l(0), before[0], right[0]);
    let z = simd.negate_mul_add_f64s(l(2), before[0], right[1]);
    [simd.negate_mul_add_f64s(l(1), before[1], y), simd.negate_mul_add_f64s(l(3), before[1], z)]
}

/// `D^-1 down - L' after`, the `L` being that of the next row.
#[inline(always)]
fn backward<S: Simd>(
    simd: S,
    rows: impl Rows<S>,
    i: usize,
    down: [S::f64s; 2],
    after: [S::f64s; 2],
) -> [S::f64s; 2] {
    let d = |k| rows.number(simd, i, FACTOR + 4 + k);
    let l = |k| rows.number(simd, i + 1, FACTOR + k);
    let y = simd.mul_add_f64s(d(1), down[1], simd.mul_f64s(d(0), down[0]));
    let z = simd.mul_add_f64s(d(2), down[1], simd.mul_f64s(d(1), down[0]));
    let y = simd.negate_mul_add_f64s(l(0), after[0], y);
    let z = simd.negate_mul_add_f64s(l(1), after[0], z);
    [simd.negate_mul_add_f64s(l(2), after[1], y), simd.negate_mul_add_f64s(l(3), after[1], z)]
}

/// The block rows that a step reads, of so many nodes from `first` on and of one on both sides.
fn factored(mesh: &Mesh, first: usize, nodes: usize, h: f64) -> Vec<[f64; ROWS]> {
    let mut rows = vec![[0.0; ROWS]; nodes + 2];
    let mut before = Matrix2::zeros();
    let mut inverse = Matrix2::zeros();
    for i in 0..nodes {
        let node = first + i;
        let [mass, damping, stiffness] = row_of(mesh, node, i + 1 == nodes);
        let sum = |k: usize| mass[k] + (damping[k] + stiffness[k] * h) * h;
        let (mut diagonal, right) = (sum(0), sum(1));
        for held in (0..2).filter(|k| mesh.holds(2 * node + k)) {
            diagonal[(held, held)] = 1.0;
        }
        let lower: Matrix2<f64> = before.transpose() * inverse;
        let pivot = diagonal - lower * before;
        inverse = pivot.try_inverse().unwrap_or(Matrix2::repeat(f64::NAN));
        before = right;
        let later = [0, 1].map(|k| (mass[k] - stiffness[k] * (h * h)) * LATE);
        let symmetric = |a: &Matrix2<f64>| [a[(0, 0)], a[(0, 1)], a[(1, 1)]];
        let whole = |a: &Matrix2<f64>| [a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]];
        let row = |[diagonal, right]: [Matrix2<f64>; 2]| {
            let ([a, b, c], [d, e, f, g]) = (symmetric(&diagonal), whole(&right));
            [a, b, c, d, e, f, g]
        };
        let ([a, b, c], [d, e, f, g]) = (symmetric(&inverse), whole(&lower));
        let stiffness = stiffness.map(|block| block * h);
        let numbers = [row(mass), row(stiffness), row(later), [d, e, f, g, a, b, c]];
        rows[i + 1].copy_from_slice(numbers.as_flattened());
    }
    rows
}

/// The diagonal block of a node and the block right of it, of `M`, `C` and `K`; without the latter
/// at the last node of a window, and without the unknowns that the ends of the road hold.
fn row_of(mesh: &Mesh, node: usize, is_last: bool) -> [[Matrix2<f64>; 2]; 3] {
    let mut rows = mesh.block_row(node);
    for row in &mut rows {
        if is_last {
            row[1].fill(0.0);
        }
        for k in 0..2 {
            if mesh.holds(2 * node + k) {
                row[0].row_mut(k).fill(0.0);
                row[0].column_mut(k).fill(0.0);
                row[1].row_mut(k).fill(0.0);
            }
            if mesh.holds(2 * node + 2 + k) {
                row[1].column_mut(k).fill(0.0);
            }
        }
    }
    rows
}
