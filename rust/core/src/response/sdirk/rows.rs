//! The block rows of a window: of each node, or one for all nodes of a uniform road.

use nalgebra::Matrix2;
use pulp::Simd;

use super::number::Number;
use super::{LATE, NODE, pair};
use crate::pavement::{Foundation, Mesh};

/// Numbers of a symmetric block row that are kept: the diagonal block and the one right of it.
const ROW: usize = 7;

/// Where the block rows of a node stand that a step reads: `M`, `h K` and `l (M - h^2 K)` (the
/// diagonal, 3 numbers, and right of it, 4); of the factors `L` (4) and the inverse of `D` (3); and
/// the curvature at the node from six numbers: of the node before it, of its own, of the next.
const FACTOR: usize = 3 * ROW;
const CURVATURE: usize = 4 * ROW;
pub(super) const ROWS: usize = CURVATURE + 6;

/// The matrices of a step.
#[derive(Debug, Clone, Copy)]
pub(super) enum Matrix {
    Mass,
    Stiffness,
    Later,
}

/// Numbers of the factors of a node.
pub(super) const FACTORS: usize = ROW;

/// On a uniform road a row is its own mirror image: of each matrix only `(w, w)`, `(theta, theta)`,
/// and to the right `(w, w)`, `(w, theta)` and `(theta, theta)`; then what two differences are worth in
/// the curvature.
const MIRRORED: usize = 5;
const EVEN_CURVATURE: usize = 3 * MIRRORED;
pub(super) const EVEN: usize = EVEN_CURVATURE + 2;

/// Block rows as a step reads them.
pub(super) trait Rows<S: Simd, R: Number>: Copy {
    /// Row `i` of a matrix times a pair of each node.
    fn apply(
        self,
        simd: S,
        matrix: Matrix,
        nodes: &[[R::Vector<S>; NODE]],
        x: usize,
        i: usize,
    ) -> [R::Vector<S>; 2];

    /// A number of the factors of row `i`: `L`, then the inverse of `D`.
    fn factor(self, simd: S, i: usize, number: usize) -> R::Vector<S>;

    /// The curvature at node `i`.
    fn curvature(self, simd: S, nodes: &[[R::Vector<S>; NODE]], u: usize, i: usize)
    -> R::Vector<S>;
}

/// One row for all nodes, in each lane its own; and the factors, which change no more from some node on.
#[derive(Clone, Copy)]
pub(super) struct Even<'a, V> {
    pub(super) row: &'a [V; EVEN],
    pub(super) factors: &'a [[V; FACTORS]],
}

impl<S: Simd, R: Number> Rows<S, R> for Even<'_, R::Vector<S>> {
    /// The sums and differences of the neighbours serve all matrices: the compiler sees it.
    #[inline(always)]
    fn apply(
        self,
        simd: S,
        matrix: Matrix,
        nodes: &[[R::Vector<S>; NODE]],
        x: usize,
        i: usize,
    ) -> [R::Vector<S>; 2] {
        let a = |number: usize| self.row[matrix as usize * MIRRORED + number];
        let (left, here, right) =
            (pair(&nodes[i - 1], x), pair(&nodes[i], x), pair(&nodes[i + 1], x));
        let sums = [0, 1].map(|k| R::add(simd, left[k], right[k]));
        let differences = [0, 1].map(|k| R::sub(simd, right[k], left[k]));
        let force = R::mul_add(simd, a(2), sums[0], R::mul(simd, a(0), here[0]));
        let moment = R::mul_add(simd, a(4), sums[1], R::mul(simd, a(1), here[1]));
        [
            R::mul_add(simd, a(3), differences[1], force),
            R::mul_sub(simd, a(3), differences[0], moment),
        ]
    }

    #[inline(always)]
    fn factor(self, _: S, i: usize, number: usize) -> R::Vector<S> {
        self.factors[i.min(self.factors.len() - 1)][number]
    }

    #[inline(always)]
    fn curvature(
        self,
        simd: S,
        nodes: &[[R::Vector<S>; NODE]],
        u: usize,
        i: usize,
    ) -> R::Vector<S> {
        let (left, here, right) =
            (pair(&nodes[i - 1], u), pair(&nodes[i], u), pair(&nodes[i + 1], u));
        let sum = R::add(simd, left[0], right[0]);
        let bend = R::sub(simd, sum, R::add(simd, here[0], here[0]));
        let turn = R::sub(simd, right[1], left[1]);
        let turn = R::mul(simd, self.row[EVEN_CURVATURE + 1], turn);
        R::mul_add(simd, self.row[EVEN_CURVATURE], bend, turn)
    }
}

/// A row for each node.
#[derive(Clone, Copy)]
pub(super) struct Each<N>(pub(super) N);

/// The numbers of a row for each node.
pub(super) trait Numbers<S: Simd, R: Number>: Copy {
    fn number(self, simd: S, node: usize, number: usize) -> R::Vector<S>;
}

