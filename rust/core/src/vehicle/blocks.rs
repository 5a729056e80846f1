//! Tire forces of one vehicle in blocks, as they come: memory that does not grow with the run.

use pulp::Arch;

use super::contact::Profile;
use super::linear::Lanes;
use super::nonlinear;
use super::record::{Keep, Outlet, Take};
use super::run::Passage;
use crate::error::{Result, Watch, check_count};

/// Run a vehicle and hand over its forces, `instants` rows of one an axle at a time, fewer in the last
/// block. They are those of [`fleet`](super::fleet), to the last bit.
///
/// # Errors
/// As [`fleet`](super::fleet); `Stopped` also where `take` does not want to go on.
pub fn in_blocks<'a>(
    passage: &'a Passage<'a>,
    profile: &'a Profile<'a>,
    instants: usize,
    take: &'a mut Take<'a>,
    watch: &mut Watch<'_>,
) -> Result<()> {
    check_count("instants of a block", instants, "at least 1", |instants| instants >= 1)?;
    passage.run.check()?;
    let keep = Keep { every: Some(1), stations: Vec::new() };
    let outlet = Some(Outlet { instants, take });
    if passage.is_linear() {
        let group = std::slice::from_ref(passage);
        Arch::new().dispatch(Lanes { group, profile, keep: &keep, outlet, watch })?;
    } else {
        nonlinear::run(passage, profile, &keep, outlet, watch)?;
    }
    Ok(())
}
