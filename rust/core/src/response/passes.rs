//! Which axle each node is nearest to.

use crate::pavement::Mesh;
use crate::pavement::load::Loads;

/// How far along the road the axles are, instant after instant.
///
/// A node belongs to the axle that is nearest to it: to the first one until the middle between that
/// and the second has gone past, and so on.
#[derive(Debug)]
pub(super) struct Passes<'a> {
    mesh: &'a Mesh,
    loads: Loads<'a>,
    /// The axles from the front to the back.
    order: Vec<usize>,
    /// For the middle behind each axle but the last: the first node that is ahead of it, and its place.
    ahead: Vec<(usize, f64)>,
}

impl<'a> Passes<'a> {
    /// From an instant on.
    pub(super) fn new(mesh: &'a Mesh, loads: &Loads<'a>, instant: usize) -> Self {
        let row = loads.places(instant);
        let mut order: Vec<usize> = (0..loads.axles).collect();
        order.sort_by(|a, b| row[*b].total_cmp(&row[*a]));
        let ahead = vec![(0, mesh.node(0)); loads.axles - 1];
        let mut passes = Self { mesh, loads: *loads, order, ahead };
        for at in 0..passes.ahead.len() {
            let node = mesh.place(passes.middle(instant, at)).map_or(0, |place| place.element);
            passes.ahead[at] = (node, mesh.node(node));
        }
        passes.advance(instant, |_, _| ());
        passes
    }

    /// Number of axles.
    pub(super) fn axles(&self) -> usize {
        self.order.len()
    }

    /// Go on to an instant: `leave(node, axle)` is called where a node is no longer nearest to an axle.
    #[inline(always)]
    pub(super) fn advance(&mut self, instant: usize, mut leave: impl FnMut(usize, usize)) {
        // From the front on, so that a node that two middles pass within a step leaves axle by axle.
        for at in 0..self.ahead.len() {
            let middle = self.middle(instant, at);
            let (mut node, mut place) = self.ahead[at];
            while place < middle {
                if node == self.mesh.len() {
                    break;
                }
                leave(node, self.order[at]);
                node += 1;
                place = if node < self.mesh.len() { self.mesh.node(node) } else { f64::INFINITY };
            }
            self.ahead[at] = (node, place);
        }
    }

    /// The axle that a node is nearest to.
    pub(super) fn axle(&self, node: usize) -> usize {
        self.order[self.ahead.iter().take_while(|(ahead, _)| node < *ahead).count()]
    }

    #[inline(always)]
    fn middle(&self, instant: usize, at: usize) -> f64 {
        let row = self.loads.places(instant);
        0.5 * (row[self.order[at]] + row[self.order[at + 1]])
    }
}
