//! Which vehicles go side by side in the lanes of vectors, and which share pavement.

use std::ops::Range;

/// A vehicle on the pavement for some ticks.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) lane: usize,
    /// Where its window begins and ends at some instants, m, the first and the last tick included.
    pub(super) windows: Vec<Range<f64>>,
    /// Nodes of its window.
    pub(super) nodes: usize,
}

/// Vehicles that are stepped together: numbers of candidates. Those of one cluster stand next to each
/// other, the first one ahead.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Gang {
    pub(super) clusters: Vec<Vec<usize>>,
}

impl Gang {
    pub(super) fn len(&self) -> usize {
        self.members().count()
    }

    /// Its candidates, cluster by cluster.
    pub(super) fn members(&self) -> impl Iterator<Item = usize> {
        self.clusters.iter().flatten().copied()
    }
}

/// Share candidates out among gangs of at most `lanes` vehicles, clusters of more going alone.
pub(super) fn pack(candidates: &[Candidate], lanes: usize) -> Vec<Gang> {
    let mut clusters = clusters(candidates);
    // Windows of like length beside each other: all of a gang are as long as the longest.
    let size = |cluster: &[usize]| cluster.iter().map(|&at| candidates[at].nodes).max();
    clusters.sort_by_key(|cluster| (std::cmp::Reverse(cluster.len()), size(cluster)));
    let singles = clusters.partition_point(|cluster| cluster.len() > 1);
    let mut singles = clusters.split_off(singles).into_iter();
    let mut pairs: Vec<Gang> = Vec::new();
    for cluster in clusters {
        let room = |gang: &&mut Gang| gang.len() + cluster.len() <= lanes;
        if let Some(gang) = pairs.iter_mut().rev().take(LOOK_BACK).find(room) {
            gang.clusters.push(cluster);
        } else {
            pairs.push(Gang { clusters: vec![cluster] });
        }
    }
    for gang in &mut pairs {
        let empty = gang.len().next_multiple_of(lanes) - gang.len();
        gang.clusters.extend(singles.by_ref().take(empty));
    }
    let rest: Vec<Vec<usize>> = singles.collect();
    let rest = rest.chunks(lanes).map(|clusters| Gang { clusters: clusters.to_vec() });
    pairs.extend(rest);
    pairs
}

/// Gangs that are looked at for room.
const LOOK_BACK: usize = 64;

/// Candidates whose windows touch at some instant, directly or through others, from the front to the
/// back of each lane.
fn clusters(candidates: &[Candidate]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    let front = |at: usize| candidates[at].windows.first().map_or(0.0, |window| window.end);
    order.sort_by(|&a, &b| {
        let lanes = candidates[a].lane.cmp(&candidates[b].lane);
        lanes.then(front(b).total_cmp(&front(a))).then(a.cmp(&b))
    });
    let mut clusters: Vec<Vec<usize>> = Vec::new();
    for at in order {
        // The windows of a lane do not all end in the order in which they begin.
        let touches = |cluster: &Vec<usize>| {
            cluster.iter().rev().any(|&other| touch(&candidates[other], &candidates[at]))
        };
        let found: Vec<usize> = clusters
            .iter()
            .enumerate()
            .rev()
            .take(CLUSTERS_BACK)
            .filter(|(_, cluster)| touches(cluster))
            .map(|(number, _)| number)
            .collect();
        match found.split_last() {
            None => clusters.push(vec![at]),
            Some((&first, others)) => {
                for &other in others {
                    let more = clusters.remove(other);
                    clusters[first].extend(more);
                }
                clusters[first].push(at);
            }
        }
    }
    for cluster in &mut clusters {
        cluster.sort_by(|&a, &b| front(b).total_cmp(&front(a)).then(a.cmp(&b)));
    }
    clusters
}

/// Clusters of a lane that a vehicle behind them may still touch.
const CLUSTERS_BACK: usize = 4;

fn touch(a: &Candidate, b: &Candidate) -> bool {
    let meet = |(a, b): (&Range<f64>, &Range<f64>)| a.start < b.end && b.start < a.end;
    a.lane == b.lane && a.windows.iter().zip(&b.windows).any(meet)
}
