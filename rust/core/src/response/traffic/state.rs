//! All that a run of traffic needs to be gone on with, as words of eight bytes.

use super::events::{Ride, Totals, Worst};
use super::gang::{Axle, OnRoad};
use super::{Active, Traffic};
use crate::error::{Result, invalid};

/// What such a state begins with: a name and a version.
const MARK: u64 = u64::from_le_bytes(*b"pavefem\x01");

impl Traffic {
    /// All that changes as the run goes on.
    #[must_use]
    pub fn state(&self) -> Vec<u8> {
        let mut words = Words(vec![MARK]);
        words.count(self.begins.len());
        words.count(self.totals.len());
        words.count(self.model.len());
        words.whole(self.tick);
        words.count(self.begun);
        words.0.push(self.steps);
        words.count(self.active.len());
        for Active { passage, vehicle, on, .. } in &self.active {
            words.count(*passage);
            words.optional(vehicle.as_ref(), |words, vehicle| words.numbers(vehicle));
            words.optional(on.as_ref(), Words::on_road);
        }
        for totals in &self.totals {
            words.totals(totals);
        }
        for Worst { lowest, place, strain } in &self.worst {
            for number in [lowest, place, strain] {
                words.number(*number);
            }
        }
        for ride in &self.rides {
            words.optional(ride.as_ref(), Words::ride);
        }
        words.0.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    /// Go back, or on, to a state of the same run.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for what is no state, or that of another run;
    /// nothing has changed then.
    pub fn restore(&mut self, state: &[u8]) -> Result<()> {
        let found = self.read(state);
        let Some(Read { tick, begun, steps, active, totals, worst, rides }) = found else {
            let given = format!("{} bytes", state.len());
            return Err(invalid("state", given, "that of a run with the same inputs, undamaged"));
        };
        (self.tick, self.begun, self.steps) = (tick, begun, steps);
        (self.active, self.totals, self.worst, self.rides) = (active, totals, worst, rides);
        Ok(())
    }

    fn read(&self, state: &[u8]) -> Option<Read> {
        let (words, rest) = state.as_chunks::<8>();
        let mut words = Reader { words: words.iter(), left: words.len() };
        let of_this = [self.begins.len(), self.totals.len(), self.model.len()];
        let same = words.word()? == MARK
            && of_this.into_iter().all(|count| words.count() == Some(count))
            && rest.is_empty();
        if !same {
            return None;
        }
        let tick = words.word()? as i64;
        let begun = words.count().filter(|begun| *begun <= self.order.len())?;
        let steps = words.word()?;
        let active = (0..words.size()?).map(|_| {
            let passage = words.count().filter(|passage| *passage < self.begins.len())?;
            let begin = self.begins[passage].clone();
            let vehicle = words.optional(Reader::numbers)?;
            let on = words.optional(Reader::on_road)?;
            Some(Active { passage, begin, vehicle, on })
        });
        let active = active.collect::<Option<Vec<Active>>>()?;
        let totals = self.totals.iter().map(|like| words.totals(like));
        let totals = totals.collect::<Option<Vec<Totals>>>()?;
        let worst = self.begins.iter().map(|_| {
            let [lowest, place, strain] = [words.number()?, words.number()?, words.number()?];
            Some(Worst { lowest, place, strain })
        });
        let worst = worst.collect::<Option<Vec<Worst>>>()?;
        let rides = self.begins.iter().map(|_| words.optional(Reader::ride));
        let rides = rides.collect::<Option<Vec<Option<Ride>>>>()?;
        (words.left == 0).then_some(Read { tick, begun, steps, active, totals, worst, rides })
    }
}

/// What stands in a state.
struct Read {
    tick: i64,
    begun: usize,
    steps: u64,
    active: Vec<Active>,
    totals: Vec<Totals>,
    worst: Vec<Worst>,
    rides: Vec<Option<Ride>>,
}

struct Words(Vec<u64>);

impl Words {
    fn count(&mut self, count: usize) {
        self.0.push(count as u64);
    }

