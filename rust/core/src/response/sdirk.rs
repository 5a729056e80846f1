//! Steps of windows of pavement, one window in each lane of a vector.
//!
//! The two-stage, stiffly accurate, L-stable method of second order with `g = 1 - 1/sqrt 2` (R.
//! Alexander, SIAM J. Numer. Anal. 14 (1977) 1006). With `h = g dt`, each stage solves for a velocity
//!
//! ```text
//! (M + h C + h^2 K) v_i = M a_i - h K b_i + h f_i
//! a_1 = v,                       b_1 = u
//! a_2 = v + (1 - g)/g (v_1 - v), b_2 = u + (1 - g) dt v_1
//! ```
//!
//! and the step ends at `v = v_2`, `u = b_2 + h v_2`. The matrices are symmetric and of 2x2 blocks,
//! one row of blocks a node, each coupled to its neighbours only: they are factored once for a
//! window's content, as `L D L'`, and a stage is one walk down the window and one back.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Matrix2, Matrix4};
use pulp::Simd;

use super::record::Passed;
use crate::pavement::Mesh;

const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// Where in a step its stages stand, as parts of it.
pub(super) const STAGES: [f64; 2] = [GAMMA, 1.0];

/// Numbers of a symmetric block row that are kept: the diagonal block and the one right of it.
const ROW: usize = 7;

/// Windows of as many nodes each, with one node that does not move on both sides.
pub(super) struct Windows {
    nodes: usize,
    lanes: usize,
    /// `h = g dt`, s.
    h: f64,
    /// Block rows of `M` and `h K`: diagonal (3 numbers), right of it (4).
    mass: Vec<f64>,
    stiffness: Vec<f64>,
    /// Block rows of the factors: `L` (4 numbers), the inverse of `D` (3).
    factor: Vec<f64>,
    /// Displacement and velocity now.
    u: Vec<f64>,
    v: Vec<f64>,
    /// What the first stage adds to both, and what it leaves to the right-hand side of the second.
    du: Vec<f64>,
    dv: Vec<f64>,
    rest: Vec<f64>,
    /// The solution on its way down.
    down: Vec<f64>,
    /// `h f` of both stages.
    loads: [Vec<f64>; 2],
    /// Numbers of `loads` that are not zero.
    loaded: [Vec<usize>; 2],
    /// Extremes of the deflection of each node, and the step of the lowest.
    lowest: Vec<f64>,
    highest: Vec<f64>,
    when: Vec<f64>,
    /// 0 in the lanes that count now, infinity in the others; and the step that comes next.
    shut: Vec<f64>,
    next: Vec<f64>,
}

impl Windows {
    /// Windows of `nodes` nodes at rest, in steps of `dt`.
    pub(super) fn new(nodes: usize, lanes: usize, dt: f64) -> Self {
        let per_node = |count: usize| vec![0.0; (nodes + 2) * count * lanes];
        Self {
            nodes,
            lanes,
            h: GAMMA * dt,
            mass: per_node(ROW),
            stiffness: per_node(ROW),
            factor: per_node(ROW),
            u: per_node(2),
            v: per_node(2),
            du: per_node(2),
            dv: per_node(2),
            rest: per_node(2),
            down: per_node(2),
            loads: [per_node(2), per_node(2)],
            loaded: [Vec::new(), Vec::new()],
            lowest: per_node(1),
            highest: per_node(1),
            when: per_node(1),
            shut: vec![f64::INFINITY; lanes],
            next: vec![0.0; lanes],
        }
    }

