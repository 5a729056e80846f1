//! A step of windows, and what of it is noted.

use pulp::Simd;

use super::number::Number;
use super::rows::{Matrix, Rows};
use super::{
    BEFORE, BEND, EARLIER, FIRST, HIGHEST, LATE, LOADS, LOWEST, NODE, OTHERS, OWN_BEND, REST, U, V,
    WHEN, pair, put,
};

/// What is noted of the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Notes {
    /// Extremes of the deflection at steps.
    Steps,
    /// Also where the parabola through three steps has its vertex.
    Vertices,
    /// Of the deflection and the curvature, with what others make of both, a step late.
    Crowd,
}

/// How the lanes note extremes.
#[derive(Clone, Copy)]
pub(super) struct Noting<V> {
    pub(super) shut: V,
    pub(super) now: V,
    pub(super) sharp: V,
}

/// Note the extremes that the lanes are at, and take one step.
#[inline(always)]
pub(super) fn step<S: Simd, R: Number, M: Rows<S, R>, const NOTES: u8>(
    simd: S,
    h: f64,
    rows: M,
    nodes: &mut [[R::Vector<S>; NODE]],
    noting: Noting<R::Vector<S>>,
) {
    let n = nodes.len() - 2;
    let zero = [R::splat(simd, 0.0); 2];
    let late = R::splat(simd, LATE);
    let [after, now] = [R::splat(simd, LATE * h), R::splat(simd, h)];

    let mut above = zero;
    for i in 1..=n {
        let inertia = rows.apply(simd, Matrix::Mass, nodes, V, i);
        let force = rows.apply(simd, Matrix::Stiffness, nodes, U, i);
        if NOTES == Notes::Crowd as u8 {
            let bend = rows.curvature(simd, nodes, U, i);
            let node = &mut nodes[i];
            noting.note_crowd::<S, R>(simd, node);
            node[OWN_BEND] = bend;
        }
        let node = &mut nodes[i];
        let right = [0, 1].map(|k| R::sub(simd, inertia[k], force[k]));
        put(node, REST, [0, 1].map(|k| R::mul_sub(simd, late, inertia[k], right[k])));
        let load = pair(node, LOADS[0]);
        let right = [0, 1].map(|k| R::add(simd, right[k], load[k]));
        above = forward(simd, rows, i, above, right);
        put(node, FIRST, above);
    }
    let mut below = zero;
    for i in (1..=n).rev() {
        below = backward(simd, rows, i, pair(&nodes[i], FIRST), below);
        put(&mut nodes[i], FIRST, below);
    }
    let mut above = zero;
    for i in 1..=n {
        let later = rows.apply(simd, Matrix::Later, nodes, FIRST, i);
        let node = &mut nodes[i];
        let (rest, load) = (pair(node, REST), pair(node, LOADS[1]));
        let right = [0, 1].map(|k| R::add(simd, R::add(simd, rest[k], load[k]), later[k]));
        above = forward(simd, rows, i, above, right);
        put(node, REST, above);
    }
    let mut below = zero;
    for i in (1..=n).rev() {
        below = backward(simd, rows, i, pair(&nodes[i], REST), below);
        let node = &mut nodes[i];
        let was = node[U];
        put(node, V, below);
        for k in 0..2 {
            let moved = R::mul_add(simd, after, node[FIRST + k], node[U + k]);
            node[U + k] = R::mul_add(simd, now, below[k], moved);
        }
        if NOTES != Notes::Crowd as u8 {
            noting.note::<S, R, NOTES>(simd, node, was);
        }
    }
}

/// `right - L before`.
#[inline(always)]
fn forward<S: Simd, R: Number, M: Rows<S, R>>(
    simd: S,
    rows: M,
    i: usize,
    before: [R::Vector<S>; 2],
    right: [R::Vector<S>; 2],
) -> [R::Vector<S>; 2] {
    let l = |k| rows.factor(simd, i, k);
    let y = R::mul_sub(simd, l(0), before[0], right[0]);
    let z = R::mul_sub(simd, l(2), before[0], right[1]);
    [R::mul_sub(simd, l(1), before[1], y), R::mul_sub(simd, l(3), before[1], z)]
}