    fn whole(&mut self, number: i64) {
        self.0.push(number as u64);
    }

    fn number(&mut self, number: f64) {
        self.0.push(number.to_bits());
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.count(numbers.len());
        self.0.extend(numbers.iter().map(|number| number.to_bits()));
    }

    fn optional<T>(&mut self, value: Option<T>, write: impl FnOnce(&mut Self, T)) {
        self.count(usize::from(value.is_some()));
        if let Some(value) = value {
            write(self, value);
        }
    }

    fn on_road(&mut self, on: &OnRoad) {
        for count in [on.passage, on.first, on.nodes] {
            self.count(count);
        }
        self.whole(on.start);
        self.whole(on.loaded);
        self.count(usize::from(on.late));
        self.numbers(&on.motion);
        self.count(on.axles.len());
        for (axle, forces) in on.axles.iter().zip(&on.forces) {
            self.number(axle.behind);
            for count in [axle.left, axle.reached, axle.from, axle.to] {
                self.count(count);
            }
            for force in forces {
                self.number(*force);
            }
        }
    }

    fn ride(&mut self, ride: &Ride) {
        self.count(ride.instants);
        self.count(ride.axle);
        for number in [ride.dlc, ride.force, ride.place] {
            self.number(number);
        }
    }

    fn totals(&mut self, totals: &Totals) {
        for numbers in totals.numbers() {
            self.numbers(numbers);
        }
        self.0.extend(&totals.passes);
        self.0.extend(totals.histogram.iter().map(|&count| u64::from(count)));
    }
}

struct Reader<'a> {
    words: std::slice::Iter<'a, [u8; 8]>,
    left: usize,
}

impl Reader<'_> {
    fn word(&mut self) -> Option<u64> {
        let word = self.words.next()?;
        self.left -= 1;
        Some(u64::from_le_bytes(*word))
    }

    fn count(&mut self) -> Option<usize> {
        usize::try_from(self.word()?).ok()
    }

    /// A count of what follows, each of a word at least.
    fn size(&mut self) -> Option<usize> {
        self.count().filter(|count| *count <= self.left)
    }

    fn number(&mut self) -> Option<f64> {
        self.word().map(f64::from_bits)
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = self.size()?;
        (0..count).map(|_| self.number()).collect()
    }

    fn optional<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<Option<T>> {
        match self.word()? {
            0 => Some(None),
            1 => read(self).map(Some),
            _ => None,
        }
    }

    fn on_road(&mut self) -> Option<OnRoad> {
        let [passage, first, nodes] = [self.count()?, self.count()?, self.count()?];
        let [start, loaded] = [self.word()? as i64, self.word()? as i64];
        let late = self.word()? == 1;
        let motion = self.numbers()?;
        let both = (0..self.size()?).map(|_| {
            let behind = self.number()?;
            let [left, reached, from, to] =
                [self.count()?, self.count()?, self.count()?, self.count()?];
            let forces = [self.number()?, self.number()?];
            Some((Axle { behind, left, reached, from, to }, forces))
        });
        let (axles, forces) = both.collect::<Option<Vec<_>>>()?.into_iter().unzip();
        let finished = false;
        Some(OnRoad { passage, first, nodes, motion, axles, forces, start, loaded, late, finished })
    }

    fn ride(&mut self) -> Option<Ride> {
        let [instants, axle] = [self.count()?, self.count()?];
        let [dlc, force, place] = [self.number()?, self.number()?, self.number()?];
        Some(Ride { instants, dlc, force, axle, place })
    }

    /// Totals of the same sizes as others.
    fn totals(&mut self, like: &Totals) -> Option<Totals> {
        let mut totals = like.clone();
        for numbers in totals.numbers_mut() {
            let found = self.numbers().filter(|found| found.len() == numbers.len())?;
            *numbers = found;
        }
        for passes in &mut totals.passes {
            *passes = self.word()?;
        }
        for count in &mut totals.histogram {
            *count = u32::try_from(self.word()?).ok()?;
        }
        Some(totals)
    }
}