    /// Take the nodes from `first` on into a lane: assemble and factor.
    pub(super) fn fill(&mut self, lane: usize, mesh: &Mesh, first: usize) {
        let (h, lanes) = (self.h, self.lanes);
        let put = |values: &mut [f64], i: usize, numbers: [f64; ROW]| {
            for (k, number) in numbers.into_iter().enumerate() {
                values[((i + 1) * ROW + k) * lanes + lane] = number;
            }
        };
        let mut before = Matrix2::zeros();
        let mut inverse = Matrix2::zeros();
        for i in 0..self.nodes {
            let node = first + i;
            let [mass, damping, stiffness] = row_of(mesh, node, i + 1 == self.nodes);
            let sum = |k: usize| mass[k] + (damping[k] + stiffness[k] * h) * h;
            let (mut diagonal, right) = (sum(0), sum(1));
            for held in (0..2).filter(|k| mesh.holds(2 * node + k)) {
                diagonal[(held, held)] = 1.0;
            }
            let lower: Matrix2<f64> = before.transpose() * inverse;
            let pivot = diagonal - lower * before;
            inverse = pivot.try_inverse().unwrap_or(Matrix2::repeat(f64::NAN));
            before = right;
            let symmetric = |a: &Matrix2<f64>| [a[(0, 0)], a[(0, 1)], a[(1, 1)]];
            let whole = |a: &Matrix2<f64>| [a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]];
            let row = |diagonal: &Matrix2<f64>, right: &Matrix2<f64>| {
                let ([a, b, c], [d, e, f, g]) = (symmetric(diagonal), whole(right));
                [a, b, c, d, e, f, g]
            };
            put(&mut self.mass, i, row(&mass[0], &mass[1]));
            put(&mut self.stiffness, i, row(&(stiffness[0] * h), &(stiffness[1] * h)));
            let ([a, b, c], [d, e, f, g]) = (symmetric(&inverse), whole(&lower));
            put(&mut self.factor, i, [d, e, f, g, a, b, c]);
        }
    }

    /// Move a lane by one node: the first one leaves, the last one comes in at rest.
    pub(super) fn shift(&mut self, lane: usize) -> Passed {
        let lanes = self.lanes;
        let passed = self.passed(lane, 0);
        let last = self.nodes;
        let walk = |values: &mut [f64], width: usize| {
            for node in 1..last {
                for k in 0..width {
                    let at = |node: usize| (node * width + k) * lanes + lane;
                    values[at(node)] = values[at(node + 1)];
                }
            }
            for k in 0..width {
                values[(last * width + k) * lanes + lane] = 0.0;
            }
        };
        walk(&mut self.u, 2);
        walk(&mut self.v, 2);
        walk(&mut self.lowest, 1);
        walk(&mut self.highest, 1);
        walk(&mut self.when, 1);
        passed
    }

    /// Nodes of a window.
    pub(super) fn len(&self) -> usize {
        self.nodes
    }

    /// What a node of a lane, counted from the first of its window, has gone through.
    pub(super) fn passed(&self, lane: usize, node: usize) -> Passed {
        let at = (node + 1) * self.lanes + lane;
        Passed { lowest: self.lowest[at], highest: self.highest[at], step: self.when[at] }
    }

    /// Deflection and slope of a node.
    pub(super) fn motion(&self, lane: usize, node: usize) -> [f64; 2] {
        [0, 1].map(|k| self.u[((node + 1) * 2 + k) * self.lanes + lane])
    }

    /// Whether all deflections are finite.
    pub(super) fn is_sound(&self) -> bool {
        self.u.iter().sum::<f64>().is_finite()
    }

    /// Count the extremes of a lane, which the next step takes to `step`, from now on or no more.
    pub(super) fn count(&mut self, lane: usize, counts: bool, step: usize) {
        self.shut[lane] = if counts { 0.0 } else { f64::INFINITY };
        self.next[lane] = step as f64;
    }

    /// No forces.
    pub(super) fn unload(&mut self) {
        for (loads, loaded) in self.loads.iter_mut().zip(&mut self.loaded) {
            for at in loaded.drain(..) {
                loads[at] = 0.0;
            }
        }
    }

    /// Add a force or moment on an unknown of a node at one stage.
    pub(super) fn load(&mut self, stage: usize, lane: usize, (node, k): (usize, usize), f: f64) {
        let at = ((node + 1) * 2 + k) * self.lanes + lane;
        self.loads[stage][at] += self.h * f;
        self.loaded[stage].push(at);
    }

    /// One step of all lanes.
    #[inline(always)]
    pub(super) fn step<S: Simd>(&mut self, simd: S) {
        let n = self.nodes;
        let zero = [simd.splat_f64s(0.0); 2];
        let rows = Rows {
            mass: block_rows::<S>(&self.mass, n),
            stiffness: block_rows::<S>(&self.stiffness, n),
        };
        let factor = block_rows::<S>(&self.factor, n);
        let [u, v] = [&mut self.u, &mut self.v].map(|values| pairs_mut::<S>(values, n));
        let [du, dv] = [&mut self.du, &mut self.dv].map(|values| pairs_mut::<S>(values, n));
        let [rest, down] = [&mut self.rest, &mut self.down].map(|x| pairs_mut::<S>(x, n));
        let [first, second] = [&self.loads[0], &self.loads[1]].map(|x| pairs::<S>(x, n));

        let mut above = zero;
        for i in 1..=n {
            rest[i] = rows.residual(simd, v, u, i);
            above = forward(simd, &factor[i], above, add(simd, rest[i], first[i]));
            down[i] = above;
        }
        let late = simd.splat_f64s((1.0 - GAMMA) / GAMMA);
        let length = simd.splat_f64s((1.0 - GAMMA) / GAMMA * self.h);
        let mut below = zero;
        for i in (1..=n).rev() {
            below = backward(simd, &factor[i], &factor[i + 1], down[i], below);
            for k in 0..2 {
                dv[i][k] = simd.mul_f64s(late, simd.sub_f64s(below[k], v[i][k]));
                du[i][k] = simd.mul_f64s(length, below[k]);
            }
        }
        let mut above = zero;
        for i in 1..=n {
            let right = add(simd, add(simd, rest[i], second[i]), rows.residual(simd, dv, du, i));
            above = forward(simd, &factor[i], above, right);
            down[i] = above;
        }
        let length = simd.splat_f64s(self.h);
        let mut below = zero;
        for i in (1..=n).rev() {
            below = backward(simd, &factor[i], &factor[i + 1], down[i], below);
            v[i] = below;
            for k in 0..2 {
                let moved = simd.add_f64s(u[i][k], du[i][k]);
                u[i][k] = simd.mul_add_f64s(length, below[k], moved);
            }
        }
        self.note_extremes(simd);
    }

    #[inline(always)]
    fn note_extremes<S: Simd>(&mut self, simd: S) {
        let (shut, next) = (S::as_simd_f64s(&self.shut).0[0], S::as_simd_f64s(&self.next).0[0]);
        let extremes = [&mut self.lowest, &mut self.highest, &mut self.when];
        let [lowest, highest, when] = extremes.map(|values| S::as_mut_simd_f64s(values).0);
        let extremes = lowest.iter_mut().zip(highest).zip(when);
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        for (&[w, _], ((lowest, highest), when)) in
            pairs::<S>(&self.u, self.nodes).iter().zip(extremes)
        {
            let open = simd.add_f64s(w, shut);
            // As a number: a choice between two values would be stored under a mask, which is slow.
            let lower = simd.select_f64s(simd.less_than_f64s(open, *lowest), one, zero);
            *when = simd.mul_add_f64s(lower, simd.sub_f64s(next, *when), *when);
            *lowest = simd.min_f64s(*lowest, open);
            *highest = simd.max_f64s(*highest, simd.sub_f64s(w, shut));
        }
    }
}

