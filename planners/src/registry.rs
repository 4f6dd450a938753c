//! The methods that exist. A new one costs its file, its `pub mod` and one line here.

use crate::method::Method;

/// Every method, in the order in which help lists them.
pub static METHODS: &[&Method] = &[
    &crate::straight::METHOD,
    &crate::apf::METHOD,
    &crate::decentralized_apf::METHOD,
    &crate::rpoa::METHOD,
    &crate::liquid::offline::METHOD,
    &crate::liquid::online::METHOD,
    &crate::pso_via_points::METHOD,
    &crate::amr_apf::METHOD,
    &crate::dapf::METHOD,
];

/// The method of that name.
pub fn find(name: &str) -> Option<&'static Method> {
    METHODS.iter().copied().find(|method| method.name == name)
}
