//! The values of one robot, by layer.

use crate::node::Node;

/// Values by layer, strongest first.
pub(crate) struct Body<'a> {
    pub(crate) layers: Vec<&'a Node>,
    pub(crate) table: Node,
}

impl Body<'_> {
    /// The strongest layer that has a key; if none has, the key table.
    pub(crate) fn layer(&self, key: &str) -> &Node {
        self.layers.iter().copied().find(|layer| layer.has(key)).unwrap_or(&self.table)
    }

    pub(crate) fn given(&self, key: &str) -> Option<f64> {
        self.layer(key).float(key)
    }

    pub(crate) fn float(&self, key: &str) -> f64 {
        self.given(key).unwrap_or_default()
    }

    pub(crate) fn int(&self, key: &str) -> i128 {
        self.layer(key).int(key).unwrap_or_default()
    }

    pub(crate) fn text(&self, key: &str) -> &str {
        self.layer(key).text(key).unwrap_or_default()
    }
}