/// Block rows of `M` and `h K`.
struct Rows<'a, V> {
    mass: &'a [[V; ROW]],
    stiffness: &'a [[V; ROW]],
}

impl<V: Copy> Rows<'_, V> {
    /// `M v - h K u` in row `i`.
    #[inline(always)]
    fn residual<S: Simd<f64s = V>>(&self, simd: S, v: &[[V; 2]], u: &[[V; 2]], i: usize) -> [V; 2] {
        let [inertia, force] = [apply(simd, self.mass, v, i), apply(simd, self.stiffness, u, i)];
        [simd.sub_f64s(inertia[0], force[0]), simd.sub_f64s(inertia[1], force[1])]
    }
}

/// Rows of `n` nodes and one on both sides.
#[inline(always)]
fn block_rows<S: Simd>(values: &[f64], n: usize) -> &[[S::f64s; ROW]] {
    &S::as_simd_f64s(values).0.as_chunks::<ROW>().0[..n + 2]
}

#[inline(always)]
fn add<S: Simd>(simd: S, a: [S::f64s; 2], b: [S::f64s; 2]) -> [S::f64s; 2] {
    [simd.add_f64s(a[0], b[0]), simd.add_f64s(a[1], b[1])]
}

/// Deflection and slope of `n` nodes and one on both sides.
#[inline(always)]
fn pairs<S: Simd>(values: &[f64], n: usize) -> &[[S::f64s; 2]] {
    &S::as_simd_f64s(values).0.as_chunks::<2>().0[..n + 2]
}

