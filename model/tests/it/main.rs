//! What the nouns promise.

mod random;
