//! Where a vehicle is at each tick: courses of piecewise constant speed.

use super::run::{FARTHEST, LONGEST, nudge};
use crate::error::{Result, check, invalid, not_negative, positive};

/// How much earlier than a break a tick may be and still count as the break, as a part of a step:
/// so much that no rounding of its time decides.
const SOON: f64 = 1e-6;

/// How far the places of a course may be from where its speeds lead, m.
const GAP: f64 = 1e-6;

/// Where a course changes its speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// Time, s.
    pub time: f64,
    /// Place of the front axle, m.
    pub place: f64,
    /// Speed from there on, m/s; 0 for a vehicle that stands.
    pub speed: f64,
}

/// Between two breaks, as ticks see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// The first tick at or after the break, and the place of the front axle there, m.
    pub(super) first: i64,
    pub(super) place: f64,
    pub(super) speed: f64,
    /// How far a step goes, m.
    pub(super) reach: f64,
}

impl Piece {
    /// Place of the front axle at a tick, m.
    pub(super) fn place(&self, tick: i64) -> f64 {
        self.place + self.reach * (tick - self.first) as f64
    }

    /// How near a sample counts as the sample, m.
    pub(super) fn nudge(&self) -> f64 {
        nudge(self.reach)
    }
}

/// The front axle's way along a lane, of piecewise constant speed, on the grid of ticks `k dt` from
/// `t = 0`. The first speed holds before the first break too, the last one for ever.
///
/// A place is computed from its piece and tick alone, however a run is cut.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    pieces: Vec<Piece>,
    /// The first break's place, m.
    start: f64,
}

impl Course {
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for no break, times that do not increase or
    /// are more than 1e9 steps from 0, speeds below 0, and places where the speeds do not lead.
    pub(crate) fn new(breaks: &[Break], dt: f64) -> Result<Self> {
        positive("time step dt", dt, "s")?;
        let Some(Break { place: start, .. }) = breaks.first().copied() else {
            return Err(invalid("breaks of a course", 0, "at least 1"));
        };
        for (i, Break { time, place, speed }) in breaks.iter().enumerate() {
            let name = |quantity: &str| format!("break {i}: {quantity}");
            let latest = LONGEST as f64 * dt;
            check(&name("time"), *time, "s", "within 1e9 steps of 0", |t| t.abs() <= latest)?;
            let allowed = "within a million km of 0";
            check(&name("place"), *place, "m", allowed, |place| place.abs() <= FARTHEST)?;
            not_negative(&name("speed"), *speed, "m/s")?;
            if let Some(before) = i.checked_sub(1).map(|i| breaks[i]) {
                let allowed = format!("above that of the break before it, {:?} s", before.time);
                check(&name("time"), *time, "s", &allowed, |time| time > before.time)?;
                let led = before.place + before.speed * (time - before.time);
                let allowed = format!("{led:?} m, where the speed from the break before it leads");
                check(&name("place"), *place, "m", &allowed, |place| (place - led).abs() <= GAP)?;
            }
        }
        let piece = |&Break { time, place, speed }: &Break| {
            let first = (time / dt - SOON).ceil();
            let place = place + speed * first.mul_add(dt, -time);
            Piece { first: first as i64, place, speed, reach: speed * dt }
        };
        Ok(Self { pieces: breaks.iter().map(piece).collect(), start })
    }

    /// One speed for ever, from a place at tick 0.
    pub(super) fn steady(place: f64, speed: f64, dt: f64) -> Self {
        Self { pieces: vec![Piece { first: 0, place, speed, reach: speed * dt }], start: place }
    }

    /// Number of the break from which on the course is at a tick what it is; the first before it.
    pub(crate) fn number(&self, tick: i64) -> usize {
        self.pieces.partition_point(|piece| piece.first <= tick).saturating_sub(1)
    }

    /// The piece at a tick, and the first tick of the next one.
    pub(super) fn piece(&self, tick: i64) -> (&Piece, Option<i64>) {
        let number = self.number(tick);
        (&self.pieces[number], self.pieces.get(number + 1).map(|next| next.first))
    }

    /// Place of the front axle at a tick, m.
    pub(crate) fn place(&self, tick: i64) -> f64 {
        self.piece(tick).0.place(tick)
    }