/// The same, to change.
#[inline(always)]
fn pairs_mut<S: Simd>(values: &mut [f64], n: usize) -> &mut [[S::f64s; 2]] {
    &mut S::as_mut_simd_f64s(values).0.as_chunks_mut::<2>().0[..n + 2]
}

/// `A x` in block row `i`, in two sums a row, whose latencies overlap.
#[inline(always)]
fn apply<S: Simd>(simd: S, a: &[[S::f64s; ROW]], x: &[[S::f64s; 2]], i: usize) -> [S::f64s; 2] {
    let ([p, q, r, b00, b01, b10, b11], [_, _, _, a00, a01, a10, a11]) = (a[i], a[i - 1]);
    let (left, here, right) = (x[i - 1], x[i], x[i + 1]);
    let row = |[l0, l1, h0, h1, r0, r1]: [S::f64s; 6]| {
        let near = simd.mul_add_f64s(h1, here[1], simd.mul_f64s(h0, here[0]));
        let near = simd.mul_add_f64s(l0, left[0], near);
        let far = simd.mul_add_f64s(r1, right[1], simd.mul_f64s(r0, right[0]));
        simd.add_f64s(near, simd.mul_add_f64s(l1, left[1], far))
    };
    [row([a00, a10, p, q, b00, b01]), row([a01, a11, q, r, b10, b11])]
}

/// `right - L before`.
#[inline(always)]
fn forward<S: Simd>(
    simd: S,
    factor: &[S::f64s; ROW],
    before: [S::f64s; 2],
    right: [S::f64s; 2],
) -> [S::f64s; 2] {
    let [l00, l01, l10, l11, ..] = *factor;
    let y = simd.negate_mul_add_f64s(l00, before[0], right[0]);
    let z = simd.negate_mul_add_f64s(l10, before[0], right[1]);
    [simd.negate_mul_add_f64s(l01, before[1], y), simd.negate_mul_add_f64s(l11, before[1], z)]
}

/// `D^-1 down - L' after`, the `L` being that of the next row.
#[inline(always)]
fn backward<S: Simd>(
    simd: S,
    factor: &[S::f64s; ROW],
    next: &[S::f64s; ROW],
    down: [S::f64s; 2],
    after: [S::f64s; 2],
) -> [S::f64s; 2] {
    let ([.., a, b, c], [l00, l01, l10, l11, ..]) = (*factor, *next);
    let y = simd.mul_add_f64s(b, down[1], simd.mul_f64s(a, down[0]));
    let z = simd.mul_add_f64s(c, down[1], simd.mul_f64s(b, down[0]));
    let y = simd.negate_mul_add_f64s(l00, after[0], y);
    let z = simd.negate_mul_add_f64s(l01, after[0], z);
    [simd.negate_mul_add_f64s(l10, after[1], y), simd.negate_mul_add_f64s(l11, after[1], z)]
}

/// The diagonal block of a node and the block right of it, of `M`, `C` and `K`; without the latter
/// at the last node of a window, and without the unknowns that the ends of the road hold.
fn row_of(mesh: &Mesh, node: usize, is_last: bool) -> [[Matrix2<f64>; 2]; 3] {
    let block = |matrix: &Matrix4<f64>, row: usize, column: usize| -> Matrix2<f64> {
        matrix.fixed_view::<2, 2>(row, column).into_owned()
    };
    let left = node.checked_sub(1).map(|element| mesh.matrices(element));
    let right = (node < mesh.elements()).then(|| mesh.matrices(node));
    let mut rows = [[Matrix2::zeros(); 2]; 3];
    if let Some(matrices) = left {
        for (row, matrix) in rows.iter_mut().zip(matrices.all()) {
            row[0] += block(matrix, 2, 2);
        }
    }
    if let Some(matrices) = right {
        for (row, matrix) in rows.iter_mut().zip(matrices.all()) {
            row[0] += block(matrix, 0, 0);
            if !is_last {
                row[1] = block(matrix, 0, 2);
            }
        }
    }
    for k in 0..2 {
        for row in &mut rows {
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
