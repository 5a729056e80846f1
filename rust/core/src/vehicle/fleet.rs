//! Tire forces of one vehicle or of thousands, each over the profile on its own.

use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use pulp::{Arch, Simd, WithSimd};

use super::contact::Profile;
use super::linear::Lanes;
use super::model::Vehicle;
use super::nonlinear;
use super::record::{Keep, Record};
use crate::error::{Result, Watch, check, check_count, go_on, positive};

/// Farthest place from the origin of stations, m: a micrometre is lost in rounding beyond.
const FARTHEST: f64 = 1e9;

/// Most steps of a run.
const LONGEST: usize = 1_000_000_000;

/// How often the threads of a fleet are looked after.
const INTERVAL: Duration = Duration::from_millis(20);

/// One run over a profile at constant speed.
///
/// The vehicle starts at rest, at equilibrium on the level of the profile's first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Speed, m/s.
    pub speed: f64,
    /// Time step, s.
    pub dt: f64,
    /// Station of the front axle when the run starts, m.
    pub start: f64,
    /// Steps before the first one that is kept.
    pub skip: usize,
    /// Steps that are kept, along with the instant they start from.
    pub steps: usize,
    /// Whether a tire that would pull at the road leaves it.
    pub lift_off: bool,
    /// Error that a step may add to a tire force where lift-off or dry friction act, as a part of
    /// the static load: 1e-8 to 0.1.
    pub tolerance: f64,
}

impl Run {
    /// All steps.
    #[inline(always)]
    pub(super) fn total(&self) -> usize {
        self.skip.saturating_add(self.steps)
    }

    /// Place of the front axle at a step, m.
    #[inline(always)]
    pub(super) fn place(&self, step: usize) -> f64 {
        self.start + self.speed * self.dt * step as f64
    }

    /// Length of a step, m.
    #[inline(always)]
    pub(super) fn reach(&self) -> f64 {
        self.speed * self.dt
    }

    /// How near a sample counts as the sample, m.
    #[inline(always)]
    pub(super) fn nudge(&self) -> f64 {
        1e-6 * self.reach()
    }

    fn check(&self) -> Result<()> {
        positive("speed", self.speed, "m/s")?;
        positive("time step dt", self.dt, "s")?;
        nonlinear::check_tolerance(self.tolerance)?;
        check_count("steps", self.total(), "at most 1e9", |steps| steps <= LONGEST)?;
        for (name, place) in [("start", self.start), ("end", self.place(self.total()))] {
            let allowed = "within a million km of 0";
            check(name, place, "m", allowed, |place| place.abs() <= FARTHEST)?;
        }
        Ok(())
    }
}

/// A vehicle and its run.
#[derive(Debug, Clone, Copy)]
pub struct Passage<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Its run.
    pub run: Run,
}

impl Passage<'_> {
    fn is_linear(&self) -> bool {
        !self.run.lift_off && self.vehicle.frictions.is_empty()
    }
}

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
                nonlinear::run(passage, profile, keep, watch).map(|record| vec![record])
            }
            group => Arch::new().dispatch(Lanes { group, profile, keep, watch }),
        }
    };
    let mut records: Vec<Option<Record>> = passages.iter().map(|_| None).collect();
    let mut file = |group: &[usize], found: Vec<Record>| {
        for (&number, record) in group.iter().zip(found) {
            records[number] = Some(record);
        }
    };
    if groups.len() == 1 || threads.get() == 1 {
        let total: usize = groups.iter().map(|group| steps(passages, group)).sum();
        let mut done = 0;
        for group in &groups {
            let found = work(group, &mut |step, _| watch(done + step * group.len(), total))?;
            done += steps(passages, group);
            file(group, found);
        }
    } else {
        in_threads(passages, &groups, threads, &work, &mut file, watch)?;
    }
    Ok(records.into_iter().flatten().collect())
}

/// Steps of all vehicles of a group, as many for each as the longest run has.
fn steps(passages: &[Passage<'_>], group: &[usize]) -> usize {
    group.iter().map(|&number| passages[number].run.total()).max().unwrap_or(0) * group.len()
}

/// Numbers of the passages that go side by side, the longest first.
fn groups(passages: &[Passage<'_>]) -> Vec<Vec<usize>> {
    let lanes = Arch::new().dispatch(CountLanes);
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

struct CountLanes;

impl WithSimd for CountLanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

/// Share the groups out among threads while this one watches.
fn in_threads(
    passages: &[Passage<'_>],
    groups: &[Vec<usize>],
    threads: NonZero<usize>,
    work: &(impl Fn(&[usize], &mut Watch<'_>) -> Result<Vec<Record>> + Sync),
    file: &mut impl FnMut(&[usize], Vec<Record>),
    watch: &mut Watch<'_>,
) -> Result<()> {
    let total: usize = groups.iter().map(|group| steps(passages, group)).sum();
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
