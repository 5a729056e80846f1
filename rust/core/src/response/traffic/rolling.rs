//! Tire forces of all vehicles for some ticks, those of one kind side by side.

use std::num::NonZero;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::Active;
use super::gang::Forces;
use super::model::{Model, Surface};
use crate::error::Result;
use crate::lanes::lanes;
use crate::threads::in_order;
use crate::vehicle::Profile;
use crate::vehicle::linear::{Abreast, Member};

/// Forces of vehicles side by side at the ticks after the first, tick by tick, axle by axle, lane by
/// lane, N.
struct Group {
    forces: Vec<f64>,
    lanes: usize,
    axles: usize,
}

/// Forces of all vehicles.
pub(super) struct Rolled {
    groups: Vec<Group>,
    /// Of each active vehicle, its group and its lane; none on a smooth road.
    places: Vec<Option<(usize, usize)>>,
}

impl Rolled {
    /// Those of an active vehicle; none where they are the static loads.
    pub(super) fn of(&self, active: usize) -> Option<Forces<'_>> {
        self.places[active].map(|(group, lane)| {
            let Group { forces, lanes, axles } = &self.groups[group];
            Forces { values: forces, lanes: *lanes, lane, axles: *axles }
        })
    }
}

/// Let all vehicles roll on.
pub(super) fn roll(
    model: &Model,
    active: &mut [Active],
    ticks: &Range<i64>,
    threads: NonZero<usize>,
) -> Result<Rolled> {
    let profiles: Vec<Profile<'_>> = model.inputs.surfaces.iter().map(Surface::held).collect();
    let [lanes, _] = lanes();
    let kind = |&number: &usize| {
        let passage = active[number].passage;
        model.step(passage).map(|step| step.kind())
    };
    let mut numbers: Vec<usize> = (0..active.len()).collect();
    numbers.sort_by_key(|number| (kind(number), active[*number].passage));
    let alike = numbers.chunk_by(|a, b| kind(a) == kind(b)).filter(|some| kind(&some[0]).is_some());
    let groups: Vec<Vec<usize>> =
        alike.flat_map(|some| some.chunks(lanes).map(<[usize]>::to_vec)).collect();
    let mut places = vec![None; active.len()];
    for (number, group) in groups.iter().enumerate() {
        for (lane, &at) in group.iter().enumerate() {
            places[at] = Some((number, lane));
        }
    }
    let work = |group: &Vec<usize>| {
        let member = |&at: &usize| {
            Some((member(model, &profiles, &active[at])?, active[at].vehicle.as_deref()))
        };
        let members: Vec<_> = group.iter().filter_map(member).collect();
        let axles = members.first().map_or(0, |(member, _)| member.step.kind().1);
        let ticks = ticks.start + 1..ticks.end + 1;
        Arch::new().dispatch(Roll { members, lanes, axles, ticks })
    };
    let found = in_order(threads, groups.iter().collect(), work);
    let mut rolled = Vec::with_capacity(groups.len());
    for (group, found) in groups.iter().zip(found) {
        let (forces, states) = found?;
        for (&at, state) in group.iter().zip(states) {
            active[at].vehicle = Some(state);
        }
        rolled.push(forces);
    }
    Ok(Rolled { groups: rolled, places })
}

fn member<'a>(
    model: &'a Model,
    profiles: &'a [Profile<'a>],
    active: &'a Active,
) -> Option<Member<'a>> {
    let passage = &model.inputs.passages[active.passage];
    let surface = model.inputs.lanes[passage.lane].surface?;
    Some(Member {
        step: model.step(active.passage)?,
        profile: Some(&profiles[surface]),
        course: &model.courses[active.passage],
        begin: active.begin.rolls,
        counts: active.begin.counts.clone(),
    })
}

/// Vehicles of one kind.
struct Roll<'a> {
    members: Vec<(Member<'a>, Option<&'a [f64]>)>,
    lanes: usize,
    axles: usize,
    ticks: Range<i64>,
}

impl WithSimd for Roll<'_> {
    type Output = Result<(Group, Vec<Vec<f64>>)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { members, lanes, axles, ticks } = self;
        let count = members.len();
        let rows = (ticks.end - ticks.start) as usize;
        let mut forces = vec![0.0; rows * axles * lanes];
        let mut abreast = Abreast::new(lanes, members);
        abreast.run(simd, ticks, &mut forces)?;
        let states = (0..count).map(|lane| abreast.state(lane)).collect();
        Ok((Group { forces, lanes, axles }, states))
    }
}
