//! The Python extension `pavefem._core`: convert, check, detach, call, map the error.
//!
//! Each class holds one of the core's and each function calls one of the core's; there is no physics
//! here. Arrays are copied in before the interpreter is let go.

mod asphalt;
mod beams;
mod convert;
mod coupling;
mod pavement;
mod roughness;
mod traffic;
mod vehicle;
mod watch;

use pyo3::prelude::*;

#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::asphalt::{binder_stiffness, mix_modulus};
    #[pymodule_export]
    use crate::beams::{SimplySupportedBeam, WinklerBeam};
    #[pymodule_export]
    use crate::coupling::two_way;
    #[pymodule_export]
    use crate::pavement::{Banded, Stepper, Strip, Transition, Window};
    #[pymodule_export]
    use crate::roughness::iri;
    #[pymodule_export]
    use crate::traffic::Traffic;
    #[pymodule_export]
    use crate::vehicle::{Vehicle, fleet_forces, forces_in_blocks};

    #[pymodule_export]
    const GRAVITY: f64 = pavefem_core::vehicle::GRAVITY;
    #[pymodule_export]
    const DENSE_LIMIT: usize = pavefem_core::transition::DENSE_LIMIT;
    #[pymodule_export]
    const IRI_BASE: f64 = pavefem_core::roughness::BASE;
    #[pymodule_export]
    const IRI_START: f64 = pavefem_core::roughness::START;
    #[pymodule_export]
    const TIRE_PRINT: f64 = pavefem_core::asphalt::TIRE_PRINT;
    #[pymodule_export]
    const TRACK_SHARE: f64 = pavefem_core::pavement::load::TRACK_SHARE;
}
