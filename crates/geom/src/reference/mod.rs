//! Recorded and closed-form references.