    /// The first tick at which the front axle is at a place, m, or ahead of it; the last tick there is
    /// if it does not get there.
    pub(crate) fn first_from(&self, place: f64) -> i64 {
        let number = self.pieces.partition_point(|piece| piece.place < place).saturating_sub(1);
        let Piece { first, place: from, reach, .. } = self.pieces[number];
        let next = self.pieces.get(number + 1).map_or(i64::MAX, |next| next.first);
        if reach == 0.0 {
            return if from >= place { first } else { next };
        }
        let tick = first.saturating_add(((place - from) / reach - SOON).ceil() as i64);
        tick.min(next)
    }

    /// The first tick of a vehicle that rolls in: the one at which the front axle is `run_in` metres
    /// before the first break, or the one before that. A vehicle that stands at first has no run-in.
    pub(crate) fn first_tick(&self, run_in: f64) -> i64 {
        let Piece { first, place, reach, .. } = self.pieces[0];
        if reach == 0.0 {
            return first;
        }
        first + ((self.start - run_in - place) / reach + SOON).floor() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    const DT: f64 = 1e-3;

    fn at(time: f64, place: f64, speed: f64) -> Break {
        Break { time, place, speed }
    }

    #[test]
    fn places_are_those_of_the_breaks_however_late() -> Result<()> {
        let day = 86_400.0;
        let breaks =
            [at(day + 0.3, 12.0, 20.0), at(day + 1.3004, 32.008, 0.0), at(day + 3.0, 32.008, 5.0)];
        let course = Course::new(&breaks, DT)?;
        let tick = |time: f64| ((day + time) / DT).round() as i64;
        let places = [(-0.5, -4.0), (0.3, 12.0), (1.3, 32.0), (1.301, 32.008), (2.999, 32.008)];
        for (time, place) in places.into_iter().chain([(3.0, 32.008), (103.0, 532.008)]) {
            let found = course.place(tick(time));
            assert!((found - place).abs() < 1e-8, "{found} m at {time} s, not {place} m");
        }
        let numbers =
            [0.0, 0.299, 0.3, 1.3, 1.301, 2.999, 3.0].map(|time| course.number(tick(time)));
        assert_eq!(numbers, [0, 0, 0, 0, 1, 1, 2]);
        assert_eq!([0.3, 2.0, 9.0].map(|time| course.piece(tick(time)).0.speed), [20.0, 0.0, 5.0]);
        Ok(())
    }

    #[test]
    fn a_run_in_begins_at_the_tick_at_or_before_its_place() -> Result<()> {
        let course = Course::new(&[at(2.0, 0.0, 20.0)], DT)?;
        assert_eq!(course.first_tick(0.0), 2000);
        assert_eq!(course.first_tick(20.0), 1000);
        assert_eq!(course.first_tick(20.001), 999);
        assert_eq!(course.first_tick(60.0), -1000);
        let course = Course::new(&[at(2.0004, 5.0, 20.0)], DT)?;
        assert_eq!(course.first_tick(0.0), 2000);
        assert!((course.place(2000) - 4.992).abs() < 1e-9);
        let stands = Course::new(&[at(2.0, 0.0, 0.0), at(3.0, 0.0, 9.0)], DT)?;
        assert_eq!(stands.first_tick(20.0), 2000);
        Ok(())
    }

    #[test]
    fn a_course_that_cannot_be_is_refused() {
        let cases = [
            (vec![], "breaks of a course"),
            (vec![at(f64::NAN, 0.0, 1.0)], "break 0: time"),
            (vec![at(0.0, f64::INFINITY, 1.0)], "break 0: place"),
            (vec![at(0.0, 0.0, -1.0)], "break 0: speed"),
            (vec![at(1.0, 0.0, 1.0), at(1.0, 0.0, 1.0)], "break 1: time"),
            (vec![at(0.0, 0.0, 1.0), at(1.0, 1.1, 1.0)], "break 1: place"),
        ];
        for (breaks, expected) in cases {
            let refused = Course::new(&breaks, DT);
            assert!(matches!(refused, Err(Error::Invalid { name, .. }) if name == expected));
        }
    }
}
