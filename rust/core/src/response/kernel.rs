//! The inner loops of a step, in vectors as wide as the machine has.

use pulp::Simd;

use crate::linalg::DMatrix;
use crate::transition::System;

/// The bands of `M`, `C` and `K`, a diagonal after the other, rows filled up with zeros.
pub(super) struct Bands {
    /// Diagonals on each side of the main one.
    pub(super) half: usize,
    rows: usize,
    diagonals: [Vec<f64>; 3],
}

impl Bands {
    pub(super) fn new(system: &System, rows: usize) -> Self {
        let matrices = [&system.mass, &system.damping, &system.stiffness];
        let half = matrices.iter().map(|matrix| matrix.half()).max().unwrap_or(0);
        let n = system.len();
        let diagonals = matrices.map(|matrix| {
            let entry = |d: usize, i: usize| match (i + d).checked_sub(half) {
                Some(j) if i < n && j < n => matrix.get(i, j),
                _ => 0.0,
            };
            (0..=2 * half).flat_map(|d| (0..rows).map(move |i| entry(d, i))).collect()
        });
        Self { half, rows, diagonals }
    }

    /// `(M u, C u + M v, -K u, M v)` of a state with `half` zeros on each side.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(&self, simd: S, u: &[f64], v: &[f64], out: &mut [Vec<f64>; 4]) {
        let lanes = S::F64_LANES;
        let load = |from: &[f64], at: usize| S::as_simd_f64s(&from[at..at + lanes]).0[0];
        let [mass, damping, stiffness] = &self.diagonals;
        for row in (0..self.rows).step_by(lanes) {
            let [mut p, mut q, mut r, mut s] = [simd.splat_f64s(0.0); 4];
            for d in 0..=2 * self.half {
                let at = d * self.rows + row;
                let (u, v) = (load(u, row + d), load(v, row + d));
                let m = load(mass, at);
                p = simd.mul_add_f64s(m, u, p);
                q = simd.mul_add_f64s(load(damping, at), u, simd.mul_add_f64s(m, v, q));
                r = simd.mul_add_f64s(load(stiffness, at), u, r);
                s = simd.mul_add_f64s(m, v, s);
            }
            for (out, value) in out.iter_mut().zip([p, q, simd.neg_f64s(r), s]) {
                S::as_mut_simd_f64s(&mut out[row..row + lanes]).0[0] = value;
            }
        }
    }
}

/// Rows that one pass of the step keeps in registers, in vectors, by the width of the vectors: two
/// sums a row, and the 32 registers of AVX-512 or the 16 of older sets.
const fn tallest_panel(lanes: usize) -> usize {
    if lanes >= 8 { 8 } else { 4 }
}

/// `G` and `H` cut into panels of rows, each stored in the order in which the step reads it: for
/// each column the panel's rows of `G`, then those of `H`.
pub(super) struct Blocks {
    /// Numbers, from `offset` on, which is where a cache line starts.
    values: Vec<f64>,
    offset: usize,
    /// Height of each panel, in vectors.
    panels: Vec<usize>,
    /// Rows, those filled up with zeros included.
    pub(super) rows: usize,
}

impl Blocks {
    pub(super) fn new<S: Simd>(g: &DMatrix<f64>, h: &DMatrix<f64>) -> Self {
        let n = g.nrows();
        let lanes = S::F64_LANES;
        let vectors = n.div_ceil(lanes);
        // As even as they can be: a low panel would leave registers unused.
        let count = vectors.div_ceil(tallest_panel(lanes));
        let panels: Vec<usize> =
            (0..count).map(|i| (vectors * (i + 1)) / count - (vectors * i) / count).collect();
        let rows = vectors * lanes;
        let line = 8;
        let mut values = vec![0.0; 2 * rows * n + line];
        let offset = values.as_ptr().align_offset(line * size_of::<f64>()).min(line);
        let mut to = offset;
        let mut top = 0;
        for height in panels.iter().map(|vectors| vectors * lanes) {
            let filled = height.min(n - top);
            for column in 0..n {
                for matrix in [g, h] {
                    let from = &matrix.as_slice()[column * n + top..][..filled];
                    values[to..to + filled].copy_from_slice(from);
                    to += height;
                }
            }
            top += height;
        }
        Self { values, offset, panels, rows }
    }

    /// `u += H p + G q`, `v += G r + H s`, over `n` columns.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        n: usize,
        [p, q, r, s]: &[Vec<f64>; 4],
        u: &mut [f64],
        v: &mut [f64],
    ) {
        let x = [&p[..n], &q[..n], &r[..n], &s[..n]];
        let mut from = self.offset;
        let mut top = 0;
        for &vectors in &self.panels {
            let height = vectors * S::F64_LANES;
            let size = 2 * height * n;
            let values = &self.values[from..from + size];
            let (u, v) = (&mut u[top..top + height], &mut v[top..top + height]);
            match vectors {
                1 => panel::<S, 1>(simd, values, x, u, v),
                2 => panel::<S, 2>(simd, values, x, u, v),
                3 => panel::<S, 3>(simd, values, x, u, v),
                4 => panel::<S, 4>(simd, values, x, u, v),
                5 => panel::<S, 5>(simd, values, x, u, v),
                6 => panel::<S, 6>(simd, values, x, u, v),
                7 => panel::<S, 7>(simd, values, x, u, v),
                _ => panel::<S, 8>(simd, values, x, u, v),
            }
            from += size;
            top += height;
        }
    }
}

/// One panel of `V` vectors of rows, its sums in registers.
#[inline(always)]
fn panel<S: Simd, const V: usize>(
    simd: S,
    values: &[f64],
    [p, q, r, s]: [&[f64]; 4],
    u: &mut [f64],
    v: &mut [f64],
) {
    let (columns, _) = S::as_simd_f64s(values);
    let mut sum_u = [simd.splat_f64s(0.0); V];
    let mut sum_v = sum_u;
    let x = p.iter().zip(q).zip(r.iter().zip(s));
    for (column, ((p, q), (r, s))) in columns.chunks_exact(2 * V).zip(x) {
        let [p, q, r, s] = [p, q, r, s].map(|x| simd.splat_f64s(*x));
        let (g, h) = column.split_at(V);
        for i in 0..V {
            sum_u[i] = simd.mul_add_f64s(h[i], p, simd.mul_add_f64s(g[i], q, sum_u[i]));
            sum_v[i] = simd.mul_add_f64s(h[i], s, simd.mul_add_f64s(g[i], r, sum_v[i]));
        }
    }
    for (out, sum) in [(u, sum_u), (v, sum_v)] {
        let (out, _) = S::as_mut_simd_f64s(out);
        for (out, sum) in out.iter_mut().zip(sum) {
            *out = simd.add_f64s(*out, sum);
        }
    }
}