/// One copy of them for all lanes.
#[derive(Clone, Copy)]
pub(super) struct Shared<'a>(pub(super) &'a [[f64; ROWS]]);

impl<S: Simd, R: Number> Numbers<S, R> for Shared<'_> {
    #[inline(always)]
    fn number(self, simd: S, node: usize, number: usize) -> R::Vector<S> {
        R::splat(simd, self.0[node][number])
    }
}

/// Those of each lane.
#[derive(Clone, Copy)]
pub(super) struct Laned<'a, V>(pub(super) &'a [[V; ROWS]]);

impl<S: Simd, R: Number> Numbers<S, R> for Laned<'_, R::Vector<S>> {
    #[inline(always)]
    fn number(self, _: S, node: usize, number: usize) -> R::Vector<S> {
        self.0[node][number]
    }
}

impl<S: Simd, R: Number, N: Numbers<S, R>> Rows<S, R> for Each<N> {
    /// In two sums a row, whose latencies overlap.
    #[inline(always)]
    fn apply(
        self,
        simd: S,
        matrix: Matrix,
        nodes: &[[R::Vector<S>; NODE]],
        x: usize,
        i: usize,
    ) -> [R::Vector<S>; 2] {
        let a = |node, k| self.0.number(simd, node, matrix as usize * ROW + k);
        let (left, here, right) =
            (pair(&nodes[i - 1], x), pair(&nodes[i], x), pair(&nodes[i + 1], x));
        let row = |[l0, l1, h0, h1, r0, r1]: [R::Vector<S>; 6]| {
            let near = R::mul_add(simd, h1, here[1], R::mul(simd, h0, here[0]));
            let near = R::mul_add(simd, l0, left[0], near);
            let far = R::mul_add(simd, r1, right[1], R::mul(simd, r0, right[0]));
            R::add(simd, near, R::mul_add(simd, l1, left[1], far))
        };
        [
            row([a(i - 1, 3), a(i - 1, 5), a(i, 0), a(i, 1), a(i, 3), a(i, 4)]),
            row([a(i - 1, 4), a(i - 1, 6), a(i, 1), a(i, 2), a(i, 5), a(i, 6)]),
        ]
    }

    #[inline(always)]
    fn factor(self, simd: S, i: usize, number: usize) -> R::Vector<S> {
        self.0.number(simd, i, FACTOR + number)
    }

    #[inline(always)]
    fn curvature(
        self,
        simd: S,
        nodes: &[[R::Vector<S>; NODE]],
        u: usize,
        i: usize,
    ) -> R::Vector<S> {
        let mut sum = R::splat(simd, 0.0);
        for (at, node) in nodes[i - 1..=i + 1].iter().enumerate() {
            for k in 0..2 {
                let weight = self.0.number(simd, i, CURVATURE + 2 * at + k);
                sum = R::mul_add(simd, weight, node[u + k], sum);
            }
        }
        sum
    }
}

/// The block rows that a step reads, of so many nodes from `first` on and of one on both sides.
pub(super) fn factored(mesh: &Mesh, first: usize, nodes: usize, h: f64) -> Vec<[f64; ROWS]> {
    let mut rows = vec![[0.0; ROWS]; nodes + 2];
    let mut factors = Factors::new();
    for i in 0..nodes {
        let node = first + i;
        let blocks = row_of(mesh, node, i + 1 == nodes);
        let held = [0, 1].map(|k| mesh.holds(2 * node + k));
        factors.next(&blocks, h, held);
        rows[i + 1] = numbers(&blocks, &factors, curvature_at(mesh, node), h);
    }
    rows
}

/// The row of a node on a uniform road, in short, and the factors of the nodes of a window there, as far
/// as they change; the first is of no node.
pub(super) fn even(
    mesh: &Mesh,
    element: usize,
    nodes: usize,
    h: f64,
) -> ([f64; EVEN], Vec<[f64; FACTORS]>) {
    let blocks = mesh.block_row_within(element);
    let mut factors = Factors::new();
    let mut found = vec![[0.0; FACTORS]];
    for _ in 0..nodes {
        factors.next(&blocks, h, [false; 2]);
        let now = factors.numbers();
        let settled = found.last() == Some(&now);
        found.push(now);
        if settled {
            break;
        }
    }
    let row = numbers(&blocks, &factors, even_curvature(mesh, element), h);
    (shortened(&row), found)
}

/// An even row in the short form of [`EVEN`].
fn shortened(row: &[f64; ROWS]) -> [f64; EVEN] {
    let mut short = [0.0; EVEN];
    for matrix in 0..3 {
        let of = &row[matrix * ROW..(matrix + 1) * ROW];
        short[matrix * MIRRORED..][..MIRRORED]
            .copy_from_slice(&[of[0], of[2], of[3], of[4], of[6]]);
    }
    short[EVEN_CURVATURE..].copy_from_slice(&[row[CURVATURE], row[CURVATURE + 5]]);
    short
}

