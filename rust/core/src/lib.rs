//! Vehicles roll over a profile, their tire forces load a pavement, the pavement answers.
//!
//! The model is that of Romero Navarrete, Lozano Guzman and Arroyo Contreras, "A Finite Element
//! Model to assess flexible pavement vehicle interaction"; equation, table and figure numbers in
//! this crate are theirs. All quantities are SI unless a name says otherwise.
//!
//! | symbol | meaning | unit | where |
//! |---|---|---|---|
//! | `E_b`, `E` | binder and mix stiffness (eqs. 7-8) | Pa | [`asphalt`] |
//! | `EI`, `c_EI` | bending stiffness and damping of the asphalt beam | N m^2, N m^2 s | [`pavement`] |
//! | `k`, `c`, `m` | stiffness, damping and mass of the bed, per metre | N/m^2, N s/m^2, kg/m | [`pavement`] |
//! | `M`, `C`, `K` | matrices of `M u'' + C u' + K u = f` (eqs. 1-6) | | [`transition::System`] |
//! | `Phi`, `Gamma` | state transition and particular response (eqs. 9-12) | | [`transition`] |
//! | `w`, `theta` | deflection, up positive, and slope | m, 1 | [`response`] |
//! | `F` | axle force, positive pressing on the road | N | [`vehicle`] |
//! | IRI | international roughness index | m/km | [`roughness`] |
//!
//! Data flows one way, but for [`coupling`]: sections make a [`pavement::Mesh`], a [`vehicle::Vehicle`] over a profile
//! makes forces, and deflections come of them by a window that moves with the vehicle
//! ([`response::window::Road`]), or by the whole [`pavement::Strip`] and its
//! [`transition::Transition`] ([`response::dense::Stepper`]).

mod aligned;
pub mod analytical;
pub mod asphalt;
pub mod coupling;
pub mod error;
mod lanes;
pub mod linalg;
pub mod pavement;
pub mod response;
pub mod roughness;
mod threads;
pub mod transition;
pub mod vehicle;
