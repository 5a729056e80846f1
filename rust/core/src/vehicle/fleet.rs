//! Tire forces of one vehicle or of thousands, each over the profile on its own.

use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use pulp::Arch;

use super::contact::Profile;
use super::linear::Lanes;
use super::model::Vehicle;
use super::nonlinear;
use super::record::{Keep, Record};
use super::run::{Passage, Run};
use crate::error::{Result, Watch, go_on};
use crate::lanes::lanes;

/// How often the threads of a fleet are looked after.
const INTERVAL: Duration = Duration::from_millis(20);

impl Vehicle {
    /// Tire forces over a road at constant speed.
    ///
    /// The answer has `steps + 1` rows of one force a tire, N, positive pressing on the road:
    /// `F = F_static + k (z_p - z) + c (dz_p/dt - dz/dt)`. Within a step the input is taken as
    /// linear in time, which the transition matrix follows exactly: the elevation between its
    /// values at both ends of the step (or, for a staircase, its mean), so that a kink or a jump
    /// costs no more than the second order in `dt`.
    ///
    /// # Errors
    /// As [`fleet`].
    pub fn tire_forces(
        &self,
        profile: &Profile<'_>,
        run: &Run,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<f64>> {
        let passage = Passage { vehicle: self, run: *run };
        let keep = Keep { every: Some(1), stations: Vec::new() };
        let one = NonZero::<usize>::MIN;
        let mut records = fleet(&[passage], profile, &keep, one, watch)?;
        Ok(records.pop().map(|record| record.history).unwrap_or_default())
    }
}

/// Tire forces of many vehicles, each over the profile on its own.
///
/// Vehicles of one kind (number of unknowns and of tires) go side by side in the lanes of a
/// vector; groups of them go over `threads`. Neither changes a number. The records are in the order
/// of the passages.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) for a run, a station or an interval out of range,
/// `NoMemory`, `Diverged`, `Unsettled` where lift-off or dry friction cannot be followed to the
/// tolerance, and `Stopped`.
pub fn fleet(
    passages: &[Passage<'_>],
    profile: &Profile<'_>,
    keep: &Keep,
    threads: NonZero<usize>,
    watch: &mut Watch<'_>,
) -> Result<Vec<Record>> {
    keep.check()?;
    for passage in passages {
        passage.run.check()?;
    }
    let groups = groups(passages);
    let work = |group: &[usize], watch: &mut Watch<'_>| {
        let group: Vec<_> = group.iter().map(|&number| passages[number]).collect();
        match group.as_slice() {
            [passage] if !passage.is_linear() => {
                nonlinear::run(passage, profile, keep, None, watch).map(|record| vec![record])
            }
            group => Arch::new().dispatch(Lanes { group, profile, keep, outlet: None, watch }),
        }
    };
    let mut records: Vec<Option<Record>> = passages.iter().map(|_| None).collect();
    let mut file = |group: &[usize], found: Vec<Record>| {
        for (&number, record) in group.iter().zip(found) {
            records[number] = Some(record);
        }
    };
    let total: usize = groups.iter().map(|group| steps(passages, group)).sum();
    if groups.len() == 1 || threads.get() == 1 {
        let mut done = 0;
        for group in &groups {
            let found = work(group, &mut |step, _| watch(done + step * group.len(), total))?;
            done += steps(passages, group);
            file(group, found);
        }
    } else {
        in_threads(&groups, total, threads, &work, &mut file, watch)?;
    }
    Ok(records.into_iter().flatten().collect())
}

/// Steps of all vehicles of a group, as many for each as the longest run has.
fn steps(passages: &[Passage<'_>], group: &[usize]) -> usize {
    group.iter().map(|&number| passages[number].run.total()).max().unwrap_or(0) * group.len()
}

/// Numbers of the passages that go side by side, the longest first.
fn groups(passages: &[Passage<'_>]) -> Vec<Vec<usize>> {
    let [lanes, _] = lanes();
    let kind = |&number: &usize| {
        let Passage { vehicle, run } = &passages[number];
        let alone = if passages[number].is_linear() { 0 } else { 1 + number };
        (alone, vehicle.tires.len(), vehicle.system().len(), run.total())
    };
    let mut numbers: Vec<usize> = (0..passages.len()).collect();
    numbers.sort_by_key(kind);
    let alike = |a: &usize, b: &usize| {
        let ((alone, tires, unknowns, _), other) = (kind(a), kind(b));
        (alone, tires, unknowns) == (other.0, other.1, other.2)
    };
    let mut groups: Vec<Vec<usize>> = numbers
        .chunk_by(alike)
        .flat_map(|alike| alike.chunks(lanes).map(<[usize]>::to_vec))
        .collect();
    groups.sort_by_key(|group| std::cmp::Reverse(steps(passages, group)));
    groups
}

/// Share the groups out among threads while this one watches.
fn in_threads(
    groups: &[Vec<usize>],
    total: usize,
    threads: NonZero<usize>,
    work: &(impl Fn(&[usize], &mut Watch<'_>) -> Result<Vec<Record>> + Sync),
    file: &mut impl FnMut(&[usize], Vec<Record>),
    watch: &mut Watch<'_>,
) -> Result<()> {
    let (next, done, stop) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let (send, receive) = mpsc::channel();
    let toil = |send: mpsc::Sender<_>| {
        while let Some(group) = groups.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut before = 0;
            let found = work(group, &mut |step, _| {
                done.fetch_add((step - before) * group.len(), Ordering::Relaxed);
                before = step;
                !stop.load(Ordering::Relaxed)
            });
            if send.send((group, found)).is_err() {
                return;
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.get().min(groups.len()) {
            let (send, toil) = (send.clone(), &toil);
            scope.spawn(move || toil(send));
        }
        drop(send);
        let mut outcome = Ok(());
        loop {
            match receive.recv_timeout(INTERVAL) {
                Ok((group, Ok(found))) => file(group, found),
                Ok((_, Err(error))) => outcome = outcome.and(Err(error)),
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => return outcome,
            }
            if outcome.is_ok() {
                outcome = go_on(watch, done.load(Ordering::Relaxed), total);
            }
            if outcome.is_err() {
                stop.store(true, Ordering::Relaxed);
                next.store(groups.len(), Ordering::Relaxed);
            }
        }
    })
}