/// `D^-1 down - L' after`, the `L` being that of the next row.
#[inline(always)]
fn backward<S: Simd, R: Number, M: Rows<S, R>>(
    simd: S,
    rows: M,
    i: usize,
    down: [R::Vector<S>; 2],
    after: [R::Vector<S>; 2],
) -> [R::Vector<S>; 2] {
    let d = |k: usize| rows.factor(simd, i, 4 + k);
    let l = |k| rows.factor(simd, i + 1, k);
    let y = R::mul_add(simd, d(1), down[1], R::mul(simd, d(0), down[0]));
    let z = R::mul_add(simd, d(2), down[1], R::mul(simd, d(1), down[0]));
    let y = R::mul_sub(simd, l(0), after[0], y);
    let z = R::mul_sub(simd, l(1), after[0], z);
    [R::mul_sub(simd, l(2), after[1], y), R::mul_sub(simd, l(3), after[1], z)]
}

impl<V: Copy> Noting<V> {
    /// Note what a node was; or, if that is an extreme and these may lie between steps, the vertex of
    /// the parabola through what it was a step before and what it is now.
    #[inline(always)]
    fn note<S: Simd, R: Number<Vector<S> = V>, const NOTES: u8>(
        self,
        simd: S,
        node: &mut [V; NODE],
        was: V,
    ) {
        let mut extremes = [was; 2];
        if NOTES == Notes::Vertices as u8 {
            extremes = self.vertices::<S, R>(simd, [node[BEFORE], was, node[U]]);
            node[BEFORE] = was;
        }
        let low = R::add(simd, extremes[0], self.shut);
        let high = R::sub(simd, extremes[1], self.shut);
        self.take::<S, R>(simd, node, low, high);
    }

    /// The same of the deflection a step ago, and the curvature then, with those of others.
    #[inline(always)]
    fn note_crowd<S: Simd, R: Number<Vector<S> = V>>(self, simd: S, node: &mut [V; NODE]) {
        let sum = R::add(simd, node[U], node[OTHERS]);
        let [low, high] = self.vertices::<S, R>(simd, [node[EARLIER], node[BEFORE], sum]);
        node[EARLIER] = node[BEFORE];
        node[BEFORE] = sum;
        self.take::<S, R>(simd, node, low, high);
        node[BEND] = R::max(simd, node[BEND], node[OWN_BEND]);
    }

    /// Lowest and highest about the second of three deflections.
    #[inline(always)]
    fn vertices<S: Simd, R: Number<Vector<S> = V>>(
        self,
        simd: S,
        [before, was, is]: [V; 3],
    ) -> [V; 2] {
        let zero = R::splat(simd, 0.0);
        let (to, from) = (R::sub(simd, is, was), R::sub(simd, was, before));
        let (slope, bend) = (R::add(simd, to, from), R::sub(simd, to, from));
        let least = R::max(simd, R::abs(simd, bend), R::splat(simd, LEAST));
        let square = R::mul(simd, R::mul(simd, slope, slope), self.sharp);
        let vertex = R::div(simd, square, least);
        // Where the vertex is not within half a step, there is no extreme.
        let most = R::mul(simd, self.sharp, bend);
        let below = R::min(simd, vertex, R::max(simd, most, zero));
        let above = R::min(simd, vertex, R::max(simd, R::sub(simd, zero, most), zero));
        [R::sub(simd, was, below), R::add(simd, was, above)]
    }

    #[inline(always)]
    fn take<S: Simd, R: Number<Vector<S> = V>>(
        self,
        simd: S,
        node: &mut [V; NODE],
        low: V,
        high: V,
    ) {
        // As a number: a choice between two values would be stored under a mask, which is slow.
        let lower = R::less(simd, low, node[LOWEST]);
        node[WHEN] = R::mul_add(simd, lower, R::sub(simd, self.now, node[WHEN]), node[WHEN]);
        node[LOWEST] = R::min(simd, node[LOWEST], low);
        node[HIGHEST] = R::max(simd, node[HIGHEST], high);
    }
}

/// Smallest divisor: above 0 in both formats.
const LEAST: f64 = 1.2e-38;