/// The whole of a row in its short form, with its factors.
pub(super) fn lengthened(short: &[f64], factors: &[f64]) -> [f64; ROWS] {
    let mut row = [0.0; ROWS];
    for matrix in 0..3 {
        let of = &short[matrix * MIRRORED..][..MIRRORED];
        let whole = [of[0], 0.0, of[1], of[2], of[3], -of[3], of[4]];
        row[matrix * ROW..][..ROW].copy_from_slice(&whole);
    }
    row[FACTOR..CURVATURE].copy_from_slice(factors);
    let [bend, turn] = [short[EVEN_CURVATURE], short[EVEN_CURVATURE + 1]];
    row[CURVATURE..].copy_from_slice(&[bend, -turn, -2.0 * bend, 0.0, bend, turn]);
    row
}

type Blocks = [[Matrix2<f64>; 2]; 3];

/// Factors of `M + h C + h^2 K` as far as a node.
struct Factors {
    /// The block from the node to the next one.
    right: Matrix2<f64>,
    lower: Matrix2<f64>,
    inverse: Matrix2<f64>,
}

impl Factors {
    fn new() -> Self {
        let zero = Matrix2::zeros();
        Self { right: zero, lower: zero, inverse: zero }
    }

    /// Go on to a node.
    fn next(&mut self, [mass, damping, stiffness]: &Blocks, h: f64, held: [bool; 2]) {
        let sum = |k: usize| mass[k] + (damping[k] + stiffness[k] * h) * h;
        let mut diagonal = sum(0);
        for k in (0..2).filter(|k| held[*k]) {
            diagonal[(k, k)] = 1.0;
        }
        self.lower = self.right.transpose() * self.inverse;
        let pivot = diagonal - self.lower * self.right;
        self.inverse = pivot.try_inverse().unwrap_or(Matrix2::repeat(f64::NAN));
        self.right = sum(1);
    }

    fn numbers(&self) -> [f64; FACTORS] {
        let ([a, b, c], [d, e, f, g]) = (symmetric(&self.inverse), whole(&self.lower));
        [d, e, f, g, a, b, c]
    }
}

fn symmetric(a: &Matrix2<f64>) -> [f64; 3] {
    [a[(0, 0)], a[(0, 1)], a[(1, 1)]]
}

fn whole(a: &Matrix2<f64>) -> [f64; 4] {
    [a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]]
}

fn numbers(
    [mass, _, stiffness]: &Blocks,
    factors: &Factors,
    curvature: [f64; 6],
    h: f64,
) -> [f64; ROWS] {
    let later = [0, 1].map(|k| (mass[k] - stiffness[k] * (h * h)) * LATE);
    let stiffness = stiffness.map(|block| block * h);
    let row = |[diagonal, right]: &[Matrix2<f64>; 2]| {
        let ([a, b, c], [d, e, f, g]) = (symmetric(diagonal), whole(right));
        [a, b, c, d, e, f, g]
    };
    let blocks = [row(mass), row(&stiffness), row(&later), factors.numbers()];
    let mut numbers = [0.0; ROWS];
    numbers[..CURVATURE].copy_from_slice(blocks.as_flattened());
    numbers[CURVATURE..].copy_from_slice(&curvature);
    numbers
}

/// The diagonal block of a node and the block right of it, of `M`, `C` and `K`; without the latter
/// at the last node of a window, and without the unknowns that the ends of the road hold.
fn row_of(mesh: &Mesh, node: usize, is_last: bool) -> Blocks {
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

/// Weights of the curvature at a node from the motion of three: where elements are equal on both
/// sides as [`Mesh::reading`] has it, of fourth order on a bed; elsewhere of the element ahead alone.
fn curvature_at(mesh: &Mesh, node: usize) -> [f64; 6] {
    let (before, ahead) = (node.checked_sub(1), node < mesh.elements());
    if let (Some(before), true) = (before, ahead)
        && mesh.uniform(before, node)
    {
        return even_curvature(mesh, node);
    }
    if ahead {
        let h = mesh.step(node);
        [0.0, 0.0, -6.0, -4.0 * h, 6.0, -2.0 * h].map(|weight| weight / (h * h))
    } else {
        let h = mesh.step(node - 1);
        [6.0, 2.0 * h, -6.0, 4.0 * h, 0.0, 0.0].map(|weight| weight / (h * h))
    }
}

/// The same within a uniform stretch.
fn even_curvature(mesh: &Mesh, element: usize) -> [f64; 6] {
    let h = mesh.step(element);
    let [bend, turn] = match mesh.foundation() {
        Foundation::Winkler => [2.0, 0.5],
        // The mean of both elements' own.
        Foundation::Bars => [3.0, 1.0],
    };
    [bend, turn * h, -2.0 * bend, 0.0, bend, -turn * h].map(|weight| weight / (h * h))
}
