//! The values of one robot, by layer.

use crate::node::Node;
use model::key::{Asked, Named};

/// Values by layer, strongest first.
pub(crate) struct Layered<'a>(pub(crate) Vec<&'a Node>);

impl<'a> Layered<'a> {
    /// The strongest layer that has a key.
    pub(crate) fn layer(&self, key: impl Named) -> Option<&'a Node> {
        self.0.iter().copied().find(|layer| layer.has(key))
    }

    /// The value of a key in the strongest layer that has it; if none has, what its declaration says.
    pub(crate) fn get<K: Asked>(&self, key: K) -> K::Answer {
        self.layer(key).map_or_else(|| key.answer(None), |layer| layer.get(key))
    }
}
