//! [`PatchPool`]: patches that were used last, made once each.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::Patch;

/// A patch, once it is made.
type Slot = Arc<OnceLock<Arc<Patch>>>;

/// Keeps as many patches as it was told. What it returns never depends on what it kept.
#[derive(Debug)]
pub(crate) struct PatchPool {
    capacity: usize,
    /// The one used last is at the back.
    slots: Mutex<VecDeque<(u64, Slot)>>,
}

impl PatchPool {
    pub(crate) fn new(capacity: usize) -> Self {
        Self { capacity: capacity.max(1), slots: Mutex::new(VecDeque::new()) }
    }

    /// The patch of this number. Threads that want one that is being made wait; the others do not.
    pub(crate) fn get(&self, number: u64, make: impl FnOnce() -> Patch) -> Arc<Patch> {
        let slot = {
            // A panic elsewhere cannot have left the list half changed.
            let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            let found = slots.iter().rposition(|(n, _)| *n == number);
            let entry = found.and_then(|i| slots.remove(i)).unwrap_or_else(|| (number, Arc::default()));
            slots.push_back(entry.clone());
            while slots.len() > self.capacity {
                slots.pop_front();
            }
            entry.1
        };
        slot.get_or_init(|| Arc::new(make())).clone()
    }
}
